//! Instances, and the functions of the next layer that belong to them.

use std::collections::BTreeMap;
use std::ffi::CStr;
use std::sync::{Arc, PoisonError, RwLock};

use ash::vk;

use crate::interface::{self, GetInstanceProcAddr};
use crate::report::Messengers;

/// An instance.
pub(crate) struct Instance {
    pub(crate) handle: vk::Instance,
    get_instance_proc_addr: GetInstanceProcAddr,
    get_physical_device_proc_addr: Option<GetInstanceProcAddr>,
    pub(crate) messengers: Messengers,
}

/// The instances that live, by the loader's key.
static INSTANCES: RwLock<BTreeMap<usize, Arc<Instance>>> = RwLock::new(BTreeMap::new());

impl Instance {
    /// Remembers an instance.
    pub(crate) fn register(handle: vk::Instance, link: &interface::InstanceLink) {
        let instance = Self {
            handle,
            get_instance_proc_addr: link.get_instance_proc_addr,
            get_physical_device_proc_addr: link.get_physical_device_proc_addr,
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

    /// A command of the next layer.
    ///
    /// # Safety
    /// `F` is the type of the command's function.
    pub(crate) unsafe fn next<F: Copy>(&self, name: &CStr) -> Option<F> {
        // SAFETY: the instance lives, and the name is a string.
        let found = unsafe { (self.get_instance_proc_addr)(self.handle, name.as_ptr()) }?;
        const { assert!(size_of::<F>() == size_of::<usize>()) };
        // SAFETY: function pointers have one size, and the caller knows the type.
        Some(unsafe { std::mem::transmute_copy(&found) })
    }

    /// A command of the next layer whose first parameter is a physical device.
    pub(crate) fn next_of_physical_device(&self, name: &CStr) -> vk::PFN_vkVoidFunction {
        let get = self.get_physical_device_proc_addr?;
        // SAFETY: the instance lives, and the name is a string.
        unsafe { get(self.handle, name.as_ptr()) }
    }
}
