//! The driver's half of the interface between the Vulkan loader and a driver, which `driver/icd` exports.

use crate::dispatch;
use crate::entry_points;
use crate::entrypoints::instance;
use crate::error::Error;
use crate::{handle, pointer};
use ash::vk;
use std::ffi::c_char;

/// The newest version of the loader's interface that the driver knows.
const NEWEST_INTERFACE: u32 = 7;

/// The oldest that it accepts: from 2 on, versions are negotiated.
const OLDEST_INTERFACE: u32 = 2;

/// Agrees with the loader on a version of their interface.
///
/// # Safety
/// `version` points at the newest version that the loader knows.
pub unsafe fn negotiate_interface_version(version: *mut u32) -> vk::Result {
    // SAFETY: the caller's promise.
    unsafe { negotiate_loader_icd_interface_version(version) }
}

/// `vkGetInstanceProcAddr`.
///
/// # Safety
/// `instance` is null or valid, and `name` is a string.
pub unsafe fn get_instance_proc_addr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the caller's promise.
    unsafe { instance::get_instance_proc_addr(instance, name) }
}

/// Finds commands whose first parameter is a physical device.
///
/// # Safety
/// `instance` is valid, and `name` is a string.
pub unsafe fn get_physical_device_proc_addr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the caller's promise.
    unsafe { physical_device_proc_addr(instance, name) }
}

entry_points! {
    fn negotiate_loader_icd_interface_version(version: *mut u32) -> vk::Result {
        let version = pointer::output_structure(version)?;
        *version = NEWEST_INTERFACE.min(*version);
        Ok(if *version < OLDEST_INTERFACE {
            vk::Result::ERROR_INCOMPATIBLE_DRIVER
        } else {
            vk::Result::SUCCESS
        })
    }

    fn physical_device_proc_addr(
        instance: vk::Instance,
        name: *const c_char,
    ) -> vk::PFN_vkVoidFunction {
        let name = pointer::string(name).ok_or(Error::NullPointer { what: "name" })?;
        let instance = handle::get(instance)?;
        Ok(dispatch::physical_device_command(name, &instance.enabled()))
    }
}
