//! Instances, and the functions of the next layer that belong to them.

use std::collections::BTreeMap;
use std::ffi::CStr;
use std::sync::{Arc, PoisonError, RwLock};

use ash::vk;

use crate::report::Messengers;
use gaurast_layer_interface::{self as interface, GetInstanceProcAddr, InstanceLink};

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
        // SAFETY: each name is that of a command of this type.
        unsafe {
            Self {
                destroy: find(handle, link, c"vkDestroyInstance"),
                create_messenger: find(handle, link, c"vkCreateDebugUtilsMessengerEXT"),
                destroy_messenger: find(handle, link, c"vkDestroyDebugUtilsMessengerEXT"),
                features: find(handle, link, c"vkGetPhysicalDeviceFeatures2")
                    .or_else(|| find(handle, link, c"vkGetPhysicalDeviceFeatures2KHR")),
                properties: find(handle, link, c"vkGetPhysicalDeviceProperties2")
                    .or_else(|| find(handle, link, c"vkGetPhysicalDeviceProperties2KHR")),
                memory_properties: find(handle, link, c"vkGetPhysicalDeviceMemoryProperties"),
                format_properties: find(handle, link, c"vkGetPhysicalDeviceFormatProperties"),
            }
        }
    }
}

/// A command of the next layer.
///
/// # Safety
/// The instance is valid, and `F` is the type of the command's function.
unsafe fn find<F: Copy>(handle: vk::Instance, link: &InstanceLink, name: &CStr) -> Option<F> {
    // SAFETY: the instance lives, and the name is a string.
    let found = unsafe { (link.get_instance_proc_addr)(handle, name.as_ptr()) }?;
    const { assert!(size_of::<F>() == size_of::<usize>()) };
    // SAFETY: function pointers have one size, and the caller knows the type.
    Some(unsafe { std::mem::transmute_copy(&found) })
}

/// An instance.
pub(crate) struct Instance {
    pub(crate) handle: vk::Instance,
    get_instance_proc_addr: GetInstanceProcAddr,
    get_physical_device_proc_addr: Option<GetInstanceProcAddr>,
    pub(crate) next: NextOfInstance,
    pub(crate) messengers: Messengers,
}

/// The instances that live, by the loader's key.
static INSTANCES: RwLock<BTreeMap<usize, Arc<Instance>>> = RwLock::new(BTreeMap::new());

impl Instance {
    /// Remembers an instance.
    ///
    /// # Safety
    /// The instance was created by the link's layer a moment ago.
    pub(crate) unsafe fn register(handle: vk::Instance, link: &InstanceLink) {
        let instance = Self {
            handle,
            get_instance_proc_addr: link.get_instance_proc_addr,
            get_physical_device_proc_addr: link.get_physical_device_proc_addr,
            // SAFETY: the caller has just created it.
            next: unsafe { NextOfInstance::load(handle, link) },
            messengers: Messengers::default(),
        };
        // SAFETY: the next layer has just made it.
        let key = unsafe { interface::key(handle) };
        let mut instances = INSTANCES.write().unwrap_or_else(PoisonError::into_inner);
        instances.insert(key, Arc::new(instance));
    }

    /// The instance of a handle of its own or of a physical device.
    ///
    /// # Safety
    /// The handle is valid.
    pub(crate) unsafe fn of<H: vk::Handle>(handle: H) -> Option<Arc<Self>> {
        // SAFETY: the caller's promise.
        let key = unsafe { interface::key(handle) };
        let instances = INSTANCES.read().unwrap_or_else(PoisonError::into_inner);
        instances.get(&key).cloned()
    }

    /// Forgets an instance, and gives it a last time.
    ///
    /// # Safety
    /// The handle is valid.
    pub(crate) unsafe fn forget(handle: vk::Instance) -> Option<Arc<Self>> {
        // SAFETY: the caller's promise.
        let key = unsafe { interface::key(handle) };
        let mut instances = INSTANCES.write().unwrap_or_else(PoisonError::into_inner);
        instances.remove(&key)
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
}
