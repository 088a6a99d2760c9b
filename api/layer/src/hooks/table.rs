//! The hooks by the names of their commands.

use std::ffi::CStr;

use ash::vk;
use gaurast::vk as gvk;

use crate::hooks::instance;
use crate::hooks::objects::*;
use crate::hooks::recording::*;
use crate::hooks::submit::*;
use crate::next::device_commands;
use gaurast_layer_interface::Function;

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
    let create_messenger: vk::PFN_vkCreateDebugUtilsMessengerEXT = instance::create_messenger;
    let destroy_messenger: vk::PFN_vkDestroyDebugUtilsMessengerEXT = instance::destroy_messenger;
    // SAFETY: as in `device_hook`.
    unsafe {
        use std::mem::transmute;
        Some(match name.to_bytes() {
            b"vkCreateInstance" => transmute::<vk::PFN_vkCreateInstance, Function>(create),
            b"vkDestroyInstance" => transmute::<vk::PFN_vkDestroyInstance, Function>(destroy),
            b"vkCreateDevice" => transmute::<vk::PFN_vkCreateDevice, Function>(create_device),
            b"vkCreateDebugUtilsMessengerEXT" => {
                transmute::<vk::PFN_vkCreateDebugUtilsMessengerEXT, Function>(create_messenger)
            }
            b"vkDestroyDebugUtilsMessengerEXT" => {
                transmute::<vk::PFN_vkDestroyDebugUtilsMessengerEXT, Function>(destroy_messenger)
            }
            _ => return None,
        })
    }
}
