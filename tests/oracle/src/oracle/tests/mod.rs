//! The oracle against values worked out by hand.

mod binary32;
mod bounded;
mod meaning;
mod modes;
mod shaded;
mod skips;
mod undecidable;
mod unscented;

use super::{OracleCamera, OracleModel, OracleState, Reference, render_literal};
use crate::scenes::{Gaussian, SceneBuffers};

/// A 64 x 64 viewport whose principal point is the centre of pixel (32, 32), focal length 128.
fn camera() -> OracleCamera {
    OracleCamera {
        model: OracleModel::Pinhole,
        focal: [128.0; 2],
        principal: [32.5; 2],
        ..crate::scenes::camera(64, 64)
    }
}

/// The default state without the low-pass filter, so that covariances are round numbers.
fn unfiltered() -> OracleState {
    OracleState { low_pass: 0.0, ..OracleState::default() }
}

/// A sphere at depth 1 on the axis whose projection has a standard deviation of 2 px (4 px^2).
fn sphere() -> Gaussian {
    Gaussian {
        position: [0.0, 0.0, 1.0],
        scale: [1.0 / 64.0; 3],
        rotation: [1.0, 0.0, 0.0, 0.0],
        opacity: 0.5,
        sh: vec![[0.0; 3]],
    }
}

/// The coefficient of degree 0 that gives a colour component of `value`, nearly.
fn dc(value: f32) -> f32 {
    ((f64::from(value) - 0.5) / 0.28209479177387814) as f32
}

fn render(gaussians: &[Gaussian], camera: &OracleCamera, state: &OracleState) -> Reference {
    let degree = (gaussians[0].sh.len() as f64).sqrt() as u32 - 1;
    let scene = SceneBuffers::new(degree, gaussians.iter().cloned());
    render_literal(&scene.as_oracle(), camera, state)
}

/// The binary64 result at pixel (x, y).
fn at(reference: &Reference, x: u32, y: u32) -> [f64; 4] {
    reference.nominal[(y * reference.width + x) as usize]
}

#[track_caller]
fn assert_close(actual: [f64; 4], expected: [f64; 4], tolerance: f64) {
    for (a, e) in actual.iter().zip(expected) {
        assert!((a - e).abs() <= tolerance, "{actual:?} is not {expected:?}");
    }
}
