//! Tests of the `gaurast` command: pictures, messages, exit codes.

use std::path::Path;

use tempfile::TempDir;

use super::support::gaurast;

fn folder() -> TempDir {
    tempfile::tempdir().expect("a folder")
}

/// A PLY file of one Gaussian at (0, 0, 3) with size 0.3 and colour (1, 0.5, 0).
const ONE: &str = "ply\nformat ascii 1.0\nelement vertex 1\n\
    property float x\nproperty float y\nproperty float z\n\
    property float scale_0\nproperty float scale_1\nproperty float scale_2\n\
    property float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float rot_3\n\
    property float opacity\n\
    property float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\nend_header\n\
    0 0 3 -1.2 -1.2 -1.2 1 0 0 0 5 1.772453 0 -1.772453\n";

fn write(folder: &TempDir, name: &str, text: &str) {
    std::fs::write(folder.path().join(name), text).expect("written");
}

/// Checks that a run fails: exit code 1, one line on stderr that begins with `message`, and no file.
#[track_caller]
fn fails(folder: &TempDir, arguments: &[&str], message: &str) {
    let files = |folder: &TempDir| std::fs::read_dir(folder).expect("readable").count();
    let before = files(folder);
    let output = gaurast(folder.path(), arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    assert!(stderr.starts_with(message), "{stderr} is not {message}");
    assert_eq!(files(folder), before, "{arguments:?} left a file");
}

const LOOK: [&str; 6] = ["--eye", "0,0,0", "--target", "0,0,1", "--size", "65x49"];

#[gaurast_runner::test]
fn one_gaussian_is_drawn_where_it_is() {
    let folder = folder();
    write(&folder, "one.ply", ONE);
    let arguments = [&["render", "one.ply", "--stats", "-o", "a.png", "--output", "b.exr"], &LOOK[..]].concat();
    let output = gaurast(folder.path(), &arguments);
    let (stdout, stderr) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{stderr}");
    assert!(stdout.contains("65 x 49") && stdout.contains("wrote a.png, b.exr: 65x49, 1 Gaussian "), "{stdout}");
    assert!(stdout.contains("gaussians drawn"), "{stdout}");

    let exr = image::open(folder.path().join("b.exr")).expect("an EXR").to_rgba32f();
    assert_eq!(exr.dimensions(), (65, 49));
    // The mean is at pixel (32.5, 24.5), the centre of pixel (32, 24): alpha is the opacity there.
    let [r, g, b, alpha] = exr.get_pixel(32, 24).0;
    let opacity = 1.0 / (1.0 + (-5.0_f32).exp());
    assert!((alpha - opacity.min(0.99)).abs() < 5e-6, "{alpha}");
    let expected = [alpha, 0.5 * alpha, 0.0];
    for (value, expected) in [r, g, b].into_iter().zip(expected) {
        assert!((value - expected).abs() < 5e-6, "{value} {expected}");
    }
    assert_eq!(exr.get_pixel(0, 0).0, [0.0; 4]);
    let png = image::open(folder.path().join("a.png")).expect("a PNG").to_rgb8();
    assert_eq!(png.get_pixel(32, 24).0, [252, 126, 0]);
    assert_eq!(png.get_pixel(0, 0).0, [0, 0, 0]);

    let arguments = [&["render", "one.ply", "-q", "--background", "0,0,1", "-o", "c.png"], &LOOK[..]].concat();
    let output = gaurast(folder.path(), &arguments);
    assert!(output.status.success());
    assert!(output.stdout.is_empty() && output.stderr.is_empty());
    let png = image::open(folder.path().join("c.png")).expect("a PNG").to_rgb8();
    assert_eq!(png.get_pixel(0, 0).0, [0, 0, 255]);
    assert_eq!(png.get_pixel(32, 24).0, [252, 126, 3]);
}

#[gaurast_runner::test]
fn counters_tell_of_every_stage_of_the_simulated_hardware_if_they_are_asked_for() {
    let folder = folder();
    write(&folder, "one.ply", ONE);
    let simulated = [
        "simulated preprocess",
        "simulated sort",
        "simulated raster",
        "raster cycles",
        "PE occupancy",
        "energy, shader cores",
    ];
    for asked in [true, false] {
        let counters: &[&str] = if asked { &["--counters"] } else { &["--stats"] };
        let arguments = [&["render", "one.ply", "--force", "-o", "a.png"], &LOOK[..], counters].concat();
        let output = gaurast(folder.path(), &arguments);
        let stdout = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success());
        for name in ["gaussians read", "tile pairs"] {
            assert!(stdout.contains(name), "{name}: {stdout}");
        }
        for name in simulated {
            assert_eq!(stdout.contains(name), asked, "{name}: {stdout}");
        }
    }
}

#[gaurast_runner::test]
fn a_panorama_and_a_fisheye_see_what_is_behind_and_beside() {
    let folder = folder();
    write(&folder, "one.ply", ONE);
    // The camera looks away from the Gaussian, then has it on the right.
    for (model, target, at) in [
        ("equirectangular", "0,0,-1", [0, 31]),
        ("equirectangular", "-1,0,0", [24, 24]),
        ("fisheye", "-1,0,0", [31, 31]),
    ] {
        let size = if model == "fisheye" { "32x32" } else { "32x16" };
        let arguments = [
            "render", "one.ply", "--force", "-o", "a.png", "--camera", model, "--size", size, "--eye", "0,0,0",
            "--target", target,
        ];
        let output = gaurast(folder.path(), &arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{stderr}");
        let picture = image::open(folder.path().join("a.png")).expect("a PNG");
        let picture = picture.to_rgb8();
        let row: Vec<u8> = picture
            .rows()
            .nth(picture.height() as usize / 2)
            .map_or(Vec::new(), |row| row.map(|pixel| pixel.0[0]).collect());
        for at in at {
            assert!(row[at] > 120, "{model} {target}: {row:?}");
        }
    }
}

#[gaurast_runner::test]
fn a_camera_file_gives_view_and_size() {
    let folder = folder();
    write(&folder, "one.ply", ONE);
    write(
        &folder,
        "cameras.json",
        r#"[{"id": 0, "width": 20, "height": 10, "position": [0, 0, 6],
             "rotation": [[-1, 0, 0], [0, 1, 0], [0, 0, -1]], "fx": 10, "fy": 10},
            {"id": 1, "width": 41, "height": 31, "position": [0, 0, 0],
             "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "fx": 30, "fy": 30}]"#,
    );
    let render = |arguments: &[&str]| {
        let arguments =
            [&["render", "one.ply", "-q", "--force", "--cameras", "cameras.json", "-o", "a.exr"], arguments].concat();
        let output = gaurast(folder.path(), &arguments);
        assert!(output.status.success(), "{output:?}");
        image::open(folder.path().join("a.exr")).expect("an EXR").to_rgba32f()
    };
    assert_eq!(render(&[]).dimensions(), (20, 10));
    let second = render(&["--view", "1"]);
    assert_eq!(second.dimensions(), (41, 31));
    assert!(second.get_pixel(20, 15).0[3] > 0.98);
    let resized = render(&["--view", "1", "--size", "123x31"]);
    assert_eq!(resized.dimensions(), (123, 31));
    // The picture is three times as wide: the same value is at three times the distance from the centre.
    let (a, b) = (second.get_pixel(22, 15).0[3], resized.get_pixel(67, 15).0[3]);
    assert!((a - b).abs() < 0.03 && a > 0.1, "{a} {b}");
    fails(
        &folder,
        &["render", "one.ply", "--cameras", "cameras.json", "--view", "2"],
        "gaurast: cameras.json: view 2: there are 2 views",
    );
}

#[gaurast_runner::test]
fn bad_input_is_one_sentence_and_exit_code_1() {
    let folder = folder();
    write(&folder, "one.ply", ONE);
    write(&folder, "cut.ply", &ONE[..ONE.len() - 11]);
    write(&folder, "no-opacity.ply", &ONE.replace("opacity", "density"));
    write(&folder, "word.ply", &ONE.replace("-1.2 -1.2", "-1.2 wide"));
    write(&folder, "a.sog", "PK\x03\x04");
    write(&folder, "a.txt", "hello");
    write(&folder, "cameras.json", "[{]");
    std::fs::create_dir(folder.path().join("folder.ply")).expect("a folder");
    let fails = |arguments: &[&str], message: &str| fails(&folder, arguments, message);

    fails(&["render", "none.ply"], "gaurast: none.ply: No such file");
    fails(&["render", "folder.ply"], "gaurast: folder.ply: the folder holds no scene");
    fails(&["render", "cut.ply"], "gaurast: cut.ply: line 19: the line has ");
    fails(&["render", "no-opacity.ply"], "gaurast: no-opacity.ply: element vertex, property opacity: it is missing");
    fails(&["render", "word.ply"], "gaurast: word.ply: line 19: \"wide\" is not a number");
    fails(&["render", "a.sog"], "gaurast: a.sog: the file: the zip archive is damaged");
    fails(&["render", "a.txt"], "gaurast: a.txt: this is not a scene file of a known kind");
    fails(
        &["render", "one.ply", "--cameras", "cameras.json"],
        "gaurast: cameras.json: key must be a string at line 1 column 3",
    );
    fails(
        &["render", "one.ply", "--eye", "1,2,3", "--target", "1,2,3"],
        "gaurast: the eye and the target are the same point",
    );
    // These are refused before anything is read or drawn.
    fails(&["render", "none.ply", "-o", "a.bmp"], "gaurast: a.bmp: pictures are written as");
    fails(&["render", "none.ply", "-o", "no/a.png"], "gaurast: no/a.png: No such file");
}

#[gaurast_runner::test]
fn misuse_is_exit_code_2_with_the_reason() {
    let folder = folder();
    for (arguments, reason) in [
        (&["render", "--size", "0x9"][..], "1 to 16384 pixels"),
        (&["render", "--size", "wide"], "such as 1280x720"),
        (&["render", "--fov", "180"], "less than 180"),
        (&["render", "--camera", "fisheye", "--fov", "361"], "at most 360"),
        (&["render", "--eye", "1,2"], "three numbers"),
        (&["render", "--eye", "1,2,3"], "--target"),
        (&["render", "--view", "1"], "--cameras"),
        (&["render", "--sh-degree", "5"], "0..=4"),
        (&["render", "a.ply", "--cameras", "a", "--fov", "9"], "cannot be used with"),
        (&["paint"], "unrecognized subcommand"),
    ] {
        let output = gaurast(folder.path(), arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains(reason), "{arguments:?}: {stderr}");
    }
    let help = gaurast(folder.path(), &["render", "--help"]);
    let help = String::from_utf8_lossy(&help.stdout).into_owned();
    assert!(help.contains("opaque over black") && help.contains(".spz"), "{help}");
}

#[gaurast_runner::test]
fn without_arguments_it_draws_the_garden() {
    let folder = folder();
    let output = gaurast(folder.path(), &[]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    let stdout = String::from_utf8_lossy(&output.stdout);
    assert!(stdout.starts_with("wrote gaurast.png: 1280x720, 300 000 Gaussians"), "{stdout}");
    assert_eq!(stdout.lines().count(), 1, "{stdout}");
    let png = image::open(folder.path().join("gaurast.png")).expect("a PNG").to_rgb8();
    assert_eq!(png.dimensions(), (1280, 720));
    // The sky is above, a meadow below, and nearly every pixel is covered.
    let mean = |rows: std::ops::Range<u32>, channel: usize| {
        let count = f64::from(1280 * rows.len() as u32);
        let pixels = rows.flat_map(|y| (0..1280).map(move |x| (x, y)));
        pixels.map(|(x, y)| f64::from(png.get_pixel(x, y).0[channel])).sum::<f64>() / count
    };
    assert!(mean(0..60, 2) > mean(600..720, 2) + 40.0);
    assert!(mean(600..720, 1) > mean(600..720, 2) + 10.0);
    let black = png.pixels().filter(|pixel| pixel.0 == [0, 0, 0]).count();
    assert!(black < 1280 * 720 / 100, "{black} black pixels");
    assert!(Path::new(folder.path()).read_dir().expect("readable").count() == 1);
}

#[gaurast_runner::test]
fn a_scene_is_simulated_from_the_work_that_was_done() {
    let folder = folder();
    // Three Gaussians in a row, so that the default camera is some distance away.
    let last = ONE.lines().last().expect("a Gaussian");
    let others = last.replacen("0 0 3", "2 0 3", 1) + "\n" + &last.replacen("0 0 3", "-2 1 3", 1);
    let three = ONE.replace("vertex 1", "vertex 3") + &others + "\n";
    write(&folder, "three.ply", &three);
    let simulate = |arguments: &[&str]| {
        let arguments = [&["simulate", "three.ply", "--size", "65x49"], arguments].concat();
        let output = gaurast(folder.path(), &arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && stderr.is_empty(), "{arguments:?}: {stderr}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let json: serde_json::Value =
        serde_json::from_str(&simulate(&["--format", "json", "--trace", "t.json"])).expect("JSON");
    let result = &json["results"][0];
    assert_eq!((&result["machine"], &result["config"]["rasterizer"]["modules"]), (&"paper-15x16".into(), &15.into()));
    let raster = &result["simulation"]["raster"];
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    // Every list holds at most three Gaussians, and there are 5 x 4 tiles.
    let pairs = number(&raster["pairs"]);
    assert!((3.0..=60.0).contains(&pairs), "{pairs}");
    assert_eq!(number(&raster["gaussian_evaluations"]), pairs * 256.0);
    assert!(number(&result["simulation"]["blended"]) > 0.0);
    assert!(number(&result["area"]["module"]) > 0.0 && number(&result["simt"]["compute_ms"]) > 0.0);
    let timeline = std::fs::read(folder.path().join("t.json")).expect("a timeline");
    let timeline: serde_json::Value = serde_json::from_slice(&timeline).expect("JSON");
    let events = timeline["traceEvents"].as_array().expect("events");
    let spans = |tiles: bool| {
        let spans = events.iter().filter(|event| event["ph"] == "X");
        spans.filter(|event| (event["cat"] == "tile") == tiles).count()
    };
    assert_eq!(spans(false), 6 * 3);
    // In each frame, each tile that is not empty is on a module's row.
    assert!(spans(true) > 0 && spans(true).is_multiple_of(6));
    let tracks = events.iter().filter(|event| event["ph"] == "M");
    assert!(tracks.filter(|event| event["args"]["name"] == "module 0").count() == 1);
    let sweep = ["--sweep", "modules=1..4", "--format", "csv"];
    let sweep = simulate(&[&sweep[..], &["--plot", "s.svg"]].concat());
    assert_eq!(sweep.lines().count(), 5, "{sweep}");
    let plot = std::fs::read_to_string(folder.path().join("s.svg")).expect("a plot");
    assert!(plot.contains("speed-up over the shader cores"));
    let grid = ["--sweep", "modules=1..4", "--sweep", "batch=16,32,64", "--format", "csv"];
    let grid = simulate(&[&grid[..], &["--pareto", "p.svg"]].concat());
    assert!(simulate(&["--roofline", "r.svg", "--tiles", "f.svg"]).contains("mean of the frame"));
    assert_eq!(grid.lines().count(), 13, "{grid}");
    assert!(grid.contains("added mm2") && grid.contains("modules=4 batch=64,"));
    let svg = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("a plot");
    assert_eq!(svg("p.svg").matches("<circle").count(), 12);
    assert!(svg("r.svg").contains(">stage 3</text>"));
    assert_eq!(svg("f.svg").matches(" cycles</title>").count(), spans(true) / 6);
    let range = simulate(&["--sweep", "modules=1..100", "--format", "csv"]);
    assert_eq!(range.lines().count(), 101, "every number of a range");
    let every = simulate(&["--every-frame", "--format", "csv"]);
    assert!(every.lines().nth(1).is_some_and(|line| line.starts_with("frame 0,")));
    let compared = simulate(&["--stepped"]);
    assert!(compared.contains("+0.000 %"), "{compared}");
    assert!(simulate(&["--what-if"]).contains("blocks saturate"));
    assert!(simulate(&[]).contains("stage 3, raster"));
    // Only the timeline and the plots were requested.
    let files = std::fs::read_dir(folder.path()).expect("readable").count();
    assert_eq!(files, 6);
}

#[gaurast_runner::test]
fn counters_of_a_rendering_and_a_simulation_agree() {
    let folder = folder();
    let last = ONE.lines().last().expect("a Gaussian");
    let others: String = (0..40)
        .map(|k| last.replacen("0 0 3", &format!("{} {} {}", k % 7 - 3, k % 5 - 2, 3 + k % 4), 1) + "\n")
        .collect();
    let scene = ONE.replace("vertex 1", "vertex 41") + &others;
    write(&folder, "scene.ply", &scene);
    let rendered = ["render", "scene.ply", "-o", "a.png", "--size", "320x200", "--counters"];
    let output = gaurast(folder.path(), &rendered);
    assert!(output.status.success());
    let table = String::from_utf8_lossy(&output.stdout).into_owned();
    // Integers are printed in groups of three digits.
    let counter = |name: &str| -> f64 {
        let row = table.lines().find(|line| {
            let mut cells = line.split('┆').map(|cell| cell.trim_matches(['│', ' ']));
            cells.nth(1) == Some(name)
        });
        // A counter that is 0 has no row.
        let Some(row) = row else { return 0.0 };
        let value = row.split('┆').next_back().unwrap_or_default();
        let digits: String = value.chars().filter(char::is_ascii_digit).collect();
        digits.parse().expect("a number")
    };
    let simulated = [
        "simulate",
        "scene.ply",
        "--size",
        "320x200",
        "--set",
        "collaborative=false",
        "--every-frame",
        "--format",
        "json",
    ];
    let output = gaurast(folder.path(), &simulated);
    assert!(output.status.success());
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let frames = json["results"].as_array().expect("frames");
    let sum = |of: &dyn Fn(&serde_json::Value) -> f64| frames.iter().map(|frame| of(&frame["simulation"])).sum::<f64>();
    let raster = |field: &'static str| sum(&|result| result["raster"][field].as_f64().expect("a number"));
    let cause = |field: &'static str| sum(&|result| result["raster"]["modules"][field].as_f64().expect("a number"));
    let energy = |field: &'static str| sum(&|result| result["energy"][field].as_f64().expect("a number")) * 1e6;
    for (name, expected) in [
        ("raster cycles", raster("cycles")),
        ("PE busy", cause("busy")),
        ("PE stall, dependency", cause("dependency")),
        ("PE stall, memory", cause("memory")),
        ("PE stall, controller", cause("controller")),
        ("PE stall, mode switch", cause("mode_switch")),
        ("PE idle", cause("idle")),
        ("mode switches", raster("switches")),
        ("bytes fetched", raster("bytes_in")),
        ("bytes written", raster("bytes_out")),
        ("energy, PE arithmetic", energy("arithmetic")),
        ("energy, main memory", energy("memory")),
    ] {
        let counted = counter(name);
        assert!((counted - expected).abs() <= 1.0 + frames.len() as f64, "{name}: {counted} {expected}");
    }
    assert!(cause("busy") > 0.0 && cause("memory") > 0.0);
}

#[gaurast_runner::test]
fn the_rasterizer_module_is_written_as_systemverilog() {
    let folder = folder();
    let output = gaurast(folder.path(), &["simulate", "--emit-rtl", "rtl"]);
    assert!(output.status.success() && output.stdout.is_empty());
    let read = |name: &str| std::fs::read_to_string(folder.path().join("rtl").join(name)).expect(name);
    for name in ["raster_module", "pe", "fp_add", "fp_mul", "fp_div", "fp_exp2", "exp2_table"] {
        assert!(read(&format!("{name}.sv")).contains(&format!("module {name} #(")), "{name}");
    }
    assert!(read("area.sh").contains("yosys") && read("bench.cpp").contains("Vraster_module"));
}

#[gaurast_runner::test]
fn what_cannot_be_simulated_is_said() {
    let folder = folder();
    write(&folder, "bad.json", "{}");
    let fails = |arguments: &[&str], message: &str| {
        fails(&folder, &[&["simulate"], arguments].concat(), message);
    };
    fails(&["--preset", "abacus"], "gaurast: there is no preset abacus");
    fails(&["--set", "moduls=3"], "gaurast: there is no field moduls");
    fails(&["--sweep", "modules=3..1"], "gaurast: --sweep modules=3..1");
    fails(
        &["--sweep", "modules=1..64", "--sweep", "batch=1..64", "--sweep", "numbers_in=1..64"],
        "gaurast: --sweep: 262144 machines",
    );
    fails(&["bad.json"], "gaurast: bad.json: not a trace of work");
    fails(&["missing.ply"], "gaurast: drawing the scene: missing.ply");
    fails(&["missing.json"], "gaurast: missing.json");
}

#[gaurast_runner::test]
fn machines_and_traces_that_cannot_be_are_refused() {
    let folder = folder();
    let fails = |arguments: &[&str], message: &str| {
        fails(&folder, &[&["simulate"], arguments].concat(), message);
    };
    for (setting, message) in [
        ("modules=4097", "rasterizer.modules is 4097; it must be from 0"),
        ("modules=-1", "rasterizer.modules is -1; it must be from 0"),
        ("modules=1.5", "modules=1.5 is not NAME=VALUE"),
        ("modules=18446744073709551616", "modules=18446744073709551616 is"),
        ("numbers_in=4294967295", "rasterizer.numbers_in is 4294967295"),
        ("memory.efficiency=100", "memory.efficiency is 100; it must be"),
        ("latency_ns=nan", "memory.latency_ns is NaN; it must be"),
        ("bandwidth_gb_s=1e999", "memory.bandwidth_gb_s is inf; it must"),
        ("power_w=", "power_w= is not NAME=VALUE"),
    ] {
        fails(&["--set", setting], &format!("gaurast: {message}"));
    }
    let traces = [
        ("", "not a trace of work"),
        ("[]", "not a trace of work"),
        ("gaurast\n\u{4}", "not a binary trace of work"),
        (r#"{"version":4,"frames":[]}"#, "there is no frame"),
        (r#"{"version":3,"frames":[]}"#, "version 3; only traces of version 4"),
        (r#"{"version":4,"frames":[{"size":[16,16],"draws":[]}]}"#, "the last frame has no work"),
        (
            r#"{"version":4,"frames":[{"size":[16,16],"draws":[],"compute":{"float":-1}}]}"#,
            "frame 0, compute: a count is negative",
        ),
        (r#"{"version":4,"frames":[{"size":[16,16],"draws":[],"compute":{"float":NaN}}]}"#, "not a trace of work"),
    ];
    let tiles = [
        (r#""at":[0,0],"listed":4294967295,"runs":[]"#, "frame 0 has 4294967295 pairs"),
        (r#""at":[0,0],"listed":4294967296,"runs":[]"#, "not a trace of work"),
        (
            r#""at":[0,0],"listed":1,"runs":[{"primitives":2,"rows":1,"blocks":1,"reached":1}]"#,
            "frame 0, draw 0, tile [0, 0], runs.primitives",
        ),
        (
            r#""at":[0,0],"listed":1,"runs":[{"primitives":1,"rows":17,"blocks":1,"reached":1}]"#,
            "frame 0, draw 0, tile [0, 0], runs.rows",
        ),
        (r#""at":[0,4294967295],"listed":1,"runs":[]"#, "frame 0, draw 0, tile [0, 4294967295], at"),
        (r#""at":[0,0],"layer":1,"listed":1,"ids":[1,2],"runs":[]"#, "frame 0, draw 0, tile [0, 0], ids"),
    ];
    let of_tile = |tile: &str| {
        format!(
            r#"{{"version":4,"frames":[{{"size":[16,16],"draws":[{{"mode":"gaussian","primitives":1,"drawn":1,
            "boxed_pairs":0,"preprocess":{{}},"sort":{{}},
            "tiles":[{{{tile},"contributions":0,"terminated":0}}]}}]}}]}}"#
        )
    };
    let whole = traces.map(|(text, message)| (text.to_owned(), message));
    let tiles = tiles.map(|(tile, message)| (of_tile(tile), message));
    for (text, message) in whole.into_iter().chain(tiles) {
        write(&folder, "trace.json", &text);
        fails(&["trace.json"], &format!("gaurast: trace.json: {message}"));
    }
    // A tile without Gaussians that are needed is simulated.
    write(&folder, "trace.json", &of_tile(r#""at":[0,0],"listed":1,"runs":[]"#));
    let output = gaurast(folder.path(), &["simulate", "trace.json", "--format", "csv"]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && text.lines().count() == 2, "{text}");
    assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
}

#[gaurast_runner::test]
fn the_papers_numbers_are_printed() {
    let folder = folder();
    let output = gaurast(folder.path(), &["simulate", "--paper"]);
    let text = String::from_utf8_lossy(&output.stdout);
    for part in ["bicycle", "GSCore", "predicted", "solved", "calibrated", "fit", "contradiction", "0.64 W"] {
        assert!(text.contains(part), "{part}");
    }
}
