//! The views of camera files, the options of reading them, and errors.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use crate::camera::{Camera, DEFAULT_NEAR, Model};
use crate::crop::Crop;
use crate::distortion::Distortion;

/// The most pixels along an axis that a camera file may give.
const MAX_SIZE: f64 = 1e6;

/// The tolerance for a rotation's rows to be orthonormal.
const TOLERANCE: f64 = 1e-3;

/// A camera of a file.
#[derive(Clone, Debug)]
pub struct View {
    /// The photograph's name, or empty.
    pub name: String,
    /// The camera, with the photograph's size.
    pub camera: Camera,
}

/// The reason that a camera file could not be read. Displayed as one sentence: file, place, reason.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CameraFileError {
    /// The file cannot be opened or read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The file is not JSON, or not of this shape.
    #[error("{}: {source}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// The problem, with line and column.
        source: serde_json::Error,
    },
    /// The file is of none of the kinds.
    #[error(
        "{}: this is neither a cameras.json (a list) nor a transforms.json (with frames), a camera_path.json, a camera track \
         or COLMAP's",
        path.display()
    )]
    UnknownKind {
        /// The file.
        path: PathBuf,
    },
    /// A binary or text file of COLMAP is damaged.
    #[error("{}: {reason}", path.display())]
    Colmap {
        /// The file.
        path: PathBuf,
        /// The problem.
        reason: String,
    },
    /// A camera's numbers are invalid.
    #[error("{}: view {view}: {reason}", path.display())]
    View {
        /// The file.
        path: PathBuf,
        /// The camera's index in the file, from 0.
        view: usize,
        /// The problem.
        reason: ViewError,
    },
}

/// The problem of a camera in a file.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum ViewError {
    /// The image size is not positive and reasonable.
    #[error("the image size is not positive whole numbers of pixels")]
    Size,
    /// A focal length is absent or not positive.
    #[error("the focal length is missing, not positive, or beyond binary32")]
    Focal,
    /// A position or a principal point is not finite, or beyond binary32.
    #[error("a number is not finite, or beyond binary32")]
    NotFinite,
    /// The lens distorts in a way that is not drawn.
    #[error("the lens distorts ({0}), which is drawn only as an ideal lens would see it (--undistorted)")]
    Distorted(String),
    /// A coefficient of the lens is not one.
    #[error("a coefficient of the lens is beyond binary32, or not one of its model")]
    Coefficients,
    /// The numbers of a transforms.json's lens are too many or too few.
    #[error("distortion_params are the 12 numbers of a FISHEYE624, or 6 of another model")]
    Parameters,
    /// The rotation is not one.
    #[error("the rotation's rows are not perpendicular unit vectors")]
    Rotation,
    /// A model other than pinhole.
    #[error("camera model {0} is not read")]
    Model(String),
}

/// Options for facts that a camera file doesn't give.
#[derive(Clone, Debug)]
pub struct CameraFileOptions {
    /// The image size, for a transforms.json that doesn't give one and whose photographs are not there.
    pub size: [u32; 2],
    /// nerfstudio's dataparser_transforms.json of a trained model. It maps the cameras of a transforms.json to the
    /// model's world.
    pub dataparser: Option<PathBuf>,
    /// True to replace a lens that distorts by an ideal one.
    pub undistorted: bool,
}

/// The cameras of a file.
#[derive(Clone, Debug, Default)]
pub struct CameraFile {
    /// The cameras, in the file's order; COLMAP's in the order of their names.
    pub views: Vec<View>,
    /// The part of the scene that the file shows, if it does not show all of it.
    pub crop: Option<CroppedScene>,
    /// Parts of the file that are ignored, a sentence each.
    pub ignored: Vec<String>,
}

/// The part of a scene that a camera file shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CroppedScene {
    /// The box around it, in the coordinates of the cameras.
    pub crop: Crop,
    /// The background's red, green and blue, each 0 to 1.
    pub background: [f32; 3],
}

/// The distortion of a lens in a file.
pub(super) enum FileDistortion {
    /// One that is drawn.
    Drawn(Distortion),
    /// The coefficients of another one.
    Other(String),
}

impl FileDistortion {
    /// The distortion to draw with: none if it may be left out, which `ignored` is then told.
    pub(super) fn chosen(self, undistorted: bool, ignored: &mut Vec<String>) -> Result<Distortion, ViewError> {
        let coefficients = match self {
            Self::Drawn(distortion) if distortion.is_none() => return Ok(Distortion::default()),
            Self::Drawn(distortion) if !undistorted => {
                return if distortion.is_valid() { Ok(distortion) } else { Err(ViewError::Coefficients) };
            }
            Self::Other(coefficients) if !undistorted => return Err(ViewError::Distorted(coefficients)),
            Self::Drawn(distortion) => distortion.to_string(),
            Self::Other(coefficients) => coefficients,
        };
        let note = format!("the lens's distortion ({coefficients}) is left out");
        if !ignored.contains(&note) {
            ignored.push(note);
        }
        Ok(Distortion::default())
    }
}

/// The numbers of a camera, before they are checked.
pub(super) struct Numbers {
    pub(super) model: Model,
    /// World to camera.
    pub(super) rotation: [[f64; 3]; 3],
    pub(super) eye: [f64; 3],
    pub(super) focal: [f64; 2],
    pub(super) principal: [f64; 2],
    pub(super) distortion: Distortion,
    pub(super) size: [f64; 2],
}

impl Numbers {
    /// The camera.
    pub(super) fn camera(self) -> Result<Camera, ViewError> {
        let Self { model, rotation, eye, focal, principal, distortion, size } = self;
        if !size.iter().all(|s| (1.0..=MAX_SIZE).contains(s) && libm::trunc(*s) == *s) {
            return Err(ViewError::Size);
        }
        if !focal.iter().all(|f| (*f as f32) > 0.0 && (*f as f32).is_finite()) {
            return Err(ViewError::Focal);
        }
        let finite = eye.iter().all(|x| x.is_finite()) && principal.iter().all(|x| (*x as f32).is_finite());
        if !finite {
            return Err(ViewError::NotFinite);
        }
        let orthonormal = (0..3).all(|i| {
            (0..3).all(|j| {
                let dot: f64 = rotation[i].iter().zip(rotation[j]).map(|(a, b)| a * b).sum();
                (dot - f64::from(u8::from(i == j))).abs() <= TOLERANCE
            })
        });
        if !orthonormal {
            return Err(ViewError::Rotation);
        }
        Ok(Camera {
            model,
            rotation,
            eye,
            focal,
            principal,
            distortion,
            width: size[0] as u32,
            height: size[1] as u32,
            near: DEFAULT_NEAR,
            far: f64::INFINITY,
        })
    }
}
