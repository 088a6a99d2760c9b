//! The loader's door: the three symbols that `libvulkan_gaurast.so` exports for the Vulkan loader.
//!
//! See the loader's "Architecture of the Vulkan Loader Interfaces" for what each must do.

use crate::dispatch;
use crate::entry_points;
use crate::entrypoints::instance::get_instance_proc_addr;
use crate::error::Error;
use crate::{handle, pointer};
use ash::vk;
use std::ffi::{CStr, c_char};
use std::mem::transmute;

/// The newest version of the loader's interface that the driver knows.
const NEWEST_INTERFACE: u32 = 7;

/// The oldest that it accepts: from 2 on, versions are negotiated.
const OLDEST_INTERFACE: u32 = 2;

/// Agrees with the loader on a version of their interface.
///
/// # Safety
/// `version` points at the newest version that the loader knows.
#[unsafe(no_mangle)]
#[allow(non_snake_case, reason = "the loader's name")]
pub unsafe extern "system" fn vk_icdNegotiateLoaderICDInterfaceVersion(
    version: *mut u32,
) -> vk::Result {
    // The loader's process has no other logger; if it does have one, that one stays.
    let environment = env_logger::Env::new().filter_or("GAURAST_LOG", "warn");
    let _ = env_logger::Builder::from_env(environment).try_init();
    // SAFETY: the caller's promise.
    unsafe { negotiate_loader_icd_interface_version(version) }
}

/// `vkGetInstanceProcAddr` for the loader, which also finds the functions of this interface.
///
/// # Safety
/// `instance` is null or valid, and `name` is a string.
#[unsafe(no_mangle)]
#[allow(non_snake_case, reason = "the loader's name")]
pub unsafe extern "system" fn vk_icdGetInstanceProcAddr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the caller's promise.
    let interface = unsafe { pointer::string(name) }.and_then(interface_function);
    // SAFETY: the caller's promise.
    interface.or_else(|| unsafe { get_instance_proc_addr(instance, name) })
}

/// Finds commands whose first parameter is a physical device, so that the loader passes on those that it doesn't know.
///
/// # Safety
/// `instance` is valid, and `name` is a string.
#[unsafe(no_mangle)]
#[allow(non_snake_case, reason = "the loader's name")]
pub unsafe extern "system" fn vk_icdGetPhysicalDeviceProcAddr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the caller's promise.
    unsafe { get_physical_device_proc_addr(instance, name) }
}

/// The functions of this interface by name; since version 7 they may be looked up instead of being exported.
fn interface_function(name: &CStr) -> vk::PFN_vkVoidFunction {
    type Negotiate = unsafe extern "system" fn(*mut u32) -> vk::Result;
    type GetProcAddr = vk::PFN_vkGetInstanceProcAddr;
    let (negotiate, get_physical): (Negotiate, GetProcAddr) = (
        vk_icdNegotiateLoaderICDInterfaceVersion,
        vk_icdGetPhysicalDeviceProcAddr,
    );
    // SAFETY: function pointers have one size, and the loader casts them back before it calls them.
    unsafe {
        match name.to_bytes() {
            b"vk_icdNegotiateLoaderICDInterfaceVersion" => {
                transmute::<Negotiate, vk::PFN_vkVoidFunction>(negotiate)
            }
            b"vk_icdGetPhysicalDeviceProcAddr" => {
                transmute::<GetProcAddr, vk::PFN_vkVoidFunction>(get_physical)
            }
            _ => None,
        }
    }
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

    fn get_physical_device_proc_addr(
        instance: vk::Instance,
        name: *const c_char,
    ) -> vk::PFN_vkVoidFunction {
        let name = pointer::string(name).ok_or(Error::NullPointer { what: "name" })?;
        let instance = handle::get(instance)?;
        Ok(dispatch::physical_device_command(name, &instance.enabled()))
    }
}
