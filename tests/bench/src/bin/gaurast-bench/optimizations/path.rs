//! Paths of cameras, and the optimizations that they show.

use gaurast_scene::camera::Camera;

use crate::error::BenchError;
use crate::pair::Draws;
use crate::worker::OPTIMIZATIONS;
use crate::workload::Workload;

/// What only a still camera shows.
pub const TEMPORAL_REUSE: &str = "temporal-reuse";

/// How a camera goes from frame to frame.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Path {
    /// As the workload says, which is far enough for nothing of the last frame to help.
    Own,
    Still,
    /// The workload's, five times as far away.
    Afar,
}

impl Path {
    /// The one that shows an optimization.
    pub fn of(optimization: &str) -> Self {
        match optimization {
            TEMPORAL_REUSE => Self::Still,
            _ => Self::Own,
        }
    }

    /// The views of so many frames.
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

    /// How its views are drawn.
    pub fn draws(self) -> Draws {
        match self {
            Self::Own | Self::Afar => Draws::Again(DRAWS),
            Self::Still => Draws::Once,
        }
    }
}

/// How often a view is drawn, if that changes nothing.
pub const DRAWS: usize = 3;

/// What the driver leaves out with an optimization and without it. What saves from frame to frame is on alone, where that is asked
/// for: it would hide what others save.
pub fn settings(optimization: &str) -> [String; 2] {
    match Path::of(optimization) {
        Path::Own | Path::Afar => [
            OPTIMIZATIONS.to_owned(),
            format!("{OPTIMIZATIONS},-{optimization}"),
        ],
        Path::Still => [
            OPTIMIZATIONS.replace(&format!(",-{optimization}"), ""),
            OPTIMIZATIONS.to_owned(),
        ],
    }
}
