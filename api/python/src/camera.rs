//! Cameras as Python has them.

use std::path::PathBuf;

use gaurast_scene::camera::Model;
use gaurast_scene::camera_files::{self, CameraFileOptions};
use gaurast_scene::{Camera, Distortion, DistortionModel};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::of_camera_file;
use crate::scene::NativeScene;

/// The distortion of a lens, with the attributes of Python's `gaurast.Distortion`.
#[derive(Debug, FromPyObject, IntoPyObject)]
struct PyDistortion {
    model: String,
    radial: [f64; 6],
    tangential: [f64; 2],
    thin_prism: [f64; 4],
}

const DISTORTION_MODELS: [(&str, DistortionModel); 5] = [
    ("rational", DistortionModel::Rational),
    ("polynomial", DistortionModel::Polynomial),
    ("polynomial_first", DistortionModel::PolynomialFirst),
    ("field_of_view", DistortionModel::FieldOfView),
    ("division", DistortionModel::Division),
];

/// The value that a list has under `name`, or an error that says which names there are.
fn named<T: Copy>(list: &[(&str, T)], name: &str, kind: &str) -> PyResult<T> {
    let known = list.iter().find(|(known, _)| *known == name);
    known.map(|(_, value)| *value).ok_or_else(|| {
        let names: Vec<&str> = list.iter().map(|(known, _)| *known).collect();
        PyValueError::new_err(format!("{name:?} is not a {kind}: {}", names.join(", ")))
    })
}

impl PyDistortion {
    /// None of an ideal lens.
    fn new(distortion: &Distortion) -> Option<Self> {
        let Distortion { model, radial, tangential, thin_prism } = *distortion;
        let name = DISTORTION_MODELS.iter().find(|(_, known)| *known == model).map_or("", |(name, _)| *name);
        (!distortion.is_none()).then(|| Self { model: name.to_owned(), radial, tangential, thin_prism })
    }

    fn to_distortion(&self) -> PyResult<Distortion> {
        let Self { model, radial, tangential, thin_prism } = self;
        Ok(Distortion {
            model: named(&DISTORTION_MODELS, model, "model of distortion")?,
            radial: *radial,
            tangential: *tangential,
            thin_prism: *thin_prism,
        })
    }
}

/// A camera with the attributes of Python's `gaurast.Camera`.
#[derive(Debug, FromPyObject, IntoPyObject)]
pub struct PyCamera {
    model: String,
    rotation: [[f64; 3]; 3],
    eye: [f64; 3],
    focal: [f64; 2],
    principal: [f64; 2],
    distortion: Option<PyDistortion>,
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
        let distortion = PyDistortion::new(&camera.distortion);
        Self { model: model.to_owned(), rotation, eye, focal, principal, distortion, width, height, near, far, name }
    }

    /// The camera, for drawing.
    pub fn to_camera(&self) -> PyResult<Camera> {
        let Self { model, rotation, eye, focal, principal, distortion, width, height, near, far, .. } = self;
        Ok(Camera {
            model: named(&MODELS, model, "camera model")?,
            rotation: *rotation,
            eye: *eye,
            focal: *focal,
            principal: *principal,
            distortion: distortion.as_ref().map(PyDistortion::to_distortion).transpose()?.unwrap_or_default(),
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
