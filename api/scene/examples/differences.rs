//! Prints the largest differences of the attributes of two scene files with the same Gaussians in the same order:
//! `cargo run --release -p gaurast-scene --example differences -- A B`.
//!
//! The line has the number of Gaussians and the spherical harmonics degree, then the largest difference of a coordinate,
//! of a scale's logarithm, of an opacity (0 to 1), of a rotation in degrees, and of a spherical harmonics coefficient.

use std::process::ExitCode;

use gaurast_scene::{GaussianShape, Scene, SceneError};

/// The rotation in degrees between two orientations, given as quaternions that need not be normalised.
fn angle(a: [f32; 4], b: [f32; 4]) -> f64 {
    let norm = |q: [f32; 4]| q.map(f64::from).map(|c| c * c).iter().sum::<f64>().sqrt();
    let unit = |q: [f32; 4]| q.map(|c| f64::from(c) / norm(q));
    let (a, b) = (unit(a), unit(b));
    // The sign of a quaternion has no meaning. The chord is exact for small angles, where the arc cosine is not.
    let chord = |sign: f64| (0..4).map(|i| (a[i] - sign * b[i]).powi(2)).sum::<f64>().sqrt();
    4.0 * (chord(1.0).min(chord(-1.0)) / 2.0).asin().to_degrees()
}

/// The greatest value; NaN counts as nothing.
fn greatest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

/// The greatest difference of numbers at the same place.
fn difference(a: &[[f32; 3]], b: &[[f32; 3]], map: impl Fn(f64) -> f64) -> f64 {
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    greatest(pairs.map(|(a, b)| (map(f64::from(*a)) - map(f64::from(*b))).abs()))
}

fn line(a: &Scene, b: &Scene) -> String {
    let scales = |scene: &Scene| -> Vec<[f32; 3]> { scene.shapes().iter().map(|s| s.scale).collect() };
    let pairs = || a.shapes().iter().zip(b.shapes());
    let of = |each: &dyn Fn(&GaussianShape, &GaussianShape) -> f64| greatest(pairs().map(|(a, b)| each(a, b)));
    format!(
        "{} Gaussians of degree {}: position {:.2e}, ln scale {:.2e}, opacity {:.2e}, rotation {:.2e} degrees, \
         harmonics {:.2e}",
        a.len(),
        a.sh_degree(),
        difference(a.positions(), b.positions(), |x| x),
        difference(&scales(a), &scales(b), f64::ln),
        of(&|a, b| f64::from((a.opacity - b.opacity).abs())),
        of(&|a, b| angle(a.rotation, b.rotation)),
        difference(a.sh(), b.sh(), |x| x),
    )
}

fn compare(paths: &[std::path::PathBuf]) -> Result<String, SceneError> {
    let (a, b) = (gaurast_scene::open(&paths[0])?, gaurast_scene::open(&paths[1])?);
    if (a.len(), a.sh_degree()) != (b.len(), b.sh_degree()) {
        let of = |scene: &Scene| format!("{} Gaussians of degree {}", scene.len(), scene.sh_degree());
        return Ok(format!("{} are not {}", of(&a), of(&b)));
    }
    Ok(line(&a, &b))
}

fn main() -> ExitCode {
    let paths: Vec<std::path::PathBuf> = std::env::args_os().skip(1).map(Into::into).collect();
    if paths.len() != 2 {
        eprintln!("two scene files are needed");
        return ExitCode::from(2);
    }
    match compare(&paths) {
        Ok(line) => {
            println!("{line}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
