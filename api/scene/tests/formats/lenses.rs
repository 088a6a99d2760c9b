//! Lenses of camera files against what OpenCV and COLMAP project: `lenses/project.py` writes their answers.

use std::path::Path;
use std::process::Command;

use gaurast_runner::{Missing, Need, ignore, is_long, require};
use gaurast_scene::camera_files::{self, CameraFileOptions};
use gaurast_scene::{Camera, Distortion};
use serde::Deserialize;

/// A lens and the places of points in its picture.
#[derive(Deserialize)]
struct Lens {
    name: String,
    /// The other program.
    program: String,
    /// The line of a cameras.txt, after the camera's number.
    colmap: Option<String>,
    /// A lens in our own form, with focal lengths and principal point.
    distortion: Option<Distortion>,
    focal: Option<[f64; 2]>,
    principal: Option<[f64; 2]>,
    /// The ideal radius at which it folds, if that is near.
    fold: Option<f64>,
    /// Points in the camera's coordinates, and their places in the picture in pixels.
    points: Vec<[f64; 5]>,
}

impl Lens {
    /// The camera at the origin, which looks along z.
    fn camera(&self) -> Camera {
        let folder = tempfile::tempdir().expect("a folder");
        let line = self.colmap.as_deref().unwrap_or("PINHOLE 4000 3000 1 1 0 0");
        std::fs::write(folder.path().join("cameras.txt"), format!("1 {line}\n")).expect("written");
        std::fs::write(folder.path().join("images.txt"), "1 1 0 0 0 0 0 0 1 a.png\n\n").expect("written");
        let options = CameraFileOptions { size: [8, 8], dataparser: None, undistorted: false };
        let mut camera = camera_files::read(folder.path(), &options).expect(&self.name).views.remove(0).camera;
        camera.distortion = self.distortion.unwrap_or(camera.distortion);
        camera.focal = self.focal.unwrap_or(camera.focal);
        camera.principal = self.principal.unwrap_or(camera.principal);
        camera
    }

    /// The largest distance in pixels from the other program's places.
    fn check(&self) -> f64 {
        let camera = self.camera();
        let mut largest = 0.0_f64;
        for [x, y, z, across, down] in &self.points {
            let ours = camera.project([*x, *y, *z]).expect("a place before the fold");
            largest = largest.max((ours[0] - across).hypot(ours[1] - down));
        }
        if let Some(fold) = self.fold {
            let ours = camera.distortion.fold();
            assert!((ours - fold).abs() < 1e-5, "{}: it folds at {ours}, not {fold}", self.name);
            let place = |radius: f64| camera.distortion.distort([0.6 * radius, 0.8 * radius]);
            assert!(place(0.9999 * ours).is_some() && place(1.0001 * ours).is_none(), "{}", self.name);
        }
        largest
    }
}

/// Checks all lenses of a text of `project.py`, and prints the table of the documentation.
fn check_all(text: &str) {
    let lenses: Vec<Lens> = serde_json::from_str(text).expect("JSON");
    assert!(lenses.len() >= 16, "{} lenses", lenses.len());
    for lens in lenses {
        let largest = lens.check();
        println!("{} ({}): {largest:.1e} px of {} points", lens.name, lens.program, lens.points.len());
        // The answers are rounded to 1e-7 pixels. A polynomial stands for this lens.
        let limit = if lens.name == "EUCM" { 1e-2 } else { 1e-6 };
        assert!(largest < limit, "{}: {largest} pixels from {}", lens.name, lens.program);
    }
}

/// With `GAURAST_TEST_LONG=1`, the programs themselves are asked for more points.
#[gaurast_runner::test]
fn lenses_project_as_opencv_and_colmap_do() {
    check_all(include_str!("lenses/projected.json"));
    if is_long() {
        check_all(&projected_now());
    }
}

/// The programs' answers for 5,400 points of each lens.
fn projected_now() -> String {
    require(Need::Program("python3"));
    let has_modules = Command::new("python3").args(["-c", "import cv2, pycolmap"]).output();
    if !has_modules.is_ok_and(|output| output.status.success()) {
        ignore(Missing::Program, "there is no Python with cv2 and pycolmap");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("projected.json");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats/lenses/project.py");
    let output = Command::new("python3").arg(script).args(["90", "60"]).arg(&path).output().expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    std::fs::read_to_string(&path).expect("its answers")
}
