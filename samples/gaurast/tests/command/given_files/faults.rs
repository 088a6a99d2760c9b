//! Scenes of kinds that were drawn wrong once, each against its reference.

use std::path::Path;

use gaurast_picture::Statistics;
use gaurast_runner::data;

use super::render;

/// The view in which pictures are compared.
const VIEW: [&str; 8] = ["--eye", "1.5,-1.2,-3.5", "--target", "0,0,0", "--fov", "45", "--size", "320x240"];

/// The same view of a scene in UTM coordinates.
const UTM_VIEW: [&str; 8] =
    ["--eye", "500001.5,5399998.8,296.5", "--target", "500000,5400000,300", "--fov", "45", "--size", "320x240"];

/// Draws a scene of `faults` and returns the messages on standard error.
#[track_caller]
fn draw(folder: &Path, scene: &Path, picture: &str, options: &[&str]) -> String {
    let fixed = ["-o", picture, "--force"];
    let words = [scene.to_str().expect("text")].into_iter().chain(fixed).chain(options.iter().copied());
    let output = render(folder, words);
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{}: {stderr}", scene.display());
    stderr
}

/// The PSNR of two pictures in decibels.
fn psnr(folder: &Path, a: &str, b: &str) -> f64 {
    let [a, b] = [a, b].map(|name| gaurast_picture::read(&folder.join(name)).expect("a picture"));
    Statistics::new(&a.pixels, &b.pixels, b.width).psnr
}

/// A scene and the options with which it is drawn.
struct Input<'a> {
    scene: &'a Path,
    options: &'a [&'a str],
}

/// The scene at `scene`, drawn with `options`.
fn input<'a>(scene: &'a Path, options: &'a [&'a str]) -> Input<'a> {
    Input { scene, options }
}

/// Draws an input and its reference, checks that they are equal at `decibels`, and returns the messages of the first.
#[track_caller]
fn compare(input: &Input<'_>, reference: &Input<'_>, decibels: f64) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let stderr = draw(folder.path(), input.scene, "a.png", input.options);
    draw(folder.path(), reference.scene, "b.png", reference.options);
    let found = psnr(folder.path(), "a.png", "b.png");
    assert!(found >= decibels, "{}: {found} dB", input.scene.display());
    stderr
}

/// The options of [`VIEW`] and others.
fn view_with<'a>(others: &[&'a str]) -> Vec<&'a str> {
    VIEW.into_iter().chain(others.iter().copied()).collect()
}

#[gaurast_runner::test]
fn dialects_are_the_scenes_that_they_mean() {
    let mip = data("faults/mip_raw.ply");
    compare(&input(&mip, &VIEW), &input(&data("faults/mip_fused.ply"), &VIEW), 40.0);
    let log = data("faults/log_scale.glb");
    let said = compare(&input(&log, &VIEW), &input(&data("faults/linear_scale.glb"), &VIEW), 40.0);
    assert!(said.contains("scales are logarithms"), "{said}");
    let utm = data("faults/utm_double.ply");
    let said = compare(&input(&utm, &UTM_VIEW), &input(&data("faults/utm_reference.ply"), &VIEW), 40.0);
    assert!(said.contains("relative to 500000,5400000,300"), "{said}");
}

#[gaurast_runner::test]
fn usd_is_the_scene_of_which_it_was_made() {
    let base = data("faults/base.ply");
    for name in ["faults/base.usdc", "faults/base.usdz"] {
        compare(&input(&data(name), &VIEW), &input(&base, &VIEW), 60.0);
    }
}

#[gaurast_runner::test]
fn axes_are_named_by_the_file_or_the_option() {
    let [rdf, rub] = ["faults/spz_rdf.spz", "faults/spz_rub.spz"].map(data);
    let said =
        compare(&input(&rdf, &view_with(&["--axes", "rdf"])), &input(&rub, &view_with(&["--axes", "rub"])), 40.0);
    assert!(said.contains("the file's axes are rdf, as --axes says"), "{said}");
    let said = compare(&input(&rub, &VIEW), &input(&rub, &view_with(&["--axes", "rub"])), 40.0);
    assert!(
        said.contains("rub, the format's, since the file names none (--axes rdf if it stands on its head)"),
        "{said}"
    );

    let vertical = data("faults/vertical_axis_z.ply");
    let said = compare(&input(&vertical, &[]), &input(&vertical, &["--axes", "rfu"]), 40.0);
    assert!(said.contains("the file's axes are rfu, as the file says"), "{said}");
    // The red ball is above the green ground.
    let folder = tempfile::tempdir().expect("a folder");
    draw(folder.path(), &vertical, "a.png", &["--size", "64x48"]);
    let picture = image::open(folder.path().join("a.png")).expect("a picture").to_rgb8();
    let row = |channel: usize| {
        let weights = picture.enumerate_pixels().map(|(_, y, pixel)| (f64::from(y), f64::from(pixel.0[channel])));
        let (sum, total) = weights.fold((0.0, 0.0), |(sum, total), (y, weight)| (sum + y * weight, total + weight));
        sum / total
    };
    assert!(row(0) + 5.0 < row(1), "{} {}", row(0), row(1));
}

#[gaurast_runner::test]
fn camera_files_without_distortion_or_size_are_ideal_cameras() {
    let base = data("faults/base.ply");
    let model = data("faults/full_opencv_zero");
    compare(&input(&base, &["--cameras", model.to_str().expect("text")]), &input(&base, &VIEW), 40.0);
    let transforms = data("faults/blender_transforms.json");
    let transforms = transforms.to_str().expect("text");
    compare(&input(&base, &["--cameras", transforms, "--size", "320x240"]), &input(&base, &VIEW), 40.0);
    let folder = tempfile::tempdir().expect("a folder");
    let said = draw(folder.path(), &base, "a.png", &["--cameras", transforms]);
    assert!(said.contains("the file gives no size of its pictures"), "{said}");
}

#[gaurast_runner::test]
fn what_the_picture_lacks_is_named() {
    let time = data("faults/time_columns.ply");
    let folder = tempfile::tempdir().expect("a folder");
    let said = draw(folder.path(), &time, "a.png", &VIEW);
    assert!(said.contains("trbf_center, trbf_scale, motion_0 to motion_8, omega_0 to omega_3 are unknown"), "{said}");
    let points = data("faults/point_cloud.ply");
    for (scene, options, reason) in [
        (&time, &["--strict"][..], "are unknown and ignored"),
        (&points, &[], "it holds points without scales, which are no Gaussians"),
    ] {
        let words = [scene.to_str().expect("text"), "-o", "b.png"].into_iter().chain(options.iter().copied());
        let output = render(folder.path(), words);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
        assert!(stderr.contains(reason), "{stderr}");
        assert!(!folder.path().join("b.png").exists());
    }
    draw(folder.path(), &points, "b.png", &["--points", "0.05"]);
}

#[gaurast_runner::test]
fn thin_discs_are_listed_where_they_reach() {
    let folder = tempfile::tempdir().expect("a folder");
    let view = ["--eye", "0,0,-2.4", "--target", "0,0,0", "--size", "320x180", "--json", "-o", "a.png"];
    let discs = data("faults/needle_discs.ply");
    let output = render(folder.path(), [discs.to_str().expect("text")].into_iter().chain(view));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let counters = json["pictures"][0]["counters"].as_array().expect("counters");
    let pairs = counters.iter().find(|counter| counter["name"] == "tile pairs").expect("pairs");
    let pairs = pairs["value"].as_f64().expect("a number");
    assert!((100.0..3000.0).contains(&pairs), "{pairs}");
}
