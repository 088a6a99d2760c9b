//! `VK_LAYER_GAURAST_validation`: a Vulkan layer that checks the use of `VK_GAURAST_gaussian_primitive_topology`, on
//! any driver.
//!
//! It says which rule of the extension's valid usage a command breaks, and warns of what is valid and surely not
//! meant, such as logarithms where scales are wanted. Messages go to the application's debug-utils messengers, or to
//! the standard error where there is none. Every command is passed on as it is.
//!
//! | module | has |
//! |---|---|
//! | `hooks` | the commands that are intercepted |
//! | `next` | the next layer's commands |
//! | `instance`, `device` | what lives, by the loader's key |
//! | `objects`, `recording`, `request` | what the layer knows: objects, command buffers, a pipeline that is created |
//! | `pending` | submissions whose end is awaited |
//! | `rules` | what is checked |
//! | `spirv`, `formats` | a shader's interface; how vertex formats are read |
//! | `report` | messages |

#![allow(non_snake_case, reason = "a layer's library is named as the layer")]

mod device;
mod facts;
mod formats;
mod hooks;
mod instance;
mod next;
mod objects;
mod pending;
mod recording;
mod report;
mod request;
mod rules;
mod spirv;

use std::ffi::{CStr, c_char};

use ash::vk;

use crate::device::Device;
use crate::instance::Instance;
use gaurast_layer_interface::{LayerFunctions, NegotiateLayerInterface, string};

/// Agrees with the loader on the version of their interface, and gives it the layer's functions.
///
/// # Safety
/// `version` points at the loader's structure, or is null.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn vkNegotiateLoaderLayerInterfaceVersion(
    version: *mut NegotiateLayerInterface,
) -> vk::Result {
    // SAFETY: the caller's promise.
    unsafe { gaurast_layer_interface::negotiate(version, FUNCTIONS) }
}

/// The layer's functions.
const FUNCTIONS: LayerFunctions =
    LayerFunctions { get_instance_proc_addr, get_device_proc_addr, get_physical_device_proc_addr };

/// `vkGetInstanceProcAddr`.
unsafe extern "system" fn get_instance_proc_addr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the name is a string, or null.
    let command = unsafe { string(name) };
    if let Some(own) = FUNCTIONS.lookup(command) {
        return Some(own);
    }
    if instance == vk::Instance::null() {
        return hooks::instance_hook(command).filter(|_| command == c"vkCreateInstance");
    }
    // SAFETY: the instance is valid.
    let own = unsafe { Instance::of(instance) }?;
    // SAFETY: the instance lives.
    let next = unsafe { own.next_instance.command(command) }?;
    let hook = hooks::instance_hook(command).or_else(|| hooks::device_hook(command));
    Some(hook.unwrap_or(next))
}

/// `vkGetDeviceProcAddr`.
unsafe extern "system" fn get_device_proc_addr(device: vk::Device, name: *const c_char) -> vk::PFN_vkVoidFunction {
    // SAFETY: the name is a string, or null.
    let command = unsafe { string(name) };
    if command == c"vkGetDeviceProcAddr" {
        return FUNCTIONS.lookup(command);
    }
    // SAFETY: the device is valid, and the name is a string.
    let next = unsafe { (Device::of(device)?.get_device_proc_addr)(device, name) }?;
    Some(hooks::device_hook(command).unwrap_or(next))
}

/// `vk_layerGetPhysicalDeviceProcAddr`.
unsafe extern "system" fn get_physical_device_proc_addr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the instance is valid, and the name is a string.
    unsafe { Instance::of(instance)?.next_instance.command_of_physical_device(CStr::from_ptr(name)) }
}
