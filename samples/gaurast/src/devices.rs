//! This driver, and devices of other drivers, which the Vulkan loader finds.

use std::io::Write;

use gaurast_render::RenderError;
use thiserror::Error;

use crate::args::ModeArguments;

/// The value of `--device` that asks for the names.
const LIST: &str = "list";

/// A failure with other devices. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum DeviceError {
    #[error("--device needs the Vulkan loader: {0}")]
    Loader(#[from] ash::LoadingError),
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error("output: {0}")]
    Output(#[from] std::io::Error),
    #[cfg(not(feature = "driver"))]
    #[error(transparent)]
    Installation(#[from] crate::icd::IcdError),
    #[cfg(not(feature = "driver"))]
    #[error(transparent)]
    Driver(#[from] gaurast_render::DriverError),
}

/// This driver's entry.
#[cfg(feature = "driver")]
#[expect(clippy::unnecessary_wraps, reason = "a driver that is loaded can be missing")]
pub fn own_driver() -> Result<ash::Entry, DeviceError> {
    Ok(vulkan_gaurast::entry())
}

/// The entry of the driver that is installed with the command.
///
/// # Errors
/// If it is not there, or cannot be loaded.
#[cfg(not(feature = "driver"))]
pub fn own_driver() -> Result<ash::Entry, DeviceError> {
    let library = crate::icd::library()?;
    // SAFETY: the library is the driver that was built with this command.
    Ok(unsafe { gaurast_render::load_driver(&library)? })
}

/// The loader's entry, whose devices draw Gaussians by compute kernels where they lack the extension.
///
/// # Errors
/// If there is no loader.
pub fn entry() -> Result<ash::Entry, DeviceError> {
    // SAFETY: the library is the system's Vulkan loader.
    let loader = unsafe { ash::Entry::load()? };
    Ok(gaurast_emulation::entry(loader))
}

/// Prints the names of devices, if the command line asks for them; returns true if it does.
///
/// # Errors
/// If there is no loader, Vulkan fails, or nothing can be printed.
pub fn list(modes: &ModeArguments) -> Result<bool, DeviceError> {
    if modes.device.as_deref() != Some(LIST) {
        return Ok(false);
    }
    let lines: String = gaurast_render::device_names(entry()?)?.iter().map(|name| format!("{name}\n")).collect();
    std::io::stdout().write_all(lines.as_bytes())?;
    Ok(true)
}
