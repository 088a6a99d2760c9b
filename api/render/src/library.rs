//! Vulkan drivers that are loaded by name, without the Vulkan loader.

use std::ffi::{c_char, c_void};
use std::mem::transmute;
use std::path::{Path, PathBuf};

use ash::vk;
use libloading::Library;
use thiserror::Error;

/// The newest version of the interface between the loader and drivers that is used here.
const INTERFACE_VERSION: u32 = 5;

/// The reason that a driver cannot be loaded. Displayed as one sentence.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DriverError {
    /// The file is no library that can be loaded, or lacks a symbol of a driver.
    #[error("{}: {source}", path.display())]
    Library {
        /// The library.
        path: PathBuf,
        /// The reason.
        source: libloading::Error,
    },
    /// The driver is older than the interface.
    #[error("{}: the driver refuses version {INTERFACE_VERSION} of the loader's interface", path.display())]
    Interface {
        /// The library.
        path: PathBuf,
    },
}

type Negotiate = unsafe extern "system" fn(*mut u32) -> vk::Result;

/// The driver in the library at `path` as an entry. The library stays loaded until the process ends.
///
/// # Safety
/// The library is a Vulkan driver.
///
/// # Errors
/// If the library cannot be loaded, or is no Vulkan driver.
pub unsafe fn load_driver(path: &Path) -> Result<ash::Entry, DriverError> {
    let wrong = |source| DriverError::Library { path: path.to_owned(), source };
    // SAFETY: the caller's promise.
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
    if unsafe { negotiate(&raw mut version) } != vk::Result::SUCCESS {
        return Err(DriverError::Interface { path: path.to_owned() });
    }
    type Get = unsafe extern "system" fn(vk::Instance, *const c_char) -> vk::PFN_vkVoidFunction;
    // SAFETY: the symbol is a function of this type.
    let get_instance_proc_addr = unsafe { transmute::<*const c_void, Get>(get) };
    // SAFETY: the function behaves as Vulkan specifies and stays loaded.
    Ok(unsafe { ash::Entry::from_static_fn(ash::StaticFn { get_instance_proc_addr }) })
}
