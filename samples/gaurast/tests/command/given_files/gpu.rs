//! Pictures that 3DGS's and gsplat's CUDA code drew on a GPU, against those of `--as`.

use std::fmt::Write;
use std::path::Path;

use gaurast_runner::{Need, data};
use glam::{DMat3, DQuat, DVec3};
use serde_json::Value;
use tempfile::TempDir;

use super::render;

/// Pictures of one program and mode.
struct Set {
    name: &'static str,
    /// The reciprocal of the step to which its values are rounded.
    steps: f64,
    options: &'static [&'static str],
    /// The camera model of COLMAP, and its coefficients, if the cameras are no ideal pinholes.
    lens: Option<(&'static str, &'static str)>,
    views: &'static [&'static str],
    /// The least PSNR in decibels.
    least: f64,
    /// The most pixels that differ by more than 1/255.
    most: usize,
}

const ALL: [&str; 6] = ["plant-0", "plant-2", "playbot-0", "playbot-2", "skull-0", "skull-2"];

const GSPLAT: &[&str] = &["--as", "gsplat", "--near", "0.2"];

impl Set {
    const fn new(name: &'static str, steps: f64, options: &'static [&'static str]) -> Self {
        Self { name, steps, options, lens: None, views: &ALL, least: 88.0, most: 0 }
    }

    /// Checks every view, and prints the table of the documentation.
    fn check(&self) {
        let folder = tempfile::tempdir().expect("a folder");
        let cameras = data("reference/gpu/cameras.json");
        if let Some((model, coefficients)) = self.lens {
            write_lenses(folder.path(), &cameras, model, coefficients);
        }
        let cameras = if self.lens.is_some() { folder.path().to_owned() } else { cameras };
        let mut failures = String::new();
        for view in self.views {
            let (decibels, over, largest) = self.measure(view, &cameras, &folder);
            println!("{} {view}: {decibels:.1} dB, {over} pixels over 1/255, at most {largest:.2} of 255", self.name);
            if decibels < self.least || over > self.most {
                writeln!(failures, "{view}: {decibels} dB, {over} pixels").expect("memory");
            }
        }
        assert!(failures.is_empty(), "{}: {failures}", self.name);
    }

    /// The PSNR, the pixels that differ by more than 1/255, and the largest difference in steps of 255.
    fn measure(&self, view: &str, cameras: &Path, folder: &TempDir) -> (f64, usize, f64) {
        let scene = match view.split('-').next() {
            Some("skull") => data("splats/skull.ply"),
            Some("playbot") => data("splats/playbot-125k.ply"),
            _ => data("splats/plant.splat"),
        };
        let drawn = folder.path().join("drawn.exr");
        let mut arguments =
            vec![scene.into_os_string(), "--cameras".into(), cameras.into(), "--view".into(), view.into()];
        arguments.extend(["-q".into(), "--force".into(), "-o".into(), drawn.clone().into_os_string()]);
        arguments.extend(self.options.iter().map(Into::into));
        let output = render(folder.path(), arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let theirs = data("reference/gpu").join(self.name).join(format!("{view}.exr"));
        let [ours, theirs] = [&drawn, &theirs].map(|path| image::open(path).expect("a picture").into_rgba32f());
        assert_eq!(ours.dimensions(), theirs.dimensions());
        let (mut squares, mut over, mut largest) = (0.0, 0, 0.0_f64);
        for (ours, theirs) in ours.pixels().zip(theirs.pixels()) {
            let apart = |channel: usize| {
                let rounded = (f64::from(ours[channel]) * self.steps).round() / self.steps;
                (rounded - f64::from(theirs[channel])).abs()
            };
            let apart = [0, 1, 2].map(apart);
            let greatest = apart.into_iter().fold(0.0, f64::max);
            squares += apart.into_iter().map(|apart| apart * apart).sum::<f64>();
            over += usize::from(greatest > 1.0 / 255.0);
            largest = largest.max(greatest);
        }
        let count = 3.0 * f64::from(ours.width()) * f64::from(ours.height());
        (-10.0 * (squares / count).log10(), over, 255.0 * largest)
    }
}

/// Writes the cameras at `path` as COLMAP's of a model with the same focal lengths.
fn write_lenses(folder: &Path, path: &Path, model: &str, coefficients: &str) {
    let text = std::fs::read_to_string(path).expect("a camera file");
    let views: Vec<Value> = serde_json::from_str(&text).expect("JSON");
    let number = |value: &Value| value.as_f64().expect("a number");
    let vector = |value: &Value| DVec3::from_array(std::array::from_fn(|i| number(&value[i])));
    let (mut cameras, mut images) = (String::new(), String::new());
    for (id, view) in (1..).zip(&views) {
        let [width, height] = ["width", "height"].map(|name| number(&view[name]));
        let (fx, fy) = (number(&view["fx"]), number(&view["fy"]));
        let (cx, cy) = (width / 2.0, height / 2.0);
        writeln!(cameras, "{id} {model} {width} {height} {fx} {fy} {cx} {cy} {coefficients}").expect("memory");
        // The file has rows of the rotation from camera to world, which are columns of its inverse.
        let rotation = DMat3::from_cols_array_2d(&[0, 1, 2].map(|row| vector(&view["rotation"][row]).to_array()));
        let translation = -(rotation * vector(&view["position"]));
        let quaternion = DQuat::from_mat3(&rotation);
        let DQuat { x, y, z, w } = quaternion;
        let [tx, ty, tz] = translation.to_array();
        let name = view["img_name"].as_str().expect("a name");
        writeln!(images, "{id} {w} {x} {y} {z} {tx} {ty} {tz} {id} {name}.png\n").expect("memory");
    }
    for (name, text) in [("cameras.txt", cameras), ("images.txt", images), ("points3D.txt", String::new())] {
        std::fs::write(folder.join(name), text).expect("written");
    }
}

const NEEDS: [Need; 4] = [
    Need::Data("reference/gpu"),
    Need::Data("splats/skull.ply"),
    Need::Data("splats/playbot-125k.ply"),
    Need::Data("splats/plant.splat"),
];

#[gaurast_runner::test(needs = NEEDS)]
fn pictures_of_inria_s_code() {
    Set::new("inria", 16_384.0, &["--as", "inria"]).check();
}

#[gaurast_runner::test(needs = NEEDS)]
fn pictures_of_gsplat() {
    Set::new("gsplat", 16_384.0, GSPLAT).check();
}

#[gaurast_runner::test(needs = NEEDS)]
fn compensated_pictures_of_gsplat() {
    let options = &["--as", "gsplat", "--near", "0.2", "--antialiasing", "compensated"];
    Set::new("gsplat_compensated", 8_192.0, options).check();
}

#[gaurast_runner::test(needs = NEEDS)]
fn fisheyes_of_gsplat() {
    Set { lens: Some(("FISHEYE", "")), ..Set::new("gsplat_fisheye", 4_096.0, GSPLAT) }.check();
}

/// The pixels over 1/255 are those of radii that gsplat's binary32 rounds up to another whole number of pixels, and of discs a million
/// times thinner than wide, whose cross products cancel in binary32.
#[gaurast_runner::test(needs = NEEDS)]
fn flat_pictures_of_gsplat() {
    let options = &["--as", "gsplat", "--near", "0.2", "--geometry", "2d"];
    Set { least: 84.2, most: 6, ..Set::new("gsplat_2d", 4_096.0, options) }.check();
}

/// Of the pixel over 1/255 one splat's alpha is 1.0025 times the floor: gsplat sums its mean in binary32, with weights of -99 and 16.7.
#[gaurast_runner::test(needs = NEEDS)]
fn unscented_pictures_of_gsplat() {
    let options = &["--as", "gsplat-unscented", "--near", "0.2"];
    Set { least: 81.4, most: 1, views: &ALL[..4], ..Set::new("gsplat_unscented", 4_096.0, options) }.check();
}

#[gaurast_runner::test(needs = NEEDS)]
fn distorted_pictures_of_gsplat() {
    let lens = Some(("FULL_OPENCV", "0.12 -0.05 0.002 -0.003 0.01 0 0 0"));
    Set {
        least: 81.0,
        most: 1,
        views: &["plant-0", "playbot-0"],
        lens,
        ..Set::new("gsplat_distorted", 4_096.0, GSPLAT)
    }
    .check();
}

#[gaurast_runner::test(needs = NEEDS)]
fn distorted_fisheyes_of_gsplat() {
    let lens = Some(("OPENCV_FISHEYE", "0.05 -0.01 0.002 -0.0005"));
    Set {
        least: 80.9,
        most: 0,
        views: &["plant-0", "playbot-0"],
        lens,
        ..Set::new("gsplat_distorted_fisheye", 4_096.0, GSPLAT)
    }
    .check();
}
