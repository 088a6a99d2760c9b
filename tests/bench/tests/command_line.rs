//! The command line, as a user meets it.

use std::process::{Command, Output};

use tempfile::TempDir;

fn bench(folder: &TempDir, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_gaurast-bench"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program runs")
}

#[test]
fn frames_are_benchmarked_and_held_against_the_oracle() {
    let folder = tempfile::tempdir().expect("a folder");
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
    let output = bench(&folder, &arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let text = String::from_utf8_lossy(&output.stdout);
    for part in ["synthetic 300", "quads on gaurast", "raster", "project"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("written");
    // A comment, a header, and three frames of each contender; lavapipe may be absent.
    let rows = read("frames.csv").lines().count();
    assert!([8, 11].contains(&rows), "{rows}");
    let json: serde_json::Value = serde_json::from_str(&read("frames.json")).expect("JSON");
    let series = json["scenes"][0]["series"].as_array().expect("series");
    let error = |contender: &str| {
        let of = series
            .iter()
            .find(|series| series["contender"] == contender);
        of.expect("measured")["error"].clone()
    };
    let max = error("Gaurast")["max"].as_f64().expect("a number");
    // A Gaussian that counts or not at the floor of alpha makes this much.
    assert!(max < 2.0 / 255.0, "{max}");
    let psnr = error("QuadsOnGaurast")["psnr"].as_f64().expect("a number");
    assert!(psnr > 40.0, "{psnr}");
}
