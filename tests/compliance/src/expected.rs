//! The picture of a case by the oracle, and how far others may be from it.

use gaurast_oracle::oracle::{OracleCamera, OracleState, Reference, render_bounded};
use gaurast_oracle::scenes::SceneBuffers;
use gaurast_scene::{Camera, Scene, SceneError};
use thiserror::Error;

use crate::case::{Case, Freedom};

/// The error of a renderer in binary32 that is granted on top of what the text leaves open, on colours from 0 to 1.
const BINARY32: f64 = 1e-4;

/// The error that is granted where the text leaves nothing open: a quarter of a step of 8 bits.
const QUARTER_STEP: f64 = 0.001;

/// The least ratio of a misreading's difference to the tolerance.
const TELLING: f64 = 2.0;

/// The reason that a case has no picture.
#[derive(Debug, Error)]
pub enum ExpectedError {
    /// The file is not read.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The oracle lacks the camera's model.
    #[error("{0}: the oracle lacks the camera's model")]
    Camera(String),
    /// The picture depends on a comparison whose sides are equal but for rounding.
    #[error("{name}: {pixels} pixels depend on the rounding of a comparison")]
    Undecided {
        /// The case.
        name: String,
        /// Their number.
        pixels: usize,
    },
    /// The misreading is within the tolerance.
    #[error("{name}: {what} changes the picture by {difference:.4}, and the tolerance is {tolerance:.4}")]
    NotTold {
        /// The case.
        name: String,
        /// The misreading.
        what: &'static str,
        /// The greatest difference of a pixel.
        difference: f64,
        /// The tolerance.
        tolerance: f64,
    },
}

/// The picture of a case.
#[derive(Clone, Debug)]
pub struct Expected {
    /// (C, 1 - T) of every pixel in binary64.
    pub pixels: Vec<[f64; 4]>,
    /// The greatest difference of a picture of floats.
    pub tolerance: f64,
    /// The derivation of the tolerance.
    pub derivation: String,
    /// The difference of the misreading's picture, if the case has one.
    pub mistaken: Option<f64>,
}

impl Expected {
    /// Draws a case.
    ///
    /// # Errors
    /// If the case's file is not read, or its picture tells nothing.
    pub fn of(case: &Case) -> Result<Self, ExpectedError> {
        let scene = case.source.scene(&case.camera)?;
        let state = case.pipeline.state(scene.metadata().order, case.is_compensated);
        let reference = draw(case, &scene, &state)?;
        if !reference.alternatives.is_empty() {
            return Err(ExpectedError::Undecided { name: case.name.clone(), pixels: reference.alternatives.len() });
        }
        let pixels = reference.nominal;
        let apart =
            |state: &OracleState| Ok::<_, ExpectedError>(difference(&pixels, &draw(case, &scene, state)?.nominal));
        let (mut parts, mut open) = (Vec::new(), 0.0_f64);
        for freedom in &case.freedoms {
            let apart = apart(&freedom.taken(state))?;
            parts.push(format!("{} {apart:.4}", freedom.other()));
            open = open.max(apart);
        }
        if case.freedoms.len() > 1 {
            let together = case.freedoms.iter().fold(state, |state, freedom| Freedom::taken(*freedom, state));
            let apart = apart(&together)?;
            parts.push(format!("all of them {apart:.4}"));
            open = open.max(apart);
        }
        let (tolerance, derivation) = if parts.is_empty() {
            (QUARTER_STEP, "a quarter of a step of 255, for binary32".to_owned())
        } else {
            let list = parts.join(", ");
            (
                open + BINARY32,
                format!("the greatest change by what the text leaves open ({list}), and {BINARY32} for binary32"),
            )
        };
        // Rounded up to four digits.
        let tolerance = libm::ceil(tolerance * 1e4) / 1e4;
        let mut expected = Self { pixels, tolerance, derivation, mistaken: None };
        if let Some(mistake) = &case.mistake {
            let other = match &mistake.source {
                Some(source) => source.scene(&case.camera)?,
                None => scene,
            };
            let changed = mistake.change.map_or(state, |change| change(state));
            let difference = difference(&expected.pixels, &draw(case, &other, &changed)?.nominal);
            if difference < TELLING * tolerance {
                let (name, what) = (case.name.clone(), mistake.what);
                return Err(ExpectedError::NotTold { name, what, difference, tolerance });
            }
            expected.mistaken = Some(difference);
        }
        Ok(expected)
    }
}

fn draw(case: &Case, scene: &Scene, state: &OracleState) -> Result<Reference, ExpectedError> {
    let origin = scene.origin();
    let eye = std::array::from_fn(|axis| case.camera.eye[axis] - origin[axis]);
    let camera = Camera { eye, ..case.camera.clone() };
    let size = [camera.width, camera.height];
    let camera =
        OracleCamera::new(&camera.to_vulkan(), size).ok_or_else(|| ExpectedError::Camera(case.name.clone()))?;
    Ok(render_bounded(&SceneBuffers::from(scene).as_oracle(), &camera, state))
}

/// The greatest difference of a channel.
fn difference(a: &[[f64; 4]], b: &[[f64; 4]]) -> f64 {
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
