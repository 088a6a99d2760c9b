//! Tests of the command line.

use std::process::{Command, Output};

use tempfile::TempDir;

fn bench(folder: &TempDir, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_gaurast-bench"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program runs")
}

/// Benchmarks a small scene and leaves the files in `folder`. Returns the table, the numbers as JSON, and a function
/// that counts the frames of a contender in the CSV file.
fn benchmark(folder: &TempDir) -> (String, serde_json::Value, impl Fn(&str) -> usize) {
    let arguments = [
        "frames",
        "--count",
        "300",
        "--size",
        "40x30",
        "--runs",
        "2",
        "--threads",
        "1",
        "--csv",
        "frames.csv",
        "--json",
        "frames.json",
    ];
    let output = bench(folder, &arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("written");
    let json = serde_json::from_str(&read("frames.json")).expect("JSON");
    let csv = read("frames.csv");
    let frames = move |contender: &str| {
        let cell = format!(",{contender},");
        csv.lines().filter(|row| row.contains(&cell)).count()
    };
    (text, json, frames)
}

#[gaurast_runner::test]
fn frames_are_benchmarked_and_held_against_the_oracle() {
    let folder = tempfile::tempdir().expect("a folder");
    let (text, json, frames) = benchmark(&folder);
    for part in ["synthetic 300", "quads on gaurast", "raster", "project"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    // The first frame and two more.
    assert_eq!(["gaurast", "quads on gaurast"].map(frames), [3, 3]);
    let series = json["scenes"][0]["series"].as_array().expect("series");
    let error = |contender: &str| {
        let of = series.iter().find(|series| series["contender"] == contender);
        of.expect("measured")["error"].clone()
    };
    let max = error("Gaurast")["max"].as_f64().expect("a number");
    // A Gaussian at the alpha floor may contribute or not, which makes this difference.
    assert!(max < 2.0 / 255.0, "{max}");
    let psnr = error("QuadsOnGaurast")["psnr"].as_f64().expect("a number");
    assert!(psnr > 40.0, "{psnr}");
}

#[gaurast_runner::test(needs = [gaurast_runner::Need::Lavapipe])]
fn lavapipe_is_benchmarked_where_it_is_installed() {
    let folder = tempfile::tempdir().expect("a folder");
    let (text, _, frames) = benchmark(&folder);
    assert!(text.contains("quads on lavapipe"), "{text}");
    assert_eq!(frames("quads on lavapipe"), 3);
}

#[gaurast_runner::test]
fn frames_of_a_path_and_a_cold_picture_are_timed() {
    let folder = tempfile::tempdir().expect("a folder");
    let arguments = ["path", "--count", "300", "--size", "40x30", "--frames", "14", "--csv", "path.csv"];
    let output = bench(&folder, &arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let text = String::from_utf8_lossy(&output.stdout);
    for part in ["synthetic 300", "slowest/median", "read file", "PNG"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let csv = std::fs::read_to_string(folder.path().join("path.csv")).expect("written");
    let rows = csv.lines().filter(|row| row.starts_with("synthetic 300,"));
    assert_eq!(rows.count(), 14);
}

#[gaurast_runner::test(needs = [gaurast_runner::Need::Lavapipe, gaurast_testkit::shader::GLSLANG])]
fn workloads_are_measured_beside_lavapipe() {
    let folder = tempfile::tempdir().expect("a folder");
    let arguments = ["beside", "--only", "prefix sum,500 image copies", "--threads", "1", "--runs", "1"];
    let arguments = [&arguments[..], &["--csv", "beside.csv"]].concat();
    let output = bench(&folder, &arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let csv = std::fs::read_to_string(folder.path().join("beside.csv")).expect("written");
    for name in ["prefix sum", "\"500 image copies, timeline semaphores\""] {
        let row = csv.lines().find(|row| row.starts_with(name)).expect("measured");
        assert!(row.contains("llvmpipe"), "{row}");
        let ratio = row.rsplit(',').next().and_then(|cell| cell.parse::<f64>().ok());
        assert!(ratio.is_some_and(|ratio| ratio > 0.0), "{row}");
    }
}
