//! Cameras as Python has them.

use std::path::PathBuf;

use gaurast_scene::Camera;
use gaurast_scene::camera::Model;
use gaurast_scene::camera_files::{self, CameraFileOptions};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::of_camera_file;
use crate::scene::NativeScene;

/// A camera with the attributes of Python's `gaurast.Camera`.
#[derive(Debug, FromPyObject, IntoPyObject)]
pub struct PyCamera {
    model: String,
    rotation: [[f64; 3]; 3],
    eye: [f64; 3],
    focal: [f64; 2],
    principal: [f64; 2],
    width: u32,
    height: u32,
    near: f64,
    far: f64,
    name: String,
}

const MODELS: [(&str, Model); 4] = [
    ("pinhole", Model::Pinhole),
    ("fisheye", Model::Fisheye),
    ("equirectangular", Model::Equirectangular),
    ("orthographic", Model::Orthographic),
];

impl PyCamera {
    fn new(camera: &Camera, name: String) -> Self {
        let model = MODELS.iter().find(|(_, model)| *model == camera.model).map_or("", |(name, _)| *name);
        let Camera { rotation, eye, focal, principal, width, height, near, far, .. } = *camera;
        Self { model: model.to_owned(), rotation, eye, focal, principal, width, height, near, far, name }
    }

    /// The camera, for drawing.
    pub fn to_camera(&self) -> PyResult<Camera> {
        let Self { model, rotation, eye, focal, principal, width, height, near, far, .. } = self;
        let known = MODELS.iter().find(|(name, _)| name == model).ok_or_else(|| {
            PyValueError::new_err(format!(
                "{model:?} is not a camera model: {}",
                MODELS.map(|(name, _)| name).join(", ")
            ))
        })?;
        Ok(Camera {
            model: known.1,
            rotation: *rotation,
            eye: *eye,
            focal: *focal,
            principal: *principal,
            width: *width,
            height: *height,
            near: *near,
            far: *far,
        })
    }
}

/// The cameras of a file or of COLMAP's folder, and a sentence for each part of it that is ignored.
#[pyfunction]
pub fn read_cameras(
    path: PathBuf,
    size: [u32; 2],
    dataparser: Option<PathBuf>,
    undistorted: bool,
) -> PyResult<(Vec<PyCamera>, Vec<String>)> {
    let options = CameraFileOptions { size, dataparser, undistorted };
    let file = camera_files::read(&path, &options).map_err(|error| of_camera_file(&error))?;
    let views = file.views.into_iter();
    Ok((views.map(|view| PyCamera::new(&view.camera, view.name)).collect(), file.ignored))
}

/// A camera that has the scene in its picture.
#[pyfunction]
pub fn frame(py: Python<'_>, scene: &NativeScene, size: [u32; 2], fov: f64) -> PyCamera {
    let camera = py.detach(|| gaurast_scene::frame(&scene.0, fov, size));
    PyCamera::new(&camera, String::new())
}

/// A camera at `eye` that looks at `target`.
#[pyfunction]
pub fn look_at(eye: [f64; 3], target: [f64; 3], up: [f64; 3], fov: f64, size: [u32; 2]) -> PyResult<PyCamera> {
    let camera = Camera::look_at(eye, target, up, fov, size);
    let camera = camera.map_err(|error| PyValueError::new_err(error.to_string()))?;
    Ok(PyCamera::new(&camera, String::new()))
}
