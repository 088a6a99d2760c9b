//! A device, which draws for one thread at a time.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use gaurast_render::{Arrays, Colors, DeviceOptions, DeviceScene, Frame, RenderError, Renderer, Settings};
use gaurast_scene::{Camera, Scene};
use numpy::ndarray::Array3;
use numpy::{Element, IntoPyArray, PyArray3, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::camera::PyCamera;
use crate::driver;
use crate::errors::of_render;
use crate::scene::NativeScene;

/// A device with the scene that it drew last.
#[pyclass(frozen, module = "gaurast._gaurast")]
pub struct Device {
    name: String,
    state: Mutex<State>,
}

struct State {
    renderer: Renderer,
    /// The scene that was drawn last, and its copy on the device.
    uploaded: Option<(Weak<Scene>, DeviceScene)>,
    /// The arrays that were drawn last, whose memory is used again.
    arrays: Option<DeviceScene>,
}

impl State {
    /// Draws a scene from each camera.
    fn draw_scene(
        &mut self,
        scene: &Arc<Scene>,
        cameras: &[Camera],
        settings: Settings,
    ) -> Result<Vec<Frame>, RenderError> {
        let kept = self.uploaded.take();
        let kept = kept.filter(|(of, _)| of.upgrade().is_some_and(|of| Arc::ptr_eq(&of, scene)));
        let mut uploaded = match kept {
            Some((_, uploaded)) => uploaded,
            None => self.renderer.upload(scene, None)?,
        };
        self.renderer.set(&mut uploaded, settings)?;
        let (_, uploaded) = self.uploaded.insert((Arc::downgrade(scene), uploaded));
        cameras.iter().map(|camera| self.renderer.render(uploaded, camera)).collect()
    }

    /// Draws arrays from each camera.
    fn draw_arrays(
        &mut self,
        arrays: &Arrays<'_>,
        cameras: &[Camera],
        settings: Settings,
    ) -> Result<Vec<Frame>, RenderError> {
        let used = self.arrays.take();
        let scene = self.renderer.upload_arrays(arrays, settings, used)?;
        let frames = cameras.iter().map(|camera| self.renderer.render(&scene, camera)).collect();
        self.arrays = Some(scene);
        frames
    }
}

fn settings_of(json: &str) -> PyResult<Settings> {
    serde_json::from_str(json).map_err(|error| PyValueError::new_err(format!("settings: {error}")))
}

/// Checks that the settings go together and with each camera, before the driver says so in its own words.
fn check(settings: Settings, cameras: &[Camera]) -> PyResult<()> {
    cameras.iter().try_for_each(|camera| settings.check(camera)).map_err(|error| of_render(&error))
}

fn cameras_of(cameras: &[PyCamera]) -> PyResult<Vec<Camera>> {
    cameras.iter().map(PyCamera::to_camera).collect()
}

/// A frame as arrays of `[H, W, 4]` colours, `[H, W, 2]` depths and `[H, W, 2]` numbers of Gaussians.
type FrameArrays<'py> =
    (Bound<'py, PyArray3<f32>>, Option<Bound<'py, PyArray3<f32>>>, Option<Bound<'py, PyArray3<u32>>>);

fn to_arrays(py: Python<'_>, frame: Frame) -> PyResult<FrameArrays<'_>> {
    let size = [frame.picture.height as usize, frame.picture.width as usize];
    let colors = to_array(py, size, frame.picture.pixels)?;
    let depths = frame.depth.map(|depths| to_array(py, size, depths)).transpose()?;
    let gaussians = frame.gaussians.map(|gaussians| to_array(py, size, gaussians)).transpose()?;
    Ok((colors, depths, gaussians))
}

/// An array `[H, W, N]` of pixels of `N` numbers each.
fn to_array<T: Element, const N: usize>(
    py: Python<'_>,
    [height, width]: [usize; 2],
    pixels: Vec<[T; N]>,
) -> PyResult<Bound<'_, PyArray3<T>>> {
    let array = Array3::from_shape_vec((height, width, N), pixels.into_flattened());
    Ok(array.map_err(|error| PyValueError::new_err(error.to_string()))?.into_pyarray(py))
}

impl Device {
    fn with_options(py: Python<'_>, entry: ash::Entry, options: &DeviceOptions) -> PyResult<Self> {
        let renderer = py.detach(|| Renderer::with_options(entry, options)).map_err(|error| of_render(&error))?;
        let name = renderer.device_name().to_owned();
        Ok(Self { name, state: Mutex::new(State { renderer, uploaded: None, arrays: None }) })
    }
}

/// The names of the devices that draw Gaussians, of those that the Vulkan loader in the library at `loader` finds.
#[pyfunction]
pub fn device_names(py: Python<'_>, loader: PathBuf) -> PyResult<Vec<String>> {
    let entry = driver::loader_entry(&loader)?;
    py.detach(|| gaurast_render::device_names(entry)).map_err(|error| of_render(&error))
}

#[pymethods]
impl Device {
    /// A device of the driver in the library at `driver`, with `threads` threads; 0 is one for each processor.
    #[new]
    fn new(py: Python<'_>, driver: PathBuf, threads: u32) -> PyResult<Self> {
        let options = DeviceOptions { threads, ..DeviceOptions::default() };
        Self::with_options(py, driver::entry(&driver)?, &options)
    }

    /// The first device with `name` in its name, of those that the Vulkan loader in the library at `loader` finds.
    #[staticmethod]
    fn named(py: Python<'_>, loader: PathBuf, name: String) -> PyResult<Self> {
        let options = DeviceOptions { device: name, ..DeviceOptions::default() };
        Self::with_options(py, driver::loader_entry(&loader)?, &options)
    }

    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// Draws `scene` from each of `cameras`, with `settings` as JSON.
    fn render<'py>(
        &self,
        py: Python<'py>,
        scene: &NativeScene,
        cameras: Vec<PyCamera>,
        settings: &str,
    ) -> PyResult<Vec<FrameArrays<'py>>> {
        let (cameras, settings) = (cameras_of(&cameras)?, settings_of(settings)?);
        check(settings, &cameras)?;
        let frames = py.detach(|| {
            let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            state.draw_scene(&scene.0, &cameras, settings)
        });
        frames.map_err(|error| of_render(&error))?.into_iter().map(|frame| to_arrays(py, frame)).collect()
    }

    /// Draws contiguous arrays from each of `cameras`. `colors` is `[N, K, 3]` harmonics of `sh_degree`; without one it is
    /// `[N, 1, D]`, of which three channels from `first` on are drawn, less `low`.
    #[allow(clippy::too_many_arguments, reason = "they are gsplat's")]
    fn rasterize<'py>(
        &self,
        py: Python<'py>,
        means: PyReadonlyArray2<'py, f32>,
        quats: PyReadonlyArray2<'py, f32>,
        scales: PyReadonlyArray2<'py, f32>,
        opacities: PyReadonlyArray1<'py, f32>,
        colors: PyReadonlyArray3<'py, f32>,
        sh_degree: Option<u32>,
        first: usize,
        low: [f32; 3],
        cameras: Vec<PyCamera>,
        settings: &str,
    ) -> PyResult<Vec<FrameArrays<'py>>> {
        let (cameras, settings) = (cameras_of(&cameras)?, settings_of(settings)?);
        check(settings, &cameras)?;
        let [_, coefficients, channels] = colors.as_array().dim().into();
        let values = colors.as_slice()?;
        let arrays = Arrays {
            positions: bytemuck::cast_slice(means.as_slice()?),
            scales: bytemuck::cast_slice(scales.as_slice()?),
            rotations: bytemuck::cast_slice(quats.as_slice()?),
            opacities: opacities.as_slice()?,
            colors: match sh_degree {
                Some(degree) => {
                    Colors::Harmonics { degree, stride: coefficients, coefficients: bytemuck::cast_slice(values) }
                }
                None => Colors::Channels { stride: channels, first, low, values },
            },
        };
        let frames = py.detach(|| {
            let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            state.draw_arrays(&arrays, &cameras, settings)
        });
        frames.map_err(|error| of_render(&error))?.into_iter().map(|frame| to_arrays(py, frame)).collect()
    }
}
