//! The lookup of commands by name.

use std::ffi::{CStr, c_char};

use ash::vk;
use gaurast_layer_interface::{LayerFunctions, string};

use crate::device::Device;
use crate::hooks;
use crate::instance::Instance;

/// The functions of a layer, for the loader.
pub fn layer_functions() -> LayerFunctions {
    FUNCTIONS
}

const FUNCTIONS: LayerFunctions =
    LayerFunctions { get_instance_proc_addr, get_device_proc_addr, get_physical_device_proc_addr };

/// `vkGetInstanceProcAddr` of an instance, or `vkCreateInstance`.
pub(crate) unsafe extern "system" fn get_instance_proc_addr(
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
    let next = unsafe { own.next_instance.command(command) };
    if let Some(hook) = hooks::instance_hook(command) {
        return next.map(|_| hook);
    }
    // A device's hook passes on what its device does not need. Commands of the extension exist in it alone.
    let hook = hooks::device_hook(command);
    if hooks::is_own(command) { hook } else { next.map(|next| hook.unwrap_or(next)) }
}

/// `vkGetDeviceProcAddr`.
pub(crate) unsafe extern "system" fn get_device_proc_addr(
    device: vk::Device,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the name is a string, or null.
    let command = unsafe { string(name) };
    if command == c"vkGetDeviceProcAddr" {
        return FUNCTIONS.lookup(command);
    }
    // SAFETY: the device is valid, and the name is a string.
    unsafe {
        let own = Device::of(device)?;
        if own.emulation.is_none() {
            // Nothing is intercepted but the end.
            let next = (own.get_device_proc_addr)(device, name);
            return if command == c"vkDestroyDevice" { hooks::device_hook(command) } else { next };
        }
        if hooks::is_own(command) {
            return hooks::device_hook(command);
        }
        let next = (own.get_device_proc_addr)(device, name)?;
        Some(hooks::device_hook(command).unwrap_or(next))
    }
}

/// `vk_layerGetPhysicalDeviceProcAddr`.
unsafe extern "system" fn get_physical_device_proc_addr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the instance is valid, and the name is a string.
    unsafe { Instance::of(instance)?.next_instance.command_of_physical_device(CStr::from_ptr(name)) }
}
