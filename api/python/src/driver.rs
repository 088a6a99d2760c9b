//! The package's driver, and the Vulkan loader, which finds other drivers.

use std::path::Path;

use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;

/// The driver in the library at `path` as an entry. The library stays loaded until the process ends.
///
/// # Errors
/// `OSError` if the library can't be loaded, or is no Vulkan driver.
pub fn entry(path: &Path) -> PyResult<ash::Entry> {
    // SAFETY: the library is the package's driver.
    unsafe { gaurast_render::load_driver(path) }.map_err(|error| PyOSError::new_err(error.to_string()))
}

/// The entry of the Vulkan loader in the library at `path`. Its devices draw Gaussians by compute kernels where they lack the
/// extension.
///
/// # Errors
/// `OSError` if the library can't be loaded.
pub fn loader_entry(path: &Path) -> PyResult<ash::Entry> {
    // SAFETY: the library is the Vulkan loader.
    let loader = unsafe { ash::Entry::load_from(path) };
    let loader = loader.map_err(|error| PyOSError::new_err(format!("{}: {error}", path.display())))?;
    Ok(gaurast_emulation::entry(loader))
}
