//! Errors of the benchmarks.

use std::path::PathBuf;

use gaurast_bench::quads::QuadError;
use gaurast_render::RenderError;
use gaurast_scene::SceneError;
use gaurast_scene::{camera::CameraError, camera_files::CameraFileError};
use thiserror::Error;

use crate::callgrind::CallgrindError;
use crate::exact::ExactError;

/// A failure of a benchmark. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum BenchError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    CameraFile(#[from] CameraFileError),
    #[error(transparent)]
    Camera(#[from] CameraError),
    #[error("{}: there is no camera", .0.display())]
    NoCamera(PathBuf),
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error(transparent)]
    Quads(#[from] QuadError),
    #[error("{0}")]
    Counts(String),
    #[error(transparent)]
    Exact(#[from] ExactError),
    #[error(transparent)]
    Callgrind(#[from] CallgrindError),
    #[error("the driver refused a command: {0}")]
    Refused(#[from] ash::vk::Result),
    #[error("a worker failed: {0}")]
    Worker(String),
    #[error("a worker could not be spoken to: {0}")]
    Io(#[from] std::io::Error),
    #[error("a worker was not understood: {0}")]
    Json(#[from] serde_json::Error),
    #[error("--only: no setting is called \"{0}\"")]
    NoSuchSetting(String),
    #[error("the picture has no camera that the oracle knows")]
    NoOracle,
    #[error("the plot could not be drawn: {0}")]
    Plot(String),
    #[error("the plot could not be written: {0}")]
    Image(#[from] image::ImageError),
}
