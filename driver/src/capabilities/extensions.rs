//! The API version and the extensions.
//!
//! The version is 1.3: every core command's name is there. It is not a claim of conformance
//! (`conformanceVersion` is 0.0.0.0): features that 1.3 requires and that don't work yet are reported as false and
//! refused by `vkCreateDevice`, and commands that don't work yet fail with a message. A lower version would hide
//! dynamic rendering and synchronization2, which do work, behind chains of extensions that don't.

use crate::error::Error;
use crate::registry::extensions::{DEVICE, Extension};
use ash::vk;
use std::ffi::CStr;
use std::sync::LazyLock;

/// The version of the instance and of its device.
pub(crate) const API_VERSION: u32 = vk::HEADER_VERSION_COMPLETE;

/// The names of all device extensions.
pub(crate) fn device_names() -> &'static [&'static CStr] {
    static NAMES: LazyLock<Vec<&'static CStr>> =
        LazyLock::new(|| DEVICE.iter().map(|&(name, _)| name).collect());
    &NAMES
}

/// The requested extensions as the driver's own names.
///
/// # Errors
/// [`Error::ExtensionNotPresent`] for the first that isn't in `available`.
pub(crate) fn resolve(
    available: &[Extension],
    requested: &[&CStr],
) -> Result<Vec<&'static CStr>, Error> {
    requested
        .iter()
        .map(|&name| {
            available
                .iter()
                .map(|&(known, _)| known)
                .find(|&known| known == name)
                .ok_or_else(|| Error::ExtensionNotPresent(name.to_string_lossy().into_owned()))
        })
        .collect()
}

/// The extensions as Vulkan enumerates them.
pub(crate) fn properties(extensions: &[Extension]) -> Vec<vk::ExtensionProperties> {
    extensions
        .iter()
        .map(|&(name, spec_version)| {
            let mut properties = vk::ExtensionProperties::default().spec_version(spec_version);
            fill_string(&mut properties.extension_name, name);
            properties
        })
        .collect()
}

/// Writes a name into a fixed array of a Vulkan structure, cut off where it doesn't fit.
pub(crate) fn fill_string(array: &mut [std::ffi::c_char], text: &CStr) {
    let length = array.len().saturating_sub(1);
    for (place, &byte) in array.iter_mut().take(length).zip(text.to_bytes()) {
        *place = byte as std::ffi::c_char;
    }
}
