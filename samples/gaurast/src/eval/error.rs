//! Failures of an evaluation.

use std::path::PathBuf;

use gaurast_picture::{OutputError, ReadError};
use gaurast_scene::camera_files::CameraFileError;
use thiserror::Error;

use crate::cameras::ViewError;
use crate::drawing::DrawError;
use crate::sources::SourceError;

/// A failure of the evaluation. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum Error {
    #[error(transparent)]
    Source(#[from] SourceError),
    #[error(transparent)]
    CameraFile(#[from] CameraFileError),
    #[error(transparent)]
    View(#[from] ViewError),
    #[error(transparent)]
    Draw(#[from] DrawError),
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: std::io::Error },
    #[error("{}: {source}", path.display())]
    Json { path: PathBuf, source: serde_json::Error },
    #[error("{}: no file of a trainer says here where the photographs are: name their folder", model.display())]
    NoData { model: PathBuf },
    #[error("{}: the model's data were in {}, which is not there: name the folder", model.display(), data.display())]
    DataGone { model: PathBuf, data: PathBuf },
    #[error(
        "{}: there are no cameras: neither COLMAP's sparse/0 nor a transforms.json, and no cameras.json with the model",
        data.display()
    )]
    NoCameras { data: PathBuf },
    #[error("{}: there is no folder of photographs (--images)", folder.display())]
    NoPhotographs { folder: PathBuf },
    #[error("{}: {count} missing: {names}", folder.display())]
    MissingPhotographs { count: String, names: String, folder: PathBuf },
    #[error("{}: no camera is called {names}", cameras.display())]
    NoViews { names: String, cameras: PathBuf },
    #[error("no view is left of {count}: {split} (--split)")]
    Nothing { split: String, count: usize },
    #[error("{}: there is no mask for {name}", folder.display())]
    NoMask { name: String, folder: PathBuf },
    #[error("{}: {reason}", path.display())]
    Size { path: PathBuf, reason: String },
    #[error(
        "{}: {}x{} pixels are not the shape of its camera's picture, {}x{}",
        path.display(), size[0], size[1], of_camera[0], of_camera[1]
    )]
    Shape { path: PathBuf, size: [u32; 2], of_camera: [u32; 2] },
    #[error("{}: COLMAP has no points here, by which gsplat places the cameras", path.display())]
    NoPoints { path: PathBuf },
    #[error("{}: it is there already: --force measures again, --resume keeps it", path.display())]
    There { path: PathBuf },
    #[error("{}: it was measured with other choices: --force measures again", path.display())]
    OtherChoices { path: PathBuf },
    #[error("{0}")]
    Limit(String),
    #[error("{name}: the PSNR of {psnr:.2} dB is below {limit}")]
    Below { name: String, psnr: f64, limit: f64 },
    #[error("output: {0}")]
    Stdout(std::io::Error),
}

impl Error {
    /// Returns true if the command line is invalid.
    pub fn is_misuse(&self) -> bool {
        matches!(self, Self::View(error) if error.is_misuse())
    }
}
