//! Gaussians at known points are drawn where the lenses of camera files show them.

use std::path::Path;

use gaurast_scene::Camera;
use gaurast_scene::camera_files::{self, CameraFileOptions};
use glam::{DVec2, DVec3};
use image::Rgba32FImage;
use tempfile::TempDir;

use super::cameras::{check_places, scene};
use super::render;

/// A lens of each model of COLMAP that distorts, as cameras.txt has it after the camera's number.
const LENSES: [&str; 12] = [
    "SIMPLE_RADIAL 400 300 290 201 149 -0.08",
    "RADIAL 400 300 290 201 149 -0.21 0.01",
    "OPENCV 400 300 290 288 201 149 -0.35 0.05 0.0012 -0.0008",
    "FULL_OPENCV 400 300 290 288 201 149 0.42 -0.11 -0.0006 0.0009 0.013 0.77 -0.05 0.021",
    "FOV 400 300 290 288 201 149 0.92",
    "SIMPLE_DIVISION 400 300 290 201 149 -0.19",
    "DIVISION 400 300 290 288 201 149 0.11",
    "SIMPLE_RADIAL_FISHEYE 400 300 190 201 149 -0.045",
    "RADIAL_FISHEYE 400 300 190 201 149 0.031 -0.012",
    "OPENCV_FISHEYE 400 300 115 114 201 149 0.034 -0.009 0.0051 -0.0061",
    "THIN_PRISM_FISHEYE 400 300 115 114 201 149 -0.021 0.0043 0.0007 -0.0011 -0.0026 0.0004 0.0013 -0.0009",
    "RAD_TAN_THIN_PRISM_FISHEYE 400 300 115 114 201 149 0.399 -0.356 0.172 0.021 -0.047 0.0108 0.0009 -0.0004 0.0016 \
     -0.0003 -0.0007 0.0002",
];

/// The distance from the border of the picture and from each other, in pixels, of the Gaussians.
const APART: f64 = 26.0;

/// The camera of the line, at the origin, whose files are in `folder`.
fn camera(line: &str, folder: &Path) -> Camera {
    std::fs::write(folder.join("cameras.txt"), format!("1 {line}\n")).expect("written");
    std::fs::write(folder.join("images.txt"), "1 1 0 0 0 0 0 0 1 a.png\n\n").expect("written");
    let options = CameraFileOptions { size: [8, 8], dataparser: None, undistorted: false };
    camera_files::read(folder, &options).expect(line).views.remove(0).camera
}

/// Points whose places in the picture are apart, near the axis and far from it, with those places.
fn points(camera: &Camera) -> Vec<(DVec3, DVec2)> {
    let size = DVec2::new(camera.width.into(), camera.height.into());
    let mut points: Vec<(DVec3, DVec2)> = Vec::new();
    for step in (0..400_u32).map(|index| index * 173 % 400) {
        let (angle, turn) = (f64::from(step) * 0.0037, f64::from(step) * 2.4);
        let direction = DVec3::new(angle.sin() * turn.cos(), angle.sin() * turn.sin(), angle.cos());
        // The file stores points in binary32.
        let point = (direction * (2.0 + 0.01 * f64::from(step))).as_vec3().as_dvec3();
        let Some(place) = camera.project(point.to_array()).map(DVec2::from_array) else {
            continue;
        };
        let within = place.cmpgt(DVec2::splat(APART / 2.0)).all() && place.cmplt(size - APART / 2.0).all();
        if within && points.len() < 18 && points.iter().all(|(_, other)| other.distance(place) > APART) {
            points.push((point, place));
        }
    }
    points
}

fn draw(folder: &TempDir, options: &[&str]) -> (Rgba32FImage, String) {
    let fixed = ["points.ply", "-o", "a.exr", "--force", "--cameras", "."];
    let output = render(folder.path(), fixed.iter().chain(options));
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{stderr}");
    (image::open(folder.path().join("a.exr")).expect("an EXR").into_rgba32f(), stderr)
}

fn write(folder: &TempDir, points: &[(DVec3, f64)]) {
    std::fs::write(folder.path().join("points.ply"), scene(points.iter().copied())).expect("written");
}

#[gaurast_runner::test]
fn gaussians_are_where_lenses_show_them() {
    for line in LENSES {
        let folder = tempfile::tempdir().expect("a folder");
        let camera = camera(line, folder.path());
        let points = points(&camera);
        let farthest =
            points.iter().map(|(_, place)| place.distance(DVec2::from(camera.principal))).fold(0.0, f64::max);
        assert!(points.len() >= 12 && farthest > 150.0, "{line}: {} points, up to {farthest}", points.len());
        // Each is about a pixel large.
        let sized: Vec<_> = points.iter().map(|(point, _)| (*point, point.length() / camera.focal[0])).collect();
        write(&folder, &sized);
        let (picture, said) = draw(&folder, &[]);
        let largest = check_places(&picture, points.iter().map(|(_, place)| *place));
        println!("{line}: {largest:.4} px of {} Gaussians", points.len());
        assert!(said.contains("the lens distorts and is drawn so ("), "{said}");
        // Twice as wide, in half the height.
        let (picture, _) = draw(&folder, &["--size", "800x150"]);
        let resized = camera.resized([800, 150]);
        let places = points.iter().map(|(point, _)| resized.project(point.to_array()).expect("before the fold"));
        let apart = places.map(DVec2::from).next().expect("a point");
        assert!(picture.get_pixel(apart.x as u32, apart.y as u32).0[3] > 0.3, "{line}: {apart}");
    }
}

#[gaurast_runner::test]
fn nothing_is_drawn_beyond_the_fold() {
    let folder = tempfile::tempdir().expect("a folder");
    let camera = camera(LENSES[2], folder.path());
    let fold = camera.distortion.fold();
    assert!((1.2..1.22).contains(&fold), "{fold}");
    // Its distorted place would be within the picture.
    write(&folder, &[(DVec3::new(1.3 * fold, 0.0, 1.0), 0.01)]);
    let (picture, said) = draw(&folder, &[]);
    assert!(picture.pixels().all(|pixel| pixel.0[3] == 0.0));
    assert!(said.contains("up to 50.4 degrees from its axis, where it folds"), "{said}");
    assert!(said.contains("there is nothing in the picture"), "{said}");
    write(&folder, &[(DVec3::new(0.5 * fold, 0.0, 1.0), 0.01)]);
    let (picture, _) = draw(&folder, &[]);
    assert!(picture.pixels().any(|pixel| pixel.0[3] > 0.5));
    // An ideal lens shows it.
    write(&folder, &[(DVec3::new(0.6, 0.0, 1.0), 0.01)]);
    let (picture, said) = draw(&folder, &["--undistorted"]);
    assert!(
        said.contains("the lens's distortion (k1 = -0.35, k2 = 0.05, p1 = 0.0012, p2 = -0.0008) is left out"),
        "{said}"
    );
    assert!(picture.get_pixel(375, 149).0[3] > 0.5);
}

#[gaurast_runner::test]
fn what_is_not_drawn_with_a_lens_is_one_sentence() {
    let folder = tempfile::tempdir().expect("a folder");
    camera(LENSES[2], folder.path());
    write(&folder, &[(DVec3::new(0.0, 0.0, 1.0), 0.1)]);
    let triangle = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 2\n1 0 2\n0 1 2\n3 0 1 2\n";
    std::fs::write(folder.path().join("triangle.ply"), triangle).expect("written");
    for (options, reason) in [
        (&["--geometry", "2d"][..], "flat Gaussians (2d) are drawn by ideal lenses alone (--undistorted)"),
        (&["--order", "per-pixel"], "the order per-pixel goes with ideal lenses alone (--undistorted)"),
        (&["triangle.ply"], "meshes are drawn by ideal lenses alone (--undistorted)"),
    ] {
        let fixed = ["points.ply", "-q", "-o", "b.png", "--cameras", "."];
        let output = render(folder.path(), fixed.iter().chain(options));
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!((output.status.code(), stderr.trim()), (Some(1), &*format!("gaurast: {reason}")));
    }
    // Another projection has an ideal lens, and says so.
    let (_, said) = draw(&folder, &["--camera", "panorama"]);
    assert!(said.contains("--camera has an ideal lens, and the distortion of the file's is left out"), "{said}");
}
