//! The API version and the extensions.
//!
//! The version is 1.3: every core command's name is there. It is not a claim of conformance
//! (`conformanceVersion` is 0.0.0.0): features that 1.3 requires and that don't work yet are reported as false and
//! refused by `vkCreateDevice`, and commands that don't work yet fail with a message. A lower version would hide
//! dynamic rendering and synchronization2, which do work, behind chains of extensions that don't.

use crate::error::Error;
use ash::vk;
use gaurast::gaussian_primitive_topology;
use std::ffi::CStr;
use std::sync::LazyLock;

/// The version of the instance and of its device.
pub(crate) const API_VERSION: u32 = vk::HEADER_VERSION_COMPLETE;

/// An extension's name and the version of its specification.
pub(crate) type Extension = (&'static CStr, u32);

/// The instance extensions.
pub(crate) const INSTANCE: &[Extension] = &[
    (
        ash::ext::debug_utils::NAME,
        ash::ext::debug_utils::SPEC_VERSION,
    ),
    (
        ash::khr::get_physical_device_properties2::NAME,
        ash::khr::get_physical_device_properties2::SPEC_VERSION,
    ),
];

/// The device extensions.
pub(crate) const DEVICE: &[Extension] = &[
    (
        gaussian_primitive_topology::NAME,
        gaussian_primitive_topology::SPEC_VERSION,
    ),
    (
        ash::khr::dynamic_rendering::NAME,
        ash::khr::dynamic_rendering::SPEC_VERSION,
    ),
    (
        ash::ext::index_type_uint8::NAME,
        ash::ext::index_type_uint8::SPEC_VERSION,
    ),
    (
        ash::khr::performance_query::NAME,
        ash::khr::performance_query::SPEC_VERSION,
    ),
    (
        ash::ext::provoking_vertex::NAME,
        ash::ext::provoking_vertex::SPEC_VERSION,
    ),
    (
        ash::khr::push_descriptor::NAME,
        ash::khr::push_descriptor::SPEC_VERSION,
    ),
    (
        ash::khr::synchronization2::NAME,
        ash::khr::synchronization2::SPEC_VERSION,
    ),
    (
        ash::ext::vertex_attribute_divisor::NAME,
        ash::ext::vertex_attribute_divisor::SPEC_VERSION,
    ),
];

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
