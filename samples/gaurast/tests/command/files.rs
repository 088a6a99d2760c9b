//! Tests of what `gaurast` draws of a stranger's file without options, and of the options for files.

use std::fmt::Write;

use tempfile::TempDir;

use super::support::gaurast;

/// A round Gaussian.
#[derive(Clone, Copy)]
struct Ball {
    place: [f64; 3],
    size: f64,
    /// Red, green and blue, 0 to 1.
    color: [f64; 3],
}

const RED: [f64; 3] = [1.0, 0.0, 0.0];
const GREEN: [f64; 3] = [0.0, 1.0, 0.0];
const GREY: [f64; 3] = [0.5; 3];

/// The properties of a Gaussian but its place.
const PROPERTIES: [&str; 11] =
    ["scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3", "opacity", "f_dc_0", "f_dc_1", "f_dc_2"];

/// A PLY file with places of type `kind`, and lines `extra` in its header.
fn ply(balls: &[Ball], kind: &str, extra: &str) -> String {
    let mut text = format!("ply\nformat ascii 1.0\n{extra}element vertex {}\n", balls.len());
    for axis in ["x", "y", "z"] {
        writeln!(text, "property {kind} {axis}").expect("memory");
    }
    for property in PROPERTIES {
        writeln!(text, "property float {property}").expect("memory");
    }
    text += "end_header\n";
    for Ball { place: [x, y, z], size, color } in balls {
        let [r, g, b] = color.map(|c| (c - 0.5) / 0.282_094_791_773_878_14);
        let scale = size.ln();
        writeln!(text, "{x} {y} {z} {scale} {scale} {scale} 1 0 0 0 6 {r} {g} {b}").expect("memory");
    }
    text
}

fn folder() -> TempDir {
    tempfile::tempdir().expect("a folder")
}

fn write(folder: &TempDir, name: &str, text: &str) {
    std::fs::write(folder.path().join(name), text).expect("written");
}

/// Runs the command, checks that it succeeds, and returns what it says on stdout and stderr.
#[track_caller]
fn succeeds(folder: &TempDir, arguments: &[&str]) -> [String; 2] {
    let output = gaurast(folder.path(), arguments);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{arguments:?}: {stderr}");
    [stdout, stderr]
}

/// Runs the command, checks that it fails with exit code 1 and one sentence, and returns that.
#[track_caller]
fn fails(folder: &TempDir, arguments: &[&str]) -> String {
    let output = gaurast(folder.path(), arguments);
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {stderr}");
    assert_eq!(stderr.lines().count(), 1, "{arguments:?}: {stderr}");
    stderr
}

fn picture(folder: &TempDir, name: &str) -> image::RgbaImage {
    image::open(folder.path().join(name)).expect("a picture").to_rgba8()
}

/// The mean row of the pixels in which one channel dominates.
fn mean_row(picture: &image::RgbaImage, channel: usize) -> f64 {
    let is_of = |pixel: &image::Rgba<u8>| {
        let [own, others @ ..] = [channel, (channel + 1) % 3, (channel + 2) % 3].map(|c| i16::from(pixel.0[c]));
        others.iter().all(|other| own > other + 60)
    };
    let rows: Vec<f64> = picture.enumerate_pixels().filter(|(.., p)| is_of(p)).map(|(_, y, _)| f64::from(y)).collect();
    assert!(!rows.is_empty(), "no pixel of channel {channel}");
    rows.iter().sum::<f64>() / rows.len() as f64
}

/// A red ball above a green floor, with `up` as the direction upwards.
fn ball_above_floor(up: [f64; 3]) -> Vec<Ball> {
    let up = glam::DVec3::from_array(up);
    let (a, b) = up.any_orthonormal_pair();
    let floor = (0..400).map(|i| {
        let [x, y] = [f64::from(i % 20) - 9.5, f64::from(i / 20) - 9.5];
        Ball { place: (0.1 * (x * a + y * b)).to_array(), size: 0.06, color: GREEN }
    });
    floor.chain([Ball { place: (0.6 * up).to_array(), size: 0.15, color: RED }]).collect()
}

#[gaurast_runner::test]
fn a_vertical_axis_and_given_axes_stand_upright() {
    let folder = folder();
    let z_up = ball_above_floor([0.0, 0.0, 1.0]);
    write(&folder, "said.ply", &ply(&z_up, "float", "comment Vertical Axis: z\n"));
    write(&folder, "unsaid.ply", &ply(&z_up, "float", ""));
    write(&folder, "rub.ply", &ply(&ball_above_floor([0.0, 1.0, 0.0]), "float", ""));
    for (arguments, says) in [
        (&["said.ply"][..], "the file's axes are rfu, as the file says"),
        (&["unsaid.ply", "--axes", "rfu"], "the file's axes are rfu, as --axes says"),
        (&["rub.ply", "--axes", "rub"], "the file's axes are rub, as --axes says"),
    ] {
        let arguments = [arguments, &["--size", "160x120", "--force", "-o", "a.png"]].concat();
        let [_, stderr] = succeeds(&folder, &arguments);
        assert!(stderr.contains(says), "{stderr}");
        let picture = picture(&folder, "a.png");
        assert!(mean_row(&picture, 0) + 20.0 < mean_row(&picture, 1), "{arguments:?}");
    }
    // Axes that are given come before the file's.
    let [_, stderr] = succeeds(&folder, &["said.ply", "--axes", "rdf", "--size", "160x120", "-o", "b.png"]);
    assert!(stderr.contains("the file's axes are rdf, as --axes says"), "{stderr}");
    let given = picture(&folder, "b.png");
    succeeds(&folder, &["unsaid.ply", "--size", "160x120", "-o", "c.png"]);
    assert_eq!(given, picture(&folder, "c.png"));
    assert_eq!(gaurast(folder.path(), &["said.ply", "--axes", "xyz"]).status.code(), Some(2));
}

#[gaurast_runner::test]
fn cameras_of_a_turned_scene_are_turned_with_it() {
    let folder = folder();
    let z_up = ball_above_floor([0.0, 0.0, 1.0]);
    write(&folder, "said.ply", &ply(&z_up, "float", "comment Vertical Axis: z\n"));
    write(&folder, "unsaid.ply", &ply(&z_up, "float", ""));
    let camera = r#"[{"img_name": "a", "width": 160, "height": 120, "fx": 150, "fy": 150, "position": [0.5, -4, 1],
        "rotation": [[1, 0, 0], [0, 0, 1], [0, -1, 0]]}]"#;
    write(&folder, "cameras.json", camera);
    for name in ["said", "unsaid"] {
        succeeds(&folder, &[&format!("{name}.ply"), "--cameras", "cameras.json", "-o", &format!("{name}.png")]);
    }
    let [said, unsaid] = ["said.png", "unsaid.png"].map(|name| picture(&folder, name));
    let differs = |(a, b): (&u8, &u8)| a.abs_diff(*b) > 1;
    assert!(!said.iter().zip(unsaid.iter()).any(differs));
    let mirrored = ["unsaid.ply", "--axes", "ruf", "--cameras", "cameras.json", "-o", "m.png"];
    assert_eq!(gaurast(folder.path(), &mirrored).status.code(), Some(2));
}

#[gaurast_runner::test]
fn coordinates_far_away_are_drawn_as_at_the_origin() {
    let folder = folder();
    let near = ball_above_floor([0.0, -1.0, 0.0]);
    let offset = [500_000.0, 5_400_000.0, 300.0];
    let moved = |ball: &Ball| Ball { place: std::array::from_fn(|axis| ball.place[axis] + offset[axis]), ..*ball };
    write(&folder, "near.ply", &ply(&near, "float", ""));
    write(&folder, "far.ply", &ply(&near.iter().map(moved).collect::<Vec<_>>(), "double", ""));
    let look = ["--size", "160x120", "--eye", "1,-1,-3", "--target", "0,0,0"];
    succeeds(&folder, &[&["near.ply", "-o", "near.png"], &look[..]].concat());
    let look = ["--size", "160x120", "--eye", "500001,5399999,297", "--target", "500000,5400000,300"];
    let [_, stderr] = succeeds(&folder, &[&["far.ply", "-o", "far.png"], &look[..]].concat());
    assert!(stderr.contains("relative to 500000,5400000,300"), "{stderr}");
    let [near, far] = ["near.png", "far.png"].map(|name| picture(&folder, name));
    let greatest = near.iter().zip(far.iter()).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(greatest <= Some(1), "{greatest:?}");
    // The options that give the default view again are in the file's coordinates.
    let [stdout, _] = succeeds(&folder, &["far.ply", "--size", "160x120"]);
    let (_, framed) = stdout.trim().split_once("framed by ").expect("options");
    let options: Vec<&str> = framed.split(' ').collect();
    let again = [&["far.ply", "--size", "160x120", "-o", "again.png"], &options[..]].concat();
    succeeds(&folder, &again);
    let greatest = picture(&folder, "far.png");
    let again = picture(&folder, "again.png");
    let far_off = greatest.iter().zip(again.iter()).filter(|(a, b)| a.abs_diff(**b) > 24).count();
    assert!(far_off * 100 < again.len(), "{far_off} of {}", again.len());
}

#[gaurast_runner::test]
fn what_a_picture_may_lack_is_named_and_strictly_an_error() {
    let folder = folder();
    let text = ply(&ball_above_floor([0.0, -1.0, 0.0]), "float", "");
    let text = text.replace("property float f_dc_2\n", "property float f_dc_2\nproperty float trbf_center\n");
    let (header, rows) = text.split_once("end_header\n").expect("a header");
    let rows: String = rows.lines().map(|row| format!("{row} 0.5\n")).collect();
    write(&folder, "time.ply", &format!("{header}end_header\n{rows}"));
    let [_, stderr] = succeeds(&folder, &["time.ply", "--size", "64x48"]);
    assert!(stderr.contains("the column trbf_center is unknown and ignored"), "{stderr}");
    let error = fails(&folder, &["time.ply", "--size", "64x48", "--strict", "-o", "strict.png"]);
    assert!(error.contains("trbf_center") && error.contains("--strict"), "{error}");
    assert!(!folder.path().join("strict.png").exists());
    let [stdout, _] = succeeds(&folder, &["info", "time.ply"]);
    assert!(stdout.contains("warning     the column trbf_center"), "{stdout}");
}

#[gaurast_runner::test]
fn points_are_drawn_on_request() {
    let folder = folder();
    let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n0 0 4 255 0 0\n";
    write(&folder, "points.ply", text);
    let error = fails(&folder, &["points.ply"]);
    assert!(error.contains("points without scales") && error.contains("--points"), "{error}");
    // At a distance of 4 and a focal length of 60 pixels, a point of diameter 2 has 30 pixels.
    let look = ["--size", "120x120", "--fov", "90", "--eye", "0,0,0", "--target", "0,0,1", "-o", "a.png"];
    succeeds(&folder, &[&["points.ply", "--points", "2", "--background", "transparent"], &look[..]].concat());
    let covered = picture(&folder, "a.png").pixels().filter(|pixel| pixel.0[3] > 127).count() as f64;
    let area = std::f64::consts::PI * 15.0 * 15.0;
    assert!((covered / area - 1.0).abs() < 0.05, "{covered} of {area}");
}

/// The least and the greatest column and row of what is opaque, as parts of the picture's sides.
fn bounds(picture: &image::RgbaImage) -> [f64; 4] {
    let opaque = || picture.enumerate_pixels().filter(|(.., pixel)| pixel.0[3] > 127);
    let columns = opaque().map(|(x, ..)| x);
    let rows = opaque().map(|(_, y, _)| y);
    let part = |place: Option<u32>, side: u32| f64::from(place.expect("something opaque")) / f64::from(side);
    [
        part(columns.clone().min(), picture.width()),
        part(columns.max().map(|x| x + 1), picture.width()),
        part(rows.clone().min(), picture.height()),
        part(rows.max().map(|y| y + 1), picture.height()),
    ]
}

#[gaurast_runner::test]
fn an_object_fills_its_default_view() {
    let folder = folder();
    // Many small Gaussians on a plinth of a few large ones, and a floater.
    let bust = (0..4000).map(|i| {
        let (turn, height) = (f64::from(i) * 2.399_963, f64::from(i) / 4000.0);
        let place = [0.3 * turn.cos(), -0.6 * height, 0.3 * turn.sin()];
        Ball { place, size: 0.01, color: GREY }
    });
    let plinth = (0..12).map(|i| {
        let place = [f64::from(i % 2) - 0.5, 0.4 + 0.5 * f64::from(i / 4), f64::from(i / 2 % 2) - 0.5];
        Ball { place, size: 0.25, color: GREEN }
    });
    let floater = Ball { place: [6.0, -4.0, 0.0], size: 0.02, color: RED };
    let balls: Vec<Ball> = bust.chain(plinth).chain([floater]).collect();
    write(&folder, "statue.ply", &ply(&balls, "float", ""));
    for options in [
        &["--size", "320x180"][..],
        &["--size", "180x320"],
        &["--size", "320x180", "--azimuth", "120", "--elevation", "-10"],
        &["--size", "320x180", "--fov", "20"],
    ] {
        let arguments = [&["statue.ply", "--background", "transparent", "-q"], options].concat();
        succeeds(&folder, &arguments);
        let [left, right, top, bottom] = bounds(&picture(&folder, "statue.png"));
        let (width, height) = (right - left, bottom - top);
        assert!((0.85..0.92).contains(&width.max(height)), "{options:?}: {width} {height}");
        assert!((left + right - 1.0).abs() < 0.04 && (top + bottom - 1.0).abs() < 0.04, "{options:?}");
    }
    // All views of an orbit have it, from one distance.
    let orbit = ["statue.ply", "--orbit", "5", "--background", "transparent", "-q", "--size", "320x180", "-o", "o/"];
    succeeds(&folder, &orbit);
    for index in 0..5 {
        let [left, right, top, bottom] = bounds(&picture(&folder, &format!("o/{index:05}.png")));
        assert!(left > 0.0 && right < 1.0 && top > 0.0 && bottom < 1.0, "{index}");
        assert!((right - left).max(bottom - top) > 0.6, "{index}");
    }
    let [info, _] = succeeds(&folder, &["info", "statue.ply"]);
    assert!(info.contains("framed      as an object"), "{info}");
}

#[gaurast_runner::test]
fn a_scene_that_surrounds_its_middle_keeps_a_view_of_it() {
    let folder = folder();
    // A small, dense middle on a ground, and a far wall around both, with large Gaussians.
    let middle = (0..30_000).map(|i| {
        let (turn, height) = (f64::from(i) * 2.399_963, f64::from(i) / 30_000.0);
        Ball { place: [0.5 * turn.cos(), -height, 0.5 * turn.sin()], size: 0.01, color: RED }
    });
    let around = (0..600).map(|i| {
        let (turn, height) = (f64::from(i) * 2.399_963, f64::from(i) / 600.0);
        Ball { place: [10.0 * turn.cos(), 2.0 - 9.0 * height, 10.0 * turn.sin()], size: 0.6, color: GREY }
    });
    let ground = (0..400).map(|i| {
        let [x, z] = [f64::from(i % 20) - 9.5, f64::from(i / 20) - 9.5];
        Ball { place: [x, 1.5, z], size: 0.6, color: GREEN }
    });
    let balls: Vec<Ball> = middle.chain(around).chain(ground).collect();
    write(&folder, "around.ply", &ply(&balls, "float", ""));
    let [info, _] = succeeds(&folder, &["info", "around.ply"]);
    assert!(info.contains("framed      as surroundings"), "{info}");
    succeeds(&folder, &["around.ply", "--size", "160x90"]);
    // The middle is in the picture.
    let picture = picture(&folder, "around.png");
    assert!((20.0..70.0).contains(&mean_row(&picture, 0)));
}

#[gaurast_runner::test]
fn the_default_picture_is_replaced_and_a_named_one_is_not() {
    let folder = folder();
    write(&folder, "a.ply", &ply(&ball_above_floor([0.0, -1.0, 0.0]), "float", ""));
    for _ in 0..2 {
        succeeds(&folder, &["a.ply", "--size", "32x24"]);
        succeeds(&folder, &["views", "a.ply", "--size", "32x24"]);
    }
    let named = ["a.ply", "--size", "32x24", "-o", "a.png"];
    assert!(fails(&folder, &named).contains("it is there already"));
    succeeds(&folder, &[&named[..], &["--force"]].concat());
    // A picture that is kept is kept.
    let before = std::fs::metadata(folder.path().join("a.png")).and_then(|file| file.modified()).expect("a time");
    succeeds(&folder, &["a.ply", "--size", "32x24", "--resume"]);
    let after = std::fs::metadata(folder.path().join("a.png")).and_then(|file| file.modified()).expect("a time");
    assert_eq!(before, after);
}

#[gaurast_runner::test]
fn json_has_no_counters_that_are_zero_and_counts_equal_pictures() {
    let folder = folder();
    write(&folder, "a.ply", &ply(&ball_above_floor([0.0, -1.0, 0.0]), "float", ""));
    let [stdout, _] = succeeds(&folder, &["a.ply", "--size", "32x24", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&stdout).expect("JSON");
    let counters = json["pictures"][0]["counters"].as_array().expect("counters");
    assert!(!counters.is_empty());
    assert!(counters.iter().all(|counter| counter["value"] != 0.0), "{stdout}");
    let [stdout, _] = succeeds(&folder, &["compare", "a.png", "a.png", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&stdout).expect("JSON");
    assert!(json["mean"]["psnr"].is_null());
    assert_eq!(json["mean"]["equal"], 1);
}

#[gaurast_runner::test]
fn completions_and_manual_pages_are_written() {
    let folder = folder();
    let [script, _] = succeeds(&folder, &["completions", "bash"]);
    assert!(script.contains("--axes"));
    succeeds(&folder, &["man", "pages"]);
    assert!(folder.path().join("pages/gaurast-render.1").is_file());
}
