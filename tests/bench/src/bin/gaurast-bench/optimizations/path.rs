//! Paths of cameras, each suited to an optimization.

use gaurast_scene::camera::Camera;

use crate::error::BenchError;
use crate::pair::Draws;
use crate::worker::OPTIMIZATIONS;
use crate::workload::Workload;

/// The optimization that takes effect only while the camera stands still.
pub const TEMPORAL_REUSE: &str = "temporal-reuse";

/// The movement of a camera from frame to frame.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Path {
    /// The workload's path, whose steps are too large for results of the last frame to be reused.
    Own,
    Still,
    /// The workload's path, five times as far away.
    Afar,
}

impl Path {
    /// The path that shows an optimization.
    pub fn of(optimization: &str) -> Self {
        match optimization {
            TEMPORAL_REUSE => Self::Still,
            _ => Self::Own,
        }
    }

    /// The views of `frames` frames.
    pub fn views(self, workload: &Workload, frames: usize) -> Result<Vec<Camera>, BenchError> {
        let own = workload.views(&workload.scene()?, frames)?;
        let view = |frame: usize| {
            let goes_on = matches!(self, Self::Own | Self::Afar);
            let mut view = own[if goes_on { frame } else { 0 }].clone();
            if self == Self::Afar {
                view.eye = view.eye.map(|part| 5.0 * part);
            }
            view
        };
        Ok((0..frames).map(view).collect())
    }

    /// The way in which its views are drawn.
    pub fn draws(self) -> Draws {
        match self {
            Self::Own | Self::Afar => Draws::Again(DRAWS),
            Self::Still => Draws::Once,
        }
    }
}

/// The number of draws of a view, if drawing it again changes nothing.
pub const DRAWS: usize = 3;

/// The driver's settings with an optimization and without it. An optimization between frames is on only where it is the
/// one in question, because it would hide the savings of others.
pub fn settings(optimization: &str) -> [String; 2] {
    match Path::of(optimization) {
        Path::Own | Path::Afar => [OPTIMIZATIONS.to_owned(), format!("{OPTIMIZATIONS},-{optimization}")],
        Path::Still => [OPTIMIZATIONS.replace(&format!(",-{optimization}"), ""), OPTIMIZATIONS.to_owned()],
    }
}
