//! Gaussians at known points are drawn where the camera file's camera projects them.

use std::path::Path;

use glam::{DMat3, DVec2, DVec3};
use image::Rgba32FImage;
use serde_json::Value;

use super::render;

/// A camera computed by this test directly from the file's text.
struct Expected {
    /// The rotation from camera to world: its columns are right, down and forward.
    to_world: DMat3,
    eye: DVec3,
    focal: DVec2,
    principal: DVec2,
    size: [u32; 2],
}

impl Expected {
    /// The pixel of a point in world space.
    fn project(&self, point: DVec3) -> DVec2 {
        let t = self.to_world.transpose() * (point - self.eye);
        self.focal * t.truncate() / t.z + self.principal
    }

    /// Points whose pictures are far apart, at different depths and at arbitrary positions within a pixel.
    fn points(&self) -> Vec<DVec3> {
        let [width, height] = self.size.map(f64::from);
        let spots = (0..12_u32).map(|i| {
            let [column, row] = [f64::from(i % 4), f64::from(i / 4)];
            let pixel = DVec2::new(
                (column + 0.5) * width / 4.0 + 3.17 * f64::from(i),
                (row + 0.5) * height / 3.0 - 2.71 * f64::from(i),
            );
            let depth = 1.0 + 0.9 * f64::from(i);
            let ray = ((pixel - self.principal) / self.focal).extend(1.0);
            self.eye + self.to_world * (depth * ray)
        });
        // The file stores them in binary32.
        spots.map(|point| point.as_vec3().as_dvec3()).collect()
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn vector(value: &Value) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|i| number(&value[i])))
}

/// A different colour for each Gaussian, of at most 18.
fn colour(index: usize) -> [f64; 3] {
    [index % 2, index / 2 % 3, index / 6].map(|step| 0.3 + 0.3 * step as f64)
}

/// A PLY file of opaque Gaussians at points, each with its standard deviation.
pub(super) fn scene(gaussians: impl ExactSizeIterator<Item = (DVec3, f64)>) -> String {
    let properties = [
        "x", "y", "z", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3", "opacity", "f_dc_0",
        "f_dc_1", "f_dc_2",
    ];
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n", gaussians.len());
    for property in properties {
        text += &format!("property float {property}\n");
    }
    text += "end_header\n";
    for (index, (point, deviation)) in gaussians.enumerate() {
        let scale = deviation.ln();
        let [r, g, b] = colour(index).map(|c| (c - 0.5) / 0.282_094_791_773_878_14);
        let [x, y, z] = point.to_array();
        text += &format!("{x} {y} {z} {scale} {scale} {scale} 1 0 0 0 2.2 {r} {g} {b}\n");
    }
    text
}

/// Checks that every Gaussian of a scene is in the picture at its place, which is not near the border or another one. The
/// result is the largest distance in pixels.
pub(super) fn check_places(picture: &Rgba32FImage, places: impl Iterator<Item = DVec2>) -> f64 {
    let mut largest = 0.0_f64;
    for (index, expected) in places.enumerate() {
        // The pixels of the Gaussian are near it, and those of the next one are not.
        let corner = (expected - 12.0).floor();
        let pixels = (0..24_u32).flat_map(|y| (0..24_u32).map(move |x| DVec2::new(x.into(), y.into())));
        let (mut sum, mut total, mut colours) = (DVec2::ZERO, 0.0, DVec3::ZERO);
        for offset in pixels {
            let at = corner + offset;
            let [r, g, b, alpha] = picture.get_pixel(at.x as u32, at.y as u32).0.map(f64::from);
            sum += alpha * (at + 0.5);
            total += alpha;
            colours += DVec3::new(r, g, b);
        }
        assert!(total > 1.0, "nothing is at {expected}");
        let centroid = sum / total;
        let distance = centroid.distance(expected);
        assert!(distance < 0.05, "{index}: {centroid} is not {expected}");
        largest = largest.max(distance);
        let colours = colours / total - DVec3::from_array(colour(index));
        assert!(colours.abs().max_element() < 1e-4, "{index}: {colours} off");
    }
    largest
}

/// Renders with the camera file and checks that every Gaussian is where `camera` projects it.
fn check(camera: &Expected, file: &Path, arguments: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    let points = camera.points();
    // Each is about a pixel large.
    let deviation = |point: DVec3| (camera.to_world.transpose() * (point - camera.eye)).z / camera.focal.max_element();
    let text = scene(points.iter().map(|point| (*point, deviation(*point))));
    std::fs::write(folder.path().join("points.ply"), text).expect("written");
    let file = file.to_str().expect("text");
    let fixed = ["points.ply", "--quiet", "-o", "a.exr", "--cameras", file];
    let output = render(folder.path(), fixed.iter().chain(arguments));
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    let picture = image::open(folder.path().join("a.exr")).expect("an EXR");
    let picture = picture.into_rgba32f();
    assert_eq!(<[u32; 2]>::from(picture.dimensions()), camera.size);
    check_places(&picture, points.iter().map(|point| camera.project(*point)));
}

/// The camera of view `view` of a cameras.json, for a picture of `size`.
fn inria(text: &str, view: usize, size: [u32; 2]) -> Expected {
    let cameras: Value = serde_json::from_str(text).expect("JSON");
    let camera = &cameras[view];
    let full = DVec2::new(number(&camera["width"]), number(&camera["height"]));
    let size_2d = DVec2::new(size[0].into(), size[1].into());
    let rows = [0, 1, 2].map(|row| vector(&camera["rotation"][row]));
    Expected {
        to_world: DMat3::from_cols(rows[0], rows[1], rows[2]).transpose(),
        eye: vector(&camera["position"]),
        focal: DVec2::new(number(&camera["fx"]), number(&camera["fy"])) * size_2d / full,
        principal: size_2d / 2.0,
        size,
    }
}

#[gaurast_runner::test]
fn inria_cameras_are_exactly_those_of_the_file() {
    for (file, view) in [
        ("cameras/garden.json", 3),
        ("cameras/garden.json", 0),
        ("cameras/bicycle.json", 100),
        ("cameras/room.json", 310),
    ] {
        let path = gaurast_runner::data(file);
        let text = std::fs::read_to_string(&path).expect("text");
        for size in [[1296, 840], [500, 500]] {
            let camera = inria(&text, view, size);
            let arguments = ["--view", &view.to_string(), "--size", &format!("{}x{}", size[0], size[1])];
            check(&camera, &path, &arguments);
        }
    }
}

#[gaurast_runner::test]
fn real_camera_paths_are_read() {
    for (file, count) in [
        ("cameras/bicycle.json", 194),
        ("cameras/garden.json", 185),
        ("cameras/room.json", 311),
        ("cameras/bonsai.json", 292),
    ] {
        let views = gaurast_scene::camera_files::load(&gaurast_runner::data(file), [1, 1]).expect(file);
        assert_eq!(views.len(), count, "{file}");
    }
}

#[gaurast_runner::test]
fn nerfstudio_cameras_are_exactly_those_of_the_file() {
    // An arbitrary rotation. In OpenGL's axes a camera's columns are right, up and back.
    let to_world = glam::DQuat::from_xyzw(0.3, -0.5, 0.7, 0.2).normalize();
    let [right, up, back] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| to_world * axis);
    let eye = DVec3::new(2.5, -1.25, 7.75);
    let row = |i: usize| [right[i], up[i], back[i], eye[i]];
    let frame = serde_json::json!({
        "file_path": "b.png",
        "transform_matrix": [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]],
    });
    let other = serde_json::json!({
        "file_path": "a.png",
        "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
    });
    let file = serde_json::json!({
        "camera_model": "OPENCV", "w": 640, "h": 480,
        "fl_x": 500.0, "fl_y": 520.0, "cx": 310.0, "cy": 251.0,
        "frames": [other, frame],
    });
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("transforms.json");
    std::fs::write(&path, file.to_string()).expect("written");
    let camera = Expected {
        to_world: DMat3::from_cols(right, -up, -back),
        eye,
        focal: DVec2::new(500.0, 520.0),
        principal: DVec2::new(310.0, 251.0),
        size: [640, 480],
    };
    check(&camera, &path, &["--view", "1"]);
    // Twice as wide: each axis is scaled separately.
    let wide =
        Expected { focal: DVec2::new(1000.0, 520.0), principal: DVec2::new(620.0, 251.0), size: [1280, 480], ..camera };
    check(&wide, &path, &["--view", "1", "--size", "1280x480"]);
}
