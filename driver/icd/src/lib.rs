//! `libvulkan_gaurast.so`: the three symbols by which the Vulkan loader finds the driver, and a logger.
//!
//! The loader's document "Architecture of the Vulkan Loader Interfaces" specifies each symbol. `GAURAST_LOG` sets what
//! is logged.

use std::ffi::{CStr, c_char};
use std::mem::transmute;

use ash::vk;
use driver::loader;

/// Agrees with the loader on a version of their interface.
///
/// # Safety
/// `version` points at the newest version that the loader knows.
#[unsafe(no_mangle)]
#[allow(non_snake_case, reason = "the loader's name")]
pub unsafe extern "system" fn vk_icdNegotiateLoaderICDInterfaceVersion(version: *mut u32) -> vk::Result {
    // A process usually has no other logger; if it has one, that one stays.
    let _ = env_logger::Builder::new().parse_filters(&loader::log_filter()).try_init();
    // The loader negotiates before it asks for any extension.
    window::register();
    // SAFETY: the caller's promise.
    unsafe { loader::negotiate_interface_version(version) }
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
    let interface = if name.is_null() {
        None
    } else {
        // SAFETY: the caller's promise.
        interface_function(unsafe { CStr::from_ptr(name) })
    };
    // SAFETY: the caller's promise.
    interface.or_else(|| unsafe { loader::get_instance_proc_addr(instance, name) })
}

/// Finds commands whose first parameter is a physical device, so that the loader forwards those that it doesn't know.
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
    unsafe { loader::get_physical_device_proc_addr(instance, name) }
}

/// The functions of this interface by name; since version 7 they may be looked up instead of being exported.
fn interface_function(name: &CStr) -> vk::PFN_vkVoidFunction {
    type Negotiate = unsafe extern "system" fn(*mut u32) -> vk::Result;
    type GetProcAddr = vk::PFN_vkGetInstanceProcAddr;
    let (negotiate, get_physical): (Negotiate, GetProcAddr) =
        (vk_icdNegotiateLoaderICDInterfaceVersion, vk_icdGetPhysicalDeviceProcAddr);
    // SAFETY: function pointers have one size, and the loader casts them back before it calls them.
    unsafe {
        match name.to_bytes() {
            b"vk_icdNegotiateLoaderICDInterfaceVersion" => transmute::<Negotiate, vk::PFN_vkVoidFunction>(negotiate),
            b"vk_icdGetPhysicalDeviceProcAddr" => transmute::<GetProcAddr, vk::PFN_vkVoidFunction>(get_physical),
            _ => None,
        }
    }
}
