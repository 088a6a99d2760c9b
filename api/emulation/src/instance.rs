//! Instances: the next layer's commands, and which of its devices get the extension.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;
use gaurast_layer_interface::{Live, NextInstance};

use crate::support;

/// An instance.
pub(crate) struct Instance {
    pub(crate) next_instance: NextInstance,
    /// The version of Vulkan that the application uses.
    pub(crate) api_version: u32,
    /// The next layer's commands. They are looked up as the instance is created, since the loader's end of the chain gives the
    /// first layer's functions later.
    pub(crate) next: ash::Instance,
    /// True for each physical device that gets the extension, as far as it has been asked.
    is_emulated: Mutex<HashMap<vk::PhysicalDevice, bool>>,
}

/// The instances that live.
static INSTANCES: Live<Instance> = Live::new();

impl Instance {
    /// Remembers an instance.
    ///
    /// # Safety
    /// The instance was created a moment ago by the layer of these functions.
    pub(crate) unsafe fn register(next_instance: NextInstance, api_version: u32) {
        let NextInstance { handle, get_instance_proc_addr, .. } = next_instance;
        // SAFETY: the caller's promise.
        unsafe {
            let next = ash::Instance::load(&ash::StaticFn { get_instance_proc_addr }, handle);
            INSTANCES.insert(handle, Self { next_instance, api_version, next, is_emulated: Mutex::default() });
        }
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

    /// Reports whether a physical device gets the extension from here.
    ///
    /// # Safety
    /// The physical device is the instance's.
    pub(crate) unsafe fn emulates(&self, physical_device: vk::PhysicalDevice) -> bool {
        let mut known = self.is_emulated.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: the caller's promise.
        *known
            .entry(physical_device)
            .or_insert_with(|| unsafe { support::can_be_emulated(&self.next, self.api_version, physical_device) })
    }
}
