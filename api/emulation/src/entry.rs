//! The door within a process.

use std::ffi::c_char;

use ash::vk;
use gaurast_layer_interface::string;

use crate::below::BELOW;
use crate::proc_addr;

/// Puts the extension over the Vulkan loader's entry: the devices of its instances have `VK_GAURAST_gaussian_primitive_topology`,
/// as with the layer, without a manifest. A process has one such entry; later calls give the first one's.
///
/// `below` is an entry of the Vulkan loader, such as `ash::Entry::load` gives: handles that are not the loader's cannot be told
/// apart.
pub fn entry(below: ash::Entry) -> ash::Entry {
    BELOW.get_or_init(|| below);
    let functions = ash::StaticFn { get_instance_proc_addr };
    // SAFETY: the function is one of Vulkan's commands, and stays.
    unsafe { ash::Entry::from_static_fn(functions) }
}

/// `vkGetInstanceProcAddr`: commands without an instance are those of the entry below.
unsafe extern "system" fn get_instance_proc_addr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the caller's valid usage.
    unsafe {
        let found = proc_addr::get_instance_proc_addr(instance, name);
        let command = string(name);
        if instance != vk::Instance::null() || found.is_some() {
            let get: vk::PFN_vkGetInstanceProcAddr = get_instance_proc_addr;
            return if command == c"vkGetInstanceProcAddr" {
                std::mem::transmute::<vk::PFN_vkGetInstanceProcAddr, vk::PFN_vkVoidFunction>(get)
            } else {
                found
            };
        }
        let below = BELOW.get()?;
        (below.static_fn().get_instance_proc_addr)(instance, name)
    }
}
