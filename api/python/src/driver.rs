//! The package's driver, and the Vulkan loader, which finds other drivers.

use std::ffi::{c_char, c_void};
use std::mem::transmute;
use std::path::Path;

use ash::vk;
use libloading::Library;
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;

/// The newest version of the interface between the loader and drivers that is used here.
const INTERFACE_VERSION: u32 = 5;

type Negotiate = unsafe extern "system" fn(*mut u32) -> vk::Result;

/// The driver in the library at `path` as an entry. The library stays loaded until the process ends.
///
/// # Errors
/// `OSError` if the library can't be loaded, or is no Vulkan driver.
pub fn entry(path: &Path) -> PyResult<ash::Entry> {
    let wrong = |error: libloading::Error| PyOSError::new_err(format!("{}: {error}", path.display()));
    // SAFETY: the library is the package's driver, whose initialisation runs no code but Rust's own.
    let library = unsafe { Library::new(path) }.map_err(wrong)?;
    // Functions and threads of the driver must stay where they are.
    let library: &'static Library = Box::leak(Box::new(library));
    // SAFETY: these are the names and types of the interface between the Vulkan loader and drivers.
    let (negotiate, get) = unsafe {
        let negotiate = library.get::<Negotiate>(b"vk_icdNegotiateLoaderICDInterfaceVersion\0").map_err(wrong)?;
        let get = library.get::<*const c_void>(b"vk_icdGetInstanceProcAddr\0").map_err(wrong)?;
        (*negotiate, *get)
    };
    let mut version = INTERFACE_VERSION;
    // SAFETY: the pointer is that of a version.
    let negotiated = unsafe { negotiate(&raw mut version) };
    if negotiated != vk::Result::SUCCESS {
        return Err(PyOSError::new_err(format!("{}: the driver refuses version {INTERFACE_VERSION}", path.display())));
    }
    type Get = unsafe extern "system" fn(vk::Instance, *const c_char) -> vk::PFN_vkVoidFunction;
    // SAFETY: the symbol is a function of this type.
    let get_instance_proc_addr = unsafe { transmute::<*const c_void, Get>(get) };
    // SAFETY: the function behaves as Vulkan specifies and stays loaded.
    Ok(unsafe { ash::Entry::from_static_fn(ash::StaticFn { get_instance_proc_addr }) })
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
