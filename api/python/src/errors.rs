//! Errors as Python's exceptions.

use std::io;
use std::path::Path;

use gaurast_render::RenderError;
use gaurast_scene::SceneError;
use gaurast_scene::camera_files::CameraFileError;
use pyo3::PyErr;
use pyo3::exceptions::{PyIsADirectoryError, PyMemoryError, PyOSError, PyRuntimeError, PyValueError};

/// The `OSError` of a file, such as `FileNotFoundError`.
fn of_io(path: &Path, source: &io::Error, sentence: String) -> PyErr {
    match source.raw_os_error() {
        Some(code) => PyOSError::new_err((code, source.to_string(), path.display().to_string())),
        None if source.kind() == io::ErrorKind::IsADirectory => PyIsADirectoryError::new_err(sentence),
        None => PyOSError::new_err(sentence),
    }
}

/// `OSError`, or `ValueError` with the file, the place and the reason.
pub fn of_scene(error: &SceneError) -> PyErr {
    match error {
        SceneError::Io { path, source } => of_io(path, source, error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// `OSError`, or `ValueError` with the file, the view and the reason.
pub fn of_camera_file(error: &CameraFileError) -> PyErr {
    match error {
        CameraFileError::Io { path, source } => of_io(path, source, error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// `ValueError` for arguments, `MemoryError` for a lack of memory, and `RuntimeError` if Vulkan fails.
pub fn of_render(error: &RenderError) -> PyErr {
    use ash::vk::Result as Code;
    let sentence = error.to_string();
    match error {
        RenderError::Vulkan { result: Code::ERROR_OUT_OF_HOST_MEMORY | Code::ERROR_OUT_OF_DEVICE_MEMORY, .. } => {
            PyMemoryError::new_err(sentence)
        }
        RenderError::Vulkan { .. } | RenderError::NoDevice { .. } | RenderError::NoMemory(_) => {
            PyRuntimeError::new_err(sentence)
        }
        _ => PyValueError::new_err(sentence),
    }
}
