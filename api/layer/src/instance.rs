//! Instances, and the functions of the next layer that belong to them.

use std::sync::Arc;

use ash::vk;

use crate::report::Messengers;
use gaurast_layer_interface::{InstanceLink, Live, NextInstance, command};

/// The next layer's commands. They are looked up as the instance is created, since the loader's end of the chain gives
/// the first layer's functions later.
pub(crate) struct NextOfInstance {
    pub(crate) destroy: Option<vk::PFN_vkDestroyInstance>,
    pub(crate) create_messenger: Option<vk::PFN_vkCreateDebugUtilsMessengerEXT>,
    pub(crate) destroy_messenger: Option<vk::PFN_vkDestroyDebugUtilsMessengerEXT>,
    pub(crate) features: Option<vk::PFN_vkGetPhysicalDeviceFeatures2>,
    pub(crate) properties: Option<vk::PFN_vkGetPhysicalDeviceProperties2>,
    pub(crate) memory_properties: Option<vk::PFN_vkGetPhysicalDeviceMemoryProperties>,
    pub(crate) format_properties: Option<vk::PFN_vkGetPhysicalDeviceFormatProperties>,
}

impl NextOfInstance {
    /// Looks them up.
    ///
    /// # Safety
    /// The instance was created by the link's layer a moment ago.
    unsafe fn load(handle: vk::Instance, link: &InstanceLink) -> Self {
        let get = link.get_instance_proc_addr;
        // SAFETY: each name is that of a command of this type.
        unsafe {
            Self {
                destroy: command(get, handle, c"vkDestroyInstance"),
                create_messenger: command(get, handle, c"vkCreateDebugUtilsMessengerEXT"),
                destroy_messenger: command(get, handle, c"vkDestroyDebugUtilsMessengerEXT"),
                features: command(get, handle, c"vkGetPhysicalDeviceFeatures2")
                    .or_else(|| command(get, handle, c"vkGetPhysicalDeviceFeatures2KHR")),
                properties: command(get, handle, c"vkGetPhysicalDeviceProperties2")
                    .or_else(|| command(get, handle, c"vkGetPhysicalDeviceProperties2KHR")),
                memory_properties: command(get, handle, c"vkGetPhysicalDeviceMemoryProperties"),
                format_properties: command(get, handle, c"vkGetPhysicalDeviceFormatProperties"),
            }
        }
    }
}

/// An instance.
pub(crate) struct Instance {
    pub(crate) next_instance: NextInstance,
    pub(crate) next: NextOfInstance,
    pub(crate) messengers: Messengers,
}

/// The instances that live.
static INSTANCES: Live<Instance> = Live::new();

impl Instance {
    /// Remembers an instance.
    ///
    /// # Safety
    /// The instance was created by the link's layer a moment ago.
    pub(crate) unsafe fn register(handle: vk::Instance, link: &InstanceLink) {
        let instance = Self {
            next_instance: NextInstance {
                handle,
                get_instance_proc_addr: link.get_instance_proc_addr,
                get_physical_device_proc_addr: link.get_physical_device_proc_addr,
            },
            // SAFETY: the caller has just created it.
            next: unsafe { NextOfInstance::load(handle, link) },
            messengers: Messengers::default(),
        };
        // SAFETY: the next layer has just made it.
        unsafe { INSTANCES.insert(handle, instance) };
    }

    /// The instance of a handle of its own or of a physical device.
    ///
    /// # Safety
    /// The handle is valid.
    pub(crate) unsafe fn of<H: vk::Handle>(handle: H) -> Option<Arc<Self>> {
        // SAFETY: the caller's promise.
        unsafe { INSTANCES.of(handle) }
    }

    /// Forgets an instance, and gives it a last time.
    ///
    /// # Safety
    /// The handle is valid.
    pub(crate) unsafe fn forget(handle: vk::Instance) -> Option<Arc<Self>> {
        // SAFETY: the caller's promise.
        unsafe { INSTANCES.remove(handle) }
    }
}
