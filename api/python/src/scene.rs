//! Scenes as Python has them.

use std::path::PathBuf;
use std::sync::Arc;

use gaurast_scene::{GaussianShape, MAX_SH_DEGREE, Options, Scene};
use numpy::ndarray::ArrayView2;
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::of_scene;

/// A scene that does not change, so that arrays may look into it.
#[pyclass(frozen, module = "gaurast._gaurast")]
pub struct NativeScene(pub Arc<Scene>);

/// A read-only array of rows of `columns` numbers in the memory of the `bound` scene.
fn view<'py>(bound: &Bound<'py, NativeScene>, values: &[f32], columns: usize) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let rows = values.len() / columns;
    let view =
        ArrayView2::from_shape((rows, columns), values).map_err(|error| PyValueError::new_err(error.to_string()))?;
    // SAFETY: the scene owns the values, nothing changes it, and the array keeps it alive.
    let array = unsafe { PyArray2::borrow_from_array(&view, bound.clone().into_any()) };
    array.readwrite().make_nonwriteable();
    Ok(array)
}

#[pymethods]
impl NativeScene {
    fn __len__(&self) -> usize {
        self.0.len()
    }

    #[getter]
    fn sh_degree(&self) -> u32 {
        self.0.sh_degree()
    }

    #[getter]
    fn origin(&self) -> [f64; 3] {
        self.0.origin()
    }

    /// True if there are triangles among the Gaussians.
    #[getter]
    fn has_mesh(&self) -> bool {
        self.0.mesh() != &gaurast_scene::Mesh::default()
    }

    /// The metadata of the file as JSON.
    #[getter]
    fn metadata(&self) -> PyResult<String> {
        serde_json::to_string(self.0.metadata()).map_err(|error| PyValueError::new_err(error.to_string()))
    }

    /// Centres, `[N, 3]`.
    #[getter]
    fn positions<'py>(bound: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        view(bound, bytemuck::cast_slice(bound.get().0.positions()), 3)
    }

    /// Scales, rotations and opacities, `[N, 8]`.
    #[getter]
    fn shapes<'py>(bound: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        view(bound, bytemuck::cast_slice(bound.get().0.shapes()), 8)
    }

    /// Harmonics, `[N * K, 3]`.
    #[getter]
    fn harmonics<'py>(bound: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        view(bound, bytemuck::cast_slice(bound.get().0.sh()), 3)
    }
}

/// Reads a scene file.
#[pyfunction]
pub fn open(
    py: Python<'_>,
    path: PathBuf,
    axes: Option<&str>,
    points: Option<f64>,
    level: u32,
) -> PyResult<NativeScene> {
    let axes = match axes {
        Some(axes) => Some(axes.parse().map_err(PyValueError::new_err)?),
        None => None,
    };
    let options = Options { level, axes, points };
    let scene = py.detach(|| gaurast_scene::open_with(&path, &options, |file, _| file));
    Ok(NativeScene(Arc::new(scene.map_err(|error| of_scene(&error))?)))
}

/// The generated garden.
#[pyfunction]
pub fn garden(py: Python<'_>, seed: u64, count: usize) -> NativeScene {
    NativeScene(Arc::new(py.detach(|| gaurast_scene::garden::scene(seed, count))))
}

/// A scene of contiguous arrays: `[N, 3]`, `[N, 4]`, `[N, 3]`, `[N]` and `[N * K, 3]`, in the order of gsplat's arguments. Centres
/// are relative to `origin`.
#[pyfunction]
pub fn from_arrays(
    means: PyReadonlyArray2<'_, f32>,
    quats: PyReadonlyArray2<'_, f32>,
    scales: PyReadonlyArray2<'_, f32>,
    opacities: PyReadonlyArray1<'_, f32>,
    harmonics: PyReadonlyArray2<'_, f32>,
    sh_degree: u32,
    origin: [f64; 3],
) -> PyResult<NativeScene> {
    let means: &[[f32; 3]] = bytemuck::cast_slice(means.as_slice()?);
    let quats: &[[f32; 4]] = bytemuck::cast_slice(quats.as_slice()?);
    let scales: &[[f32; 3]] = bytemuck::cast_slice(scales.as_slice()?);
    let opacities = opacities.as_slice()?;
    let harmonics: &[[f32; 3]] = bytemuck::cast_slice(harmonics.as_slice()?);
    let count = means.len();
    if sh_degree > MAX_SH_DEGREE {
        return Err(PyValueError::new_err(format!("spherical harmonics degree {sh_degree} exceeds {MAX_SH_DEGREE}")));
    }
    let mut scene = Scene::with_capacity(sh_degree, count);
    scene.set_origin(origin);
    let stride = scene.sh_stride();
    if [quats.len(), scales.len(), opacities.len(), harmonics.len() / stride].iter().any(|len| *len != count) {
        return Err(PyValueError::new_err("the arrays are not of one length"));
    }
    for index in 0..count {
        let shape = GaussianShape { scale: scales[index], rotation: quats[index], opacity: opacities[index] };
        scene.push(means[index], shape, &harmonics[index * stride..][..stride]);
    }
    Ok(NativeScene(Arc::new(scene)))
}
