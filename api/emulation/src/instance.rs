//! Instances: the next layer's commands, and which of its devices get the extension.

use std::collections::HashMap;
use std::ffi::CStr;
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;
use gaurast_layer_interface::{GetInstanceProcAddr, Live};

use crate::support;

/// An instance.
pub(crate) struct Instance {
    pub(crate) handle: vk::Instance,
    /// The version of Vulkan that the application uses.
    pub(crate) api_version: u32,
    pub(crate) get_instance_proc_addr: GetInstanceProcAddr,
    get_physical_device_proc_addr: Option<GetInstanceProcAddr>,
    /// The next layer's commands. They are looked up as the instance is created, since the loader's end of the chain gives the
    /// first layer's functions later.
    pub(crate) next: ash::Instance,
    /// Whether a physical device gets the extension.
    is_emulated: Mutex<HashMap<vk::PhysicalDevice, bool>>,
}

/// The instances that live.
static INSTANCES: Live<Instance> = Live::new();

impl Instance {
    /// Remembers an instance.
    ///
    /// # Safety
    /// The instance was created a moment ago by the layer of these functions.
    pub(crate) unsafe fn register(
        handle: vk::Instance,
        api_version: u32,
        get_instance_proc_addr: GetInstanceProcAddr,
        get_physical_device_proc_addr: Option<GetInstanceProcAddr>,
    ) {
        // SAFETY: the caller's promise.
        unsafe {
            let next = ash::Instance::load(&ash::StaticFn { get_instance_proc_addr }, handle);
            let instance = Self {
                handle,
                api_version,
                get_instance_proc_addr,
                get_physical_device_proc_addr,
                next,
                is_emulated: Mutex::default(),
            };
            INSTANCES.insert(handle, instance);
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

    /// A command of the next layer by name, for the application.
    pub(crate) fn next_by_name(&self, name: &CStr) -> vk::PFN_vkVoidFunction {
        // SAFETY: the instance lives, and the name is a string.
        unsafe { (self.get_instance_proc_addr)(self.handle, name.as_ptr()) }
    }

    /// A command of the next layer whose first parameter is a physical device.
    pub(crate) fn next_of_physical_device(&self, name: &CStr) -> vk::PFN_vkVoidFunction {
        let get = self.get_physical_device_proc_addr?;
        // SAFETY: the instance lives, and the name is a string.
        unsafe { get(self.handle, name.as_ptr()) }
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
