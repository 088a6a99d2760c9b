//! `gaurast compare --compliance`: our own pictures, and wrong ones.

use std::path::{Path, PathBuf};

use serde_json::Value;
use tempfile::TempDir;

use super::support::{gaurast, succeeds, text};

/// The folder of scenes and exact pictures.
fn cases() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/compliance")
}

fn manifest() -> Value {
    let text = std::fs::read_to_string(cases().join("manifest.json")).expect("a manifest");
    serde_json::from_str(&text).expect("JSON")
}

/// Draws a case to NAME and the extension, and returns the name.
fn draw(folder: &TempDir, case: &Value, extension: &str) -> String {
    let string = |value: &Value| value.as_str().expect("a string").to_owned();
    let name = string(&case["name"]);
    let scene = cases().join(string(&case["scene"])).display().to_string();
    let cameras = cases().join("cameras.json").display().to_string();
    let output = format!("{name}.{extension}");
    let mut arguments = vec![scene, "--cameras".into(), cameras, "--view".into(), name.clone(), "-q".into()];
    arguments.extend(case["options"].as_array().expect("a list").iter().map(string));
    arguments.extend(["-o".to_owned(), output]);
    succeeds(folder, &arguments.iter().map(String::as_str).collect::<Vec<_>>());
    name
}

fn compare(folder: &TempDir, arguments: &[&str]) -> (Option<i32>, String, String) {
    let cases = cases().display().to_string();
    let output = gaurast(folder.path(), &[&["compare", "--compliance", &cases, "."], arguments].concat());
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[gaurast_runner::test]
fn our_pictures_hold_every_clause() {
    let folder = tempfile::tempdir().expect("a folder");
    let manifest = manifest();
    let cases = manifest["cases"].as_array().expect("a list");
    for case in cases {
        draw(&folder, case, "exr");
    }
    let (code, stdout, stderr) = compare(&folder, &["--json"]);
    assert_eq!((code, &*stderr), (Some(0), ""), "{stdout}");
    let result: Value = serde_json::from_str(&stdout).expect("JSON");
    let outcomes = result["cases"].as_array().expect("a list");
    assert_eq!(outcomes.len(), cases.len());
    for outcome in outcomes {
        // The driver's own contract, per unit of the greatest colour, is far below what is granted.
        let difference = outcome["difference"].as_f64().expect("a number");
        assert!(outcome["verdict"] == "holds" && difference < 3e-5, "{outcome}");
    }
    let (code, stdout, _) = compare(&folder, &[]);
    assert_eq!(code, Some(0));
    assert!(stdout.contains("Attributes: ROTATION") && stdout.contains("our choice: 5 of 5 hold"), "{stdout}");
}

#[gaurast_runner::test]
fn wrong_and_missing_pictures_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let manifest = manifest();
    let cases = manifest["cases"].as_array().expect("a list");
    let case = |name: &str| cases.iter().find(|case| case["name"] == name).expect("a case");
    for name in ["gltf-scale", "gltf-color-linear", "gltf-color-bright"] {
        draw(&folder, case(name), "png");
    }
    let (code, stdout, stderr) = compare(&folder, &[]);
    assert_eq!(code, Some(1));
    assert!(!stdout.contains("gltf-scale (") && !stdout.contains("gltf-color-linear ("), "{stdout}");
    assert!(stdout.contains("gltf-rotation (normative): there is no picture"), "{stdout}");
    // Other formats were not drawn at all.
    assert!(!stdout.contains("usd") && stderr.contains("normative pictures differ or are missing"), "{stderr}");

    let scale = folder.path().join("gltf-scale.png");
    std::fs::copy(folder.path().join("gltf-color-bright.png"), scale).expect("copied");
    let (code, stdout, _) = compare(&folder, &[]);
    assert_eq!(code, Some(1));
    assert!(
        stdout.contains("gltf-scale (normative): ") && stdout.contains("\"the scales are logarithms\""),
        "{stdout}"
    );

    // A recommended picture that differs is no failure.
    let other = tempfile::tempdir().expect("a folder");
    let order = draw(&other, case("order-inria"), "exr");
    std::fs::rename(other.path().join(format!("{order}.exr")), other.path().join("cut-off-inria.exr"))
        .expect("renamed");
    let (code, stdout, _) = compare(&other, &[]);
    assert_eq!(code, Some(0), "{stdout}");
    assert!(stdout.contains("cut-off-inria (recommended): "), "{stdout}");

    let (code, _, stderr) = compare(&tempfile::tempdir().expect("a folder"), &[]);
    assert_eq!(code, Some(1));
    assert!(stderr.contains("there is no picture in the folder"), "{stderr}");
}
