//! The driver's part of the interface between the Vulkan loader and a driver, which `driver/icd` exports.

use crate::abi::error::Error;
use crate::abi::guard::guard;
use crate::abi::{handle, valid};
use crate::dispatch;
pub use crate::options::log_filter;
use ash::vk;
use std::ffi::c_char;

/// The newest version of the loader's interface that the driver knows.
const NEWEST_INTERFACE: u32 = 7;

/// The oldest version that the driver accepts: from 3 on, surfaces are the driver's own objects.
const OLDEST_INTERFACE: u32 = 3;

/// Agrees with the loader on a version of their interface.
///
/// # Safety
/// `version` points at the newest version that the loader knows.
pub unsafe fn negotiate_interface_version(version: *mut u32) -> vk::Result {
    guard(version, "vk_icdNegotiateLoaderICDInterfaceVersion", || {
        // SAFETY: the caller's promise.
        let version = unsafe { valid::output_structure(version)? };
        *version = NEWEST_INTERFACE.min(*version);
        Ok(if *version < OLDEST_INTERFACE { vk::Result::ERROR_INCOMPATIBLE_DRIVER } else { vk::Result::SUCCESS })
    })
}

/// `vkGetInstanceProcAddr`.
///
/// # Safety
/// `instance` is null or valid, and `name` is a string.
pub unsafe fn get_instance_proc_addr(instance: vk::Instance, name: *const c_char) -> vk::PFN_vkVoidFunction {
    // SAFETY: the caller's promise.
    unsafe { dispatch::vkGetInstanceProcAddr(instance, name) }
}

/// Finds commands whose first parameter is a physical device.
///
/// # Safety
/// `instance` is valid, and `name` is a string.
pub unsafe fn get_physical_device_proc_addr(instance: vk::Instance, name: *const c_char) -> vk::PFN_vkVoidFunction {
    guard(instance, "vk_icdGetPhysicalDeviceProcAddr", || {
        // SAFETY: the caller's promise.
        let (instance, name) = unsafe { (handle::get(instance)?, valid::string(name)) };
        let name = name.ok_or(Error::NullPointer { what: "name" })?;
        Ok(dispatch::physical_device_command(name, &instance.enabled_extensions()))
    })
}
