//! Tests of common tasks with `gaurast`: views, folders, outputs, comparisons, and early errors.

use std::path::Path;
use std::process::Command;

use tempfile::TempDir;

use super::support::{gaurast, succeeds, text};

/// Runs the command and checks that it fails with exit code 1 and one sentence, and writes no file.
#[track_caller]
fn fails(folder: &TempDir, arguments: &[&str], message: &str) {
    let before = files(folder);
    let output = gaurast(folder.path(), arguments);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {stderr}");
    assert_eq!(stderr.lines().count(), 1, "{arguments:?}: {stderr}");
    assert!(stderr.contains(message), "{arguments:?}: {stderr}");
    assert_eq!(files(folder), before, "{arguments:?} left a file");
}

fn files(folder: &TempDir) -> Vec<String> {
    let entries = std::fs::read_dir(folder.path()).expect("readable");
    let name =
        |entry: std::io::Result<std::fs::DirEntry>| text(entry.expect("an entry").file_name().as_encoded_bytes());
    let mut names: Vec<String> = entries.map(name).collect();
    names.sort();
    names
}

/// A PLY file of round Gaussians of this size, at these positions, with these colours.
fn scene(size: f64, gaussians: &[([f64; 3], [f64; 3])]) -> String {
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n", gaussians.len());
    for property in [
        "x", "y", "z", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3", "opacity", "f_dc_0",
        "f_dc_1", "f_dc_2",
    ] {
        text += &format!("property float {property}\n");
    }
    text += "end_header\n";
    let scale = size.ln();
    for ([x, y, z], colour) in gaussians {
        let [r, g, b] = colour.map(|c| (c - 0.5) / 0.282_094_791_773_878_14);
        text += &format!("{x} {y} {z} {scale} {scale} {scale} 1 0 0 0 5 {r} {g} {b}\n");
    }
    text
}

const RED: [f64; 3] = [1.0, 0.0, 0.0];
const GREEN: [f64; 3] = [0.0, 1.0, 0.0];

/// A folder with a scene of size 1: a red Gaussian in front (at small z), a green one behind it.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let gaussians = [([0.0, 0.0, -0.5], RED), ([0.0, 0.0, 0.5], GREEN)];
    std::fs::write(folder.path().join("two.ply"), scene(0.3, &gaussians)).expect("written");
    folder
}

/// The share of the pixels of `name` that are not black, and the mean colour.
fn covered(folder: &TempDir, name: &str) -> (f64, [f64; 3]) {
    let picture = image::open(folder.path().join(name)).expect("a picture").to_rgb8();
    let count = f64::from(picture.width() * picture.height());
    let drawn = picture.pixels().filter(|pixel| pixel.0 != [0; 3]).count() as f64;
    let mean = |channel: usize| picture.pixels().map(|p| f64::from(p.0[channel])).sum::<f64>() / count;
    (drawn / count, [mean(0), mean(1), mean(2)])
}

#[gaurast_runner::test]
fn a_tiny_scene_is_seen() {
    let folder = tempfile::tempdir().expect("a folder");
    for size in [0.02, 1e-5] {
        let gaussians = [([-size, 0.0, 0.0], RED), ([size, 0.0, 0.0], GREEN)];
        std::fs::write(folder.path().join("tiny.ply"), scene(0.3 * size, &gaussians)).expect("written");
        let small = ["tiny.ply", "--size", "64x48", "--force"];
        let stdout = succeeds(&folder, &small);
        assert!(stdout.contains("framed by --azimuth"), "{stdout}");
        let (share, [r, g, _]) = covered(&folder, "tiny.png");
        assert!(share > 0.05 && r > 3.0 && g > 3.0, "{size}: {share} {r} {g}");
    }
}

#[gaurast_runner::test]
fn a_picture_of_nothing_says_why() {
    let folder = folder();
    let away = ["two.ply", "--size", "32x24", "--eye", "0,0,-3", "--target", "0,0,-9"];
    let output = gaurast(folder.path(), &away);
    let stderr = text(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    assert!(
        stderr.contains("two.png: there is nothing in the picture: of 2 Gaussians: 2 before near plane (--near "),
        "{stderr}"
    );
    let strict = [&away[..], &["--strict", "-o", "b.png"]].concat();
    fails(&folder, &strict, "gaurast: there is nothing in the picture: of 2 Gaussians");
    let far = ["two.ply", "--size", "32x24", "--far", "0.3", "--strict", "-o", "b.png"];
    fails(&folder, &far, "2 beyond far plane (--far 0.3)");
}

#[gaurast_runner::test]
fn what_the_device_does_not_draw_together_is_one_sentence() {
    let folder = folder();
    for (modes, message) in [
        (&["--geometry", "2d", "--precision", "fp16"][..], "binary16"),
        (&["--geometry", "2d", "--camera", "fisheye"], "pinhole and orthographic"),
        (&["--geometry", "2d", "--antialiasing", "compensated"], "compensated opacity"),
        (&["--order", "per-pixel", "--precision", "fp16"], "order per-pixel"),
        (&["--camera", "equirectangular", "--precision", "fp16"], "panoramas"),
        (&["--depth", "--order", "per-pixel", "-o", "a.exr"], "depths"),
        (&["--depth", "-o", "a.png"], "no output is one"),
        (&["--near", "3", "--far", "2"], "the far plane is not beyond it"),
        (&["--fov", "1e-300"], "focal length"),
        (&["--background", "transparent", "-o", "a.jpg"], "cannot be transparent"),
        (&["--size", "16384x16384", "--depth", "-o", "a.exr"], "GiB of memory"),
    ] {
        fails(&folder, &[&["two.ply"], modes].concat(), message);
    }
    let mut command = Command::new(env!("CARGO_BIN_EXE_gaurast"));
    command.args(["two.ply", "-o", "a.png"]).current_dir(&folder);
    let output = command.env("GAURAST_THREADS", "1000").output().expect("it starts");
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.starts_with("gaurast: vkCreateDevice: GAURAST_THREADS=1000: "), "{stderr}");
    assert_eq!(files(&folder), ["two.ply"]);
}

#[gaurast_runner::test(needs = [gaurast_runner::Need::File("/dev/full")])]
fn the_drivers_errors_are_told_once_and_count() {
    let folder = folder();
    let run = |name: &str, value: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gaurast"));
        command.args(["two.ply", "-q", "--force", "--size", "32x24"]).current_dir(&folder);
        let output = command.env(name, value).env_remove("RUST_LOG").output().expect("it starts");
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
        stderr
    };
    // A trace that does not fit on the disk is an error.
    let stderr = run("GAURAST_TRACE", "/dev/full");
    assert!(stderr.contains("GAURAST_TRACE=/dev/full: No space left"), "{stderr}");
    let stderr = run("GAURAST_SIMD", "mmx");
    assert!(stderr.contains("GAURAST_SIMD=mmx: it is none of"), "{stderr}");
}

#[gaurast_runner::test]
fn sides_distances_and_models() {
    let folder = folder();
    let mean = |arguments: &[&str]| {
        let all = [&["two.ply", "-q", "--force", "--size", "64x48", "-o", "a.png"], arguments].concat();
        succeeds(&folder, &all);
        covered(&folder, "a.png")
    };
    let (_, [r, g, _]) = mean(&["--azimuth", "0", "--elevation", "0"]);
    assert!(r > 4.0 * g, "red is in front: {r} {g}");
    let (_, [r, g, _]) = mean(&["--azimuth", "180", "--elevation", "0"]);
    assert!(g > 4.0 * r, "green is behind: {r} {g}");
    let (_, [r, g, _]) = mean(&["--azimuth", "90"]);
    assert!((r / g - 1.0).abs() < 0.2, "both are seen from the side: {r} {g}");
    // From the side and near, only the target is in the picture.
    let near = ["--azimuth", "90", "--distance", "1.5", "--target"];
    let (_, [r, g, _]) = mean(&[&near[..], &["0,0,-1"]].concat());
    assert!(r > 4.0 * g, "red is the target: {r} {g}");
    let (_, [r, g, _]) = mean(&[&near[..], &["0,0,1"]].concat());
    assert!(g > 4.0 * r, "green is the target: {r} {g}");
    let (plain, _) = mean(&[]);
    let (zoomed, _) = mean(&["--zoom", "0.2"]);
    let (far, _) = mean(&["--distance", "30"]);
    assert!(zoomed < 0.5 * plain && far < 0.5 * plain, "{plain} {zoomed} {far}");
    let (parallel, _) = mean(&["--camera", "orthographic"]);
    assert!((parallel / plain - 1.0).abs() < 0.4, "{plain} {parallel}");
    // A panorama is taken from the middle, with red and green on opposite sides.
    let (inside, [r, g, _]) = mean(&["--camera", "equirectangular"]);
    assert!(inside > 0.1 && r > 5.0 && g > 5.0, "{inside} {r} {g}");
    let printed = succeeds(&folder, &["two.ply", "--frame", "--azimuth", "180", "--size", "64x48"]);
    std::fs::write(folder.path().join("keys.json"), printed).expect("written");
    let (_, [r, g, _]) = mean(&["--path", "keys.json"]);
    assert!(g > 4.0 * r, "the same as asked for before: {r} {g}");
}

/// Tests that a keyframe has its camera's model, and an orthographic one its scale.
#[gaurast_runner::test]
fn keyframes_of_all_models_are_their_pictures() {
    let folder = folder();
    // A panorama shows all, so that it has nothing to magnify.
    for (model, zoom) in [("pinhole", "1.5"), ("orthographic", "1.5"), ("fisheye", "0.75"), ("panorama", "1")] {
        let view = ["two.ply", "--azimuth", "45", "--camera", model, "--zoom", zoom, "--size", "64x48"];
        let printed = succeeds(&folder, &[&view[..], &["--frame"]].concat());
        std::fs::write(folder.path().join("keys.json"), printed).expect("written");
        let drawn = [&view[..], &["-o", "a.png", "--force"]].concat();
        let said = succeeds(&folder, &drawn);
        assert_eq!(said.contains("--zoom 1.5"), zoom == "1.5", "{said}");
        let path = ["two.ply", "--path", "keys.json", "--size", "64x48", "-o", "b.png"];
        succeeds(&folder, &[&path[..], &["--force"]].concat());
        succeeds(&folder, &["compare", "a.png", "b.png", "--fail-below", "45"]);
    }
}

#[gaurast_runner::test]
fn a_fisheye_may_see_what_is_behind_it() {
    let folder = folder();
    // 180 degrees, the default, are 240 at a zoom of 0.75.
    for (option, value, file) in [("--zoom", "0.75", "a.png"), ("--fov", "240", "b.png")] {
        let view = ["two.ply", "--camera", "fisheye", option, value, "-o", file];
        succeeds(&folder, &[&view[..], &["--size", "64x48"]].concat());
    }
    succeeds(&folder, &["compare", "a.png", "b.png", "--fail-below", "45"]);
}

#[gaurast_runner::test]
fn an_orbit_is_numbered_shared_and_goes_on() {
    let folder = folder();
    let orbit = |more: &[&'static str]| {
        let fixed = ["two.ply", "--orbit", "4", "--elevation", "0", "--azimuth", "0", "--size", "32x24"];
        [&fixed[..], &["-o", "v_%03d.png"], more].concat()
    };
    succeeds(&folder, &orbit(&["--shard", "1/2"]));
    assert_eq!(files(&folder), ["two.ply", "v_001.png", "v_003.png"]);
    let first = std::fs::read(folder.path().join("v_001.png")).expect("readable");
    fails(&folder, &orbit(&[]), "v_001.png: it is there already");
    let stdout = succeeds(&folder, &orbit(&["--resume"]));
    assert!(stdout.contains("v_000.png to v_002.png") && stdout.contains("2 were there"), "{stdout}");
    assert_eq!(files(&folder).len(), 5);
    assert_eq!(std::fs::read(folder.path().join("v_001.png")).expect("readable"), first);
    let (_, [r, g, _]) = covered(&folder, "v_000.png");
    let (_, [back_r, back_g, _]) = covered(&folder, "v_002.png");
    assert!(r > 5.0 * g && back_g > 5.0 * back_r);
    let stdout = succeeds(&folder, &orbit(&["--resume"]));
    assert!(stdout.starts_with("wrote nothing; 4 were there"), "{stdout}");
    fails(&folder, &["two.ply", "--orbit", "2", "-o", "x.png"], "2 views do not go to one file");
}

#[gaurast_runner::test]
fn eight_shares_are_one_run() {
    let folder = folder();
    let run = |place: &str, more: &[&str]| {
        let orbit = ["two.ply", "-q", "--orbit", "11", "--size", "40x30", "-o", place];
        succeeds(&folder, &[&orbit[..], more].concat());
    };
    run("whole/", &[]);
    for share in 0..8 {
        run("shared/", &["--shard", &format!("{share}/8")]);
    }
    let read = |place: &str| -> Vec<(std::ffi::OsString, Vec<u8>)> {
        let entries = std::fs::read_dir(folder.path().join(place)).expect("a folder");
        let file = |entry: std::io::Result<std::fs::DirEntry>| {
            let entry = entry.expect("an entry");
            (entry.file_name(), std::fs::read(entry.path()).expect("readable"))
        };
        let mut files: Vec<_> = entries.map(file).collect();
        files.sort();
        files
    };
    let whole = read("whole");
    assert_eq!(whole.len(), 11);
    assert!(whole.windows(2).all(|pair| pair[0].1 != pair[1].1), "views differ");
    assert!(read("shared") == whole);
}

#[gaurast_runner::test]
fn formats_hold_the_same_picture() {
    let folder = folder();
    let fixed =
        ["two.ply", "--size", "64x48", "--zoom", "0.3", "-o", "a.png", "-o", "a.webp", "-o", "a.jpg", "-o", "a.exr"];
    succeeds(&folder, &[&fixed[..], &["--depth"]].concat());
    for (name, least) in [("a.webp", f64::INFINITY), ("a.exr", 50.0), ("a.jpg", 28.0)] {
        let json = succeeds(&folder, &["compare", name, "a.png", "--json"]);
        let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        let picture = &json["pictures"][0];
        let psnr = picture["psnr"].as_f64().unwrap_or(f64::INFINITY);
        assert!(psnr >= least, "{name}: {json}");
        assert_eq!(picture["equal"], least.is_infinite(), "{name}");
    }
    let depth = exr_depth(&folder.path().join("a.exr"), 64);
    // The middle of the picture shows red, in front of the scene's middle; a corner is empty.
    let printed = succeeds(&folder, &["two.ply", "--frame", "--size", "64x48"]);
    let keyframe: serde_json::Value = serde_json::from_str(&printed).expect("JSON");
    let vector = |name: &str| -> Vec<f64> {
        let values = keyframe[0][name].as_array().expect("three");
        values.iter().map(|value| value.as_f64().expect("a number")).collect()
    };
    let distance = (vector("eye").iter().zip(vector("target"))).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let middle = f64::from(depth(32, 24));
    assert!((middle - distance).abs() < 0.7 && middle < distance, "{middle} {distance}");
    assert_eq!(depth(0, 0), f32::INFINITY);

    succeeds(&folder, &["two.ply", "--size", "64x48", "--zoom", "0.3", "-o", "t.png", "--background", "transparent"]);
    let picture = image::open(folder.path().join("t.png")).expect("a PNG");
    assert_eq!(picture.color(), image::ColorType::Rgba8);
    let picture = picture.to_rgba8();
    assert_eq!(picture.get_pixel(0, 0).0, [0, 0, 0, 0]);
    // Straight alpha: faint red pixels have the same red value as opaque ones.
    let faint = picture.pixels().filter(|p| (30..60).contains(&p.0[3]) && p.0[0] > p.0[1]);
    assert!(faint.clone().count() > 5 && faint.clone().any(|pixel| pixel.0[0] > 240));
    succeeds(&folder, &["two.ply", "--size", "8x8", "-o", "w.png", "--background", "#fff", "--distance", "90"]);
    let picture = image::open(folder.path().join("w.png")).expect("a PNG").to_rgb8();
    assert_eq!(picture.get_pixel(0, 0).0, [255; 3]);
}

/// Reads the plane Z of an EXR file.
fn exr_depth(path: &Path, width: usize) -> impl Fn(usize, usize) -> f32 + use<> {
    let bytes = std::fs::read(path).expect("readable");
    let text = text(&bytes);
    assert!(text.contains("expected.Z") && text.contains("sRGB as trained"));
    let file = exr::prelude::read_all_flat_layers_from_file(path).expect("an EXR");
    let channel =
        (file.layer_data[0].channel_data.list.iter()).find(|channel| channel.name.to_string() == "Z").expect("depths");
    let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
    move |x, y| values[y * width + x]
}

#[gaurast_runner::test]
fn standard_output_takes_frames() {
    let folder = folder();
    let arguments = ["two.ply", "--orbit", "3", "--size", "16x8", "-o", "-", "--raw"];
    let output = gaurast(folder.path(), &arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(output.stdout.len(), 3 * 16 * 8 * 3);
    let png = gaurast(folder.path(), &["two.ply", "--size", "16x8", "-o", "-", "-q"]);
    assert!(png.stdout.starts_with(b"\x89PNG") && png.stderr.is_empty());
    assert_eq!(files(&folder), ["two.ply"]);
    // The picture of a scene from standard input is not called "-".
    let mut child = Command::new(env!("CARGO_BIN_EXE_gaurast"))
        .args(["-", "--size", "16x8", "-q"])
        .current_dir(&folder)
        .stdin(std::process::Stdio::piped())
        .spawn()
        .expect("it starts");
    let bytes = std::fs::read(folder.path().join("two.ply")).expect("readable");
    let mut input = child.stdin.take().expect("an input");
    std::io::Write::write_all(&mut input, &bytes).expect("written");
    drop(input);
    assert!(child.wait().expect("it ends").success());
    assert_eq!(files(&folder), ["gaurast.png", "two.ply"]);
}

#[cfg(unix)]
#[gaurast_runner::test]
fn a_video_goes_through_ffmpeg() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let tools = tempfile::tempdir().expect("a folder");
    let run = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_gaurast"))
            .args(arguments)
            .current_dir(&folder)
            .env("PATH", tools.path())
            .output()
            .expect("it starts")
    };
    let video = ["two.ply", "--orbit", "3", "--size", "16x8", "-o", "a.mp4", "--fps", "12"];
    let output = run(&video);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("a.mp4: videos are made by ffmpeg, and there is none"), "{stderr}");
    // A fake encoder that copies its input and notes its arguments.
    let script = "#!/bin/sh\nfor last; do :; done\necho \"$@\" > told\n/bin/cat > \"$last\"\n";
    let program = tools.path().join("ffmpeg");
    std::fs::write(&program, script).expect("written");
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).expect("executable");
    let output = run(&video);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(std::fs::read(folder.path().join("a.mp4")).expect("a video").len(), 3 * 16 * 8 * 3);
    let told = std::fs::read_to_string(folder.path().join("told")).expect("told");
    assert!(told.contains("-s 16x8 -r 12") && told.contains("libx264"), "{told}");
    assert_eq!(files(&folder), ["a.mp4", "told", "two.ply"]);
    // An animated picture has a palette, and its sides may be odd.
    let output = run(&["two.ply", "--orbit", "2", "--size", "15x7", "-o", "b.gif"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let told = std::fs::read_to_string(folder.path().join("told")).expect("told");
    assert!(told.contains("-s 15x7") && told.contains("palettegen") && !told.contains("yuv420p"), "{told}");
    std::fs::remove_file(folder.path().join("b.gif")).expect("removed");
    let output = run(&["two.ply", "--orbit", "2", "--size", "15x7", "-o", "b.webp"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let told = std::fs::read_to_string(folder.path().join("told")).expect("told");
    assert!(told.contains("libwebp_anim -loop 0"), "{told}");
    std::fs::remove_file(folder.path().join("b.webp")).expect("removed");
    // A single picture needs no ffmpeg.
    std::fs::remove_file(folder.path().join("told")).expect("removed");
    let output = run(&["two.ply", "--size", "15x7", "-o", "b.webp"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(!folder.path().join("told").exists());
    std::fs::remove_file(folder.path().join("b.webp")).expect("removed");
    std::fs::write(folder.path().join("told"), "").expect("written");
    // A fake encoder that fails: its last line is reported, and no file is left.
    std::fs::write(&program, "#!/bin/sh\necho 'Unknown encoder' >&2\nexit 1\n").expect("written");
    let output = run(&[&video[..], &["--force"]].concat());
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("a.mp4: ffmpeg: Unknown encoder"), "{stderr}");
    assert_eq!(files(&folder), ["a.mp4", "told", "two.ply"]);
}

#[gaurast_runner::test]
fn depths_are_written_as_png_and_npy() {
    let folder = folder();
    let view = ["two.ply", "--size", "32x24", "--eye", "0,0,-3", "--target", "0,0,0", "-o", "a.exr", "--depth"];
    let depths = ["--depth-output", "a.png", "--depth-output", "a.npy", "--depth-step", "0.0005"];
    succeeds(&folder, &[&view[..], &depths].concat());
    let exr = exr::prelude::read_first_flat_layer_from_file(folder.path().join("a.exr")).expect("an EXR");
    let channel = exr.layer_data.channel_data.list.iter().find(|channel| channel.name.eq("Z")).expect("depths");
    let expected: Vec<f32> = channel.sample_data.values_as_f32().collect();
    let npy = std::fs::read(folder.path().join("a.npy")).expect("an array");
    let array: Vec<f32> = npy[128..].as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    assert_eq!(array, expected);
    let png = image::open(folder.path().join("a.png")).expect("a PNG").to_luma16();
    for (steps, depth) in png.as_raw().iter().zip(&expected) {
        let found = if *steps == 0 { f32::INFINITY } else { f32::from(*steps) * 0.0005 };
        assert!(found == *depth || (found - depth).abs() < 0.0003, "{found} {depth}");
    }
    assert!(expected.contains(&f32::INFINITY) && expected.iter().any(|depth| (2.0..3.0).contains(depth)));
    fails(&folder, &["two.ply", "-o", "b.png", "--depth-output", "b.exr"], "depths are written as .png or .npy");
    fails(&folder, &["two.ply", "-o", "b.png", "--depth-output", "b.png"], "two outputs are the same file");
}

#[gaurast_runner::test]
fn a_plan_has_north_upwards_and_tells_its_scale() {
    let folder = tempfile::tempdir().expect("a folder");
    // Red is in the north, where z is greatest, and green in the south.
    let gaussians = [([0.0, 0.0, 1.0], RED), ([0.0, 0.0, -1.0], GREEN)];
    std::fs::write(folder.path().join("two.ply"), scene(0.1, &gaussians)).expect("written");
    let plan = ["two.ply", "--camera", "orthographic", "--elevation", "90", "--size", "60x60"];
    let output = gaurast(folder.path(), &plan);
    let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
    assert!(stdout.contains("--azimuth 0.0 --elevation 90.0"), "{stdout}");
    let scale = stderr.split("the scale of the picture is ").nth(1).and_then(|rest| rest.split(' ').next());
    let scale: f64 = scale.and_then(|scale| scale.parse().ok()).expect("a scale");
    let picture = image::open(folder.path().join("two.png")).expect("a picture").to_rgb8();
    let row = |channel: usize| {
        let rows = picture.enumerate_pixels().map(|(_, y, pixel)| (f64::from(y) + 0.5, f64::from(pixel.0[channel])));
        let (sum, weight) = rows.fold((0.0, 0.0), |(sum, total), (y, value)| (sum + y * value, total + value));
        sum / weight
    };
    let apart = (row(1) - row(0)) * scale;
    assert!((apart - 2.0).abs() < 0.02, "{apart}");
}

#[gaurast_runner::test]
fn a_camera_path_crops_the_scene_and_a_track_gives_views() {
    let folder = folder();
    let path = r#"{"camera_type": "perspective", "render_height": 24, "render_width": 32, "camera_path": [{"camera_to_world":
        [1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, -3, 0, 0, 0, 1], "fov": 60}], "crop": {"crop_center": [0, 0, 0.5],
        "crop_scale": [0.5, 0.5, 0.5], "crop_bg_color": {"r": 0, "g": 0, "b": 255}}}"#;
    std::fs::write(folder.path().join("camera_path.json"), path).expect("written");
    let output = gaurast(folder.path(), &["two.ply", "--cameras", "camera_path.json", "-o", "a.png"]);
    assert!(text(&output.stderr).contains("1 of 2 Gaussians are in the box"), "{}", text(&output.stderr));
    let picture = image::open(folder.path().join("a.png")).expect("a picture").to_rgb8();
    assert_eq!(picture.dimensions(), (32, 24));
    assert_eq!(picture.get_pixel(0, 0).0, [0, 0, 255]);
    let [red, green, _] = picture.get_pixel(16, 12).0;
    assert!(red < 10 && green > 200, "{red} {green}");

    let track = r#"{"timeline": {"frameRate": 30}, "poseSets": [{"poses": [
        {"frame": 0, "position": [0, 0, -3], "target": [0, 0, 0], "fov": 60},
        {"frame": 30, "position": [0, 0, 3], "target": [0, 0, 0], "fov": 60}]}]}"#;
    std::fs::write(folder.path().join("document.json"), track).expect("written");
    let small = ["two.ply", "--size", "32x24", "-o"];
    succeeds(&folder, &[&small[..], &["v%d.png", "--cameras", "document.json", "--view", "all"]].concat());
    succeeds(&folder, &[&small[..], &["p%d.png", "--path", "document.json", "--frames", "2"]].concat());
    for (index, channel) in [(0, 0), (1, 1)] {
        let read = |name: String| image::open(folder.path().join(name)).expect("a picture").to_rgb8();
        let view = read(format!("v{index}.png"));
        assert!(view.get_pixel(16, 12).0[channel] > 200, "{index}");
        assert_eq!(view, read(format!("p{index}.png")), "{index}");
    }
}

#[gaurast_runner::test]
fn a_training_folder_is_a_scene_with_cameras() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = folder.path().join("model");
    for (iteration, colour) in [(7000, GREEN), (30_000, RED)] {
        let inner = model.join(format!("point_cloud/iteration_{iteration}"));
        std::fs::create_dir_all(&inner).expect("folders");
        let text = scene(0.3, &[([0.0, 0.0, 3.0], colour)]);
        std::fs::write(inner.join("point_cloud.ply"), text).expect("written");
    }
    std::fs::write(model.join("cfg_args"), "Namespace(white_background=True)").expect("written");
    let camera = |name: &str, z: f64| {
        format!(
            r#"{{"id": 0, "img_name": "{name}", "width": 40, "height": 30, "position": [0, 0, {z}],
                "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "fx": 30, "fy": 30}}"#
        )
    };
    let cameras = format!("[{}, {}]", camera("near.jpg", 1.0), camera("far.jpg", -3.0));
    std::fs::write(model.join("cameras.json"), cameras).expect("written");
    let output = gaurast(folder.path(), &["model", "--view", "all", "-o", "out/"]);
    let stderr = text(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    assert!(stderr.contains("iteration 30000 is drawn") && stderr.contains("white"), "{stderr}");
    let at = |name: &str| {
        let picture = image::open(folder.path().join(name)).expect("a picture").to_rgb8();
        assert_eq!(picture.dimensions(), (40, 30));
        (picture.get_pixel(20, 15).0, picture.get_pixel(0, 0).0)
    };
    let (middle, corner) = at("out/near.png");
    assert!(middle[0] > 240 && middle[1] < 20, "{middle:?}");
    assert_eq!(corner, [255; 3]);
    at("out/far.png");
    // The training may have smaller photographs than the cameras are of.
    std::fs::write(model.join("cfg_args"), "Namespace(images='images_2', resolution=-1)").expect("written");
    let output = gaurast(folder.path(), &["model", "--view", "far", "-o", "small.png"]);
    assert!(text(&output.stderr).contains("20x15, as cfg_args says"), "{}", text(&output.stderr));
    assert_eq!(image::image_dimensions(folder.path().join("small.png")).expect("a picture"), (20, 15));
    std::fs::write(model.join("cfg_args"), "Namespace(white_background=True)").expect("written");
    // The same pictures, compared with the scene itself.
    let compared = succeeds(&folder, &["compare", "out/far.png", "model", "--view", "far", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&compared).expect("JSON");
    let largest = json["pictures"][0]["largest"].as_f64().expect("a number");
    assert_eq!(largest, 0.0, "{json}");
    let same = ["compare", "out", "out", "--fail-below", "30"];
    assert!(succeeds(&folder, &same).contains("mean of 2: PSNR inf dB, SSIM 1.0000"));
    let differ = ["compare", "out/near.png", "out/far.png", "--fail-below", "40", "--difference", "d.png"];
    let output = gaurast(folder.path(), &differ);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("is below 40"), "{}", text(&output.stderr));
    let (share, _) = covered(&folder, "d.png");
    assert!(share > 0.02, "{share}");
}

/// A program that draws a picture of 3x1 pixels. Its pictures on the two drivers differ in one channel of one pixel.
#[cfg(unix)]
const DRAWS: &str =
    "case $VK_DRIVER_FILES in *other*) blue=c;; *) blue=b;; esac\nprintf 'P6\\n3 1\\n255\\naaaaa%saaa' $blue";

#[cfg(unix)]
#[gaurast_runner::test]
fn a_programs_pictures_on_two_drivers_are_compared() {
    let folder = folder();
    for name in ["gaurast_icd.json", "other_icd.json"] {
        std::fs::write(folder.path().join(name), "{}").expect("written");
    }
    let drivers = ["--driver", "gaurast_icd.json", "--with", "other_icd.json"];
    let compare = |more: &[&str], script: &str, last: &[&str]| {
        let words = ["compare-drivers"]
            .iter()
            .chain(&drivers)
            .chain(more)
            .chain(&["--", "sh", "-c", script])
            .chain(last)
            .copied()
            .collect::<Vec<_>>();
        gaurast(folder.path(), &words)
    };
    // The program runs in a folder of its own for each driver.
    let output = compare(&["--json"], &format!("{DRAWS} > a.ppm"), &[]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let json: serde_json::Value = serde_json::from_str(&text(&output.stdout)).expect("JSON");
    let picture = &json["pictures"][0];
    assert_eq!(picture["name"], "a");
    assert_eq!(picture["equal"], false);
    assert_eq!(picture["differing_pixels"], 1);
    assert_eq!(picture["differing_on_edges"], 0);
    let largest = picture["largest"].as_f64().expect("a number");
    assert!((largest - 1.0).abs() < 1e-4, "{largest}");
    let page = folder.path().join("compared-drivers/index.html");
    let page = std::fs::read_to_string(page).expect("a page");
    for source in ["shown/a-gaurast.png", "shown/a-other_icd.png", "differences/a.png"] {
        assert!(page.contains(source), "{page}");
        let picture = folder.path().join("compared-drivers").join(source);
        assert_eq!(image::image_dimensions(picture).expect("a picture"), (3, 1));
    }
    // The program runs in the caller's folder and gets the picture's folder as an argument. A difference above the
    // limit fails.
    let script = format!("test -e two.ply && {DRAWS} > $0/a.ppm");
    let allowed = |steps: &str| {
        let more = ["--out", steps, "--fail-above", steps];
        compare(&more, &script, &["{}"])
    };
    assert!(allowed("1.5").status.success());
    let output = allowed("0.5");
    assert_eq!(output.status.code(), Some(1));
    let said = text(&output.stderr);
    assert!(said.contains("1.0 steps of 255, and 0.5 are allowed"), "{said}");
    // A folder that is not empty; a program that fails, or writes nothing; a driver that is missing.
    for (output, sentence) in [
        (compare(&[], "true", &[]), "--force writes into it"),
        (compare(&["--out", "b"], "exit 3", &[]), "on gaurast it ended with exit status: 3"),
        (compare(&["--out", "none"], "true", &[]), "sh: it wrote no picture"),
        (
            gaurast(
                folder.path(),
                &["compare-drivers", "--driver", "other_icd.json", "--with", "nothing", "--out", "c", "--", "true"],
            ),
            "no manifest of such a driver",
        ),
    ] {
        assert_eq!(output.status.code(), Some(1));
        let said = text(&output.stderr);
        assert!(said.contains(sentence), "{said}");
    }
}

#[gaurast_runner::test]
fn a_sheet_shows_eight_sides() {
    let folder = folder();
    let stdout = succeeds(&folder, &["views", "two.ply", "--size", "80x60"]);
    assert!(stdout.contains("wrote two-views.png"), "{stdout}");
    let sheet = image::open(folder.path().join("two-views.png")).expect("a sheet").to_rgb8();
    assert_eq!(sheet.dimensions(), (320, 120));
    let mean = |column: u32, row: u32, channel: usize| {
        let pixels = (20..60).flat_map(|y| (0..80).map(move |x| (80 * column + x, 60 * row + y)));
        pixels.map(|(x, y)| u64::from(sheet.get_pixel(x, y).0[channel])).sum::<u64>()
    };
    assert!(mean(0, 0, 0) > 2 * mean(0, 0, 1), "red from the front");
    assert!(mean(0, 1, 1) > 2 * mean(0, 1, 0), "green from behind");
    let label = (0..16).flat_map(|y| (0..80).map(move |x| (x, y)));
    assert!(label.filter(|(x, y)| sheet.get_pixel(*x, *y).0 == [255; 3]).count() > 100);
}

#[gaurast_runner::test]
fn the_work_of_tiles_is_drawn() {
    let folder = folder();
    let heatmap = |file: &str, more: &[&str]| -> serde_json::Value {
        let arguments = ["two.ply", "--size", "64x48", "--heatmap", file, "--json"];
        let arguments = [&arguments[..], &["--force"], more].concat();
        serde_json::from_str(&succeeds(&folder, &arguments)).expect("JSON")
    };
    let json = heatmap("h.png", &[]);
    let greatest = json["heatmap"]["greatest"].as_f64().expect("a number");
    assert!(greatest > 0.5 && greatest <= 2.0, "{json}");
    assert_eq!(json["heatmap"]["of"], "gaussians");
    assert_eq!(json["gaussians"], 2);
    assert_eq!(json["pictures"][0]["files"][0], "two.png");
    // A tile of 256 pixels takes its module's 16 PEs 16 cycles at least, and the picture is the same each time.
    let json = heatmap("c.png", &["--heatmap-of", "cycles"]);
    let greatest = json["heatmap"]["greatest"].as_f64().expect("a number");
    assert!((16.0..10_000.0).contains(&greatest), "{json}");
    assert_eq!(json["heatmap"]["of"], "cycles");
    heatmap("again.png", &["--heatmap-of", "cycles"]);
    let read = |file: &str| {
        let picture = image::open(folder.path().join(file)).expect("a picture");
        picture.to_rgb8()
    };
    assert_eq!(read("c.png"), read("again.png"));
    for file in ["h.png", "c.png"] {
        assert!(read(file).pixels().any(|pixel| pixel.0 == [255; 3]));
    }
    let alone = gaurast(folder.path(), &["two.ply", "--heatmap-of", "cycles"]);
    assert_eq!(alone.status.code(), Some(2));
}

#[gaurast_runner::test]
fn scenes_are_put_together() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, colour) in [("red.ply", RED), ("green.ply", GREEN)] {
        std::fs::write(folder.path().join(name), scene(0.3, &[([0.0; 3], colour)])).expect("written");
    }
    let arguments = [
        "red.ply",
        "green.ply",
        "--transform",
        "move=-1,0,0",
        "--transform",
        "scale=0.5 move=1,0,0",
        "--azimuth",
        "0",
        "--elevation",
        "0",
        "--size",
        "64x32",
    ];
    succeeds(&folder, &arguments);
    let picture = image::open(folder.path().join("red.png")).expect("a picture").to_rgb8();
    let area = |channel: usize, left: u32| {
        let pixels = (0..32).flat_map(|y| (left..left + 32).map(move |x| (x, y)));
        pixels.filter(|(x, y)| picture.get_pixel(*x, *y).0[channel] > 60).count() as f64
    };
    let (red, green) = (area(0, 0), area(1, 32));
    assert!(red > 2.5 * green && green > 4.0, "{red} {green}");
    assert_eq!((area(1, 0), area(0, 32)), (0.0, 0.0));
    fails(
        &folder,
        &["red.ply", "--transform", "", "--transform", "", "-o", "a.png"],
        "--transform is given 2 times, and there are 1 scenes",
    );
    let json = succeeds(&folder, &["info", "red.ply", "green.ply", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!((&json["gaussians"], &json["sh_degree"]), (&2.into(), &0.into()));
    let text = succeeds(&folder, &["info", "red.ply"]);
    assert!(text.contains("Gaussians   1") && text.contains("from 0.9"), "{text}");
}

#[gaurast_runner::test]
fn a_mesh_hides_what_is_behind_it() {
    let folder = folder();
    // A blue wall between red, in front, and green.
    let wall = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n\
        -3 -3 0 0 0 255\n3 -3 0 0 0 255\n3 3 0 0 0 255\n-3 3 0 0 0 255\n4 0 1 2 3\n";
    std::fs::write(folder.path().join("wall.ply"), wall).expect("written");
    let mean = |more: &[&str]| {
        let fixed = ["two.ply", "wall.ply", "--elevation", "0", "--size", "64x48", "--force", "-o", "a.png"];
        let stdout = succeeds(&folder, &[&fixed[..], more].concat());
        assert!(stdout.contains("2 Gaussians and 2 triangles read"), "{stdout}");
        covered(&folder, "a.png").1
    };
    for camera in [&[][..], &["--camera", "orthographic"], &["--far", "99"]] {
        let [r, g, b] = mean(&[&["--azimuth", "0"], camera].concat());
        assert!(r > 1.0 && g == 0.0 && b > 20.0, "{camera:?}: {r} {g} {b}");
        let [r, g, b] = mean(&[&["--azimuth", "180"], camera].concat());
        assert!(r == 0.0 && g > 1.0 && b > 20.0, "{camera:?}: {r} {g} {b}");
    }
    // A mesh alone is a scene.
    succeeds(&folder, &["wall.ply", "--azimuth", "0", "--size", "64x48"]);
    assert!(covered(&folder, "wall.png").0 > 0.4);
    let text = succeeds(&folder, &["info", "two.ply", "wall.ply"]);
    assert!(text.contains("triangles   2\n"), "{text}");
    for (modes, sentence) in [
        (&["--camera", "fisheye", "-o", "b.png"][..], "pinhole and orthographic"),
        (&["--depth", "-o", "b.exr"], "depths are not kept of scenes with meshes"),
    ] {
        fails(&folder, &[&["two.ply", "wall.ply"], modes].concat(), sentence);
    }
}
