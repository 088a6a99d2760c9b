//! The commands that the layer intercepts, by chapter of Vulkan. Each passes itself on, but for what a mutant changes.

mod bind;
mod draw;
mod gaussian;
mod instance;
mod pass;
mod pipeline;
mod submit;
mod transfer;

use std::ffi::CStr;

use ash::vk;
use gaurast::vk as gvk;

use crate::next::device_commands;
use gaurast_layer_interface::Function;

use bind::*;
use draw::*;
use gaussian::*;
use pass::*;
use pipeline::*;
use submit::*;
use transfer::*;

macro_rules! lookup {
    ($($name:ident: $type:ty = [$($command:literal),+];)*) => {
        /// The hook of a device's command.
        pub(crate) fn device_hook(name: &CStr) -> Option<Function> {
            let name = name.to_str().ok()?;
            $(
                if [$($command),+].contains(&name) {
                    let hook: $type = $name;
                    // SAFETY: function pointers have one size, and whoever calls it casts it back.
                    return Some(unsafe { std::mem::transmute::<$type, Function>(hook) });
                }
            )*
            None
        }
    };
}
device_commands!(lookup);

/// The hook of an instance's command.
pub(crate) fn instance_hook(name: &CStr) -> Option<Function> {
    let create: vk::PFN_vkCreateInstance = instance::create_instance;
    let destroy: vk::PFN_vkDestroyInstance = instance::destroy_instance;
    let create_device: vk::PFN_vkCreateDevice = instance::create_device;
    let features: vk::PFN_vkGetPhysicalDeviceFeatures2 = instance::get_physical_device_features2;
    let properties: vk::PFN_vkGetPhysicalDeviceProperties2 = instance::get_physical_device_properties2;
    // SAFETY: as in `device_hook`.
    unsafe {
        use std::mem::transmute;
        Some(match name.to_bytes() {
            b"vkCreateInstance" => transmute::<vk::PFN_vkCreateInstance, Function>(create),
            b"vkDestroyInstance" => transmute::<vk::PFN_vkDestroyInstance, Function>(destroy),
            b"vkCreateDevice" => transmute::<vk::PFN_vkCreateDevice, Function>(create_device),
            b"vkGetPhysicalDeviceFeatures2" | b"vkGetPhysicalDeviceFeatures2KHR" => {
                transmute::<vk::PFN_vkGetPhysicalDeviceFeatures2, Function>(features)
            }
            b"vkGetPhysicalDeviceProperties2" | b"vkGetPhysicalDeviceProperties2KHR" => {
                transmute::<vk::PFN_vkGetPhysicalDeviceProperties2, Function>(properties)
            }
            _ => return None,
        })
    }
}
