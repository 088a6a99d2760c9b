//! Instances.

use crate::capabilities::extensions;
use crate::dispatch::Enabled;
use crate::error::Error;
use crate::handle;
use crate::object::debug_messenger::DebugMessenger;
use crate::object::physical_device::PhysicalDevice;
use crate::registry;
use ash::vk;
use std::ffi::CStr;
use std::sync::{Arc, PoisonError, RwLock, Weak};

/// An instance. It owns its one physical device.
pub(crate) struct Instance {
    this: Weak<Self>,
    api_version: u32,
    extensions: Vec<&'static CStr>,
    physical_device: vk::PhysicalDevice,
    messengers: RwLock<Vec<Arc<DebugMessenger>>>,
}

crate::objects! {
    vk::Instance => Instance {
        fn reporting_instance(&self) -> Option<Arc<Instance>> {
            self.this.upgrade()
        }
    };
}

impl Instance {
    /// An instance for an application that asked for `api_version` (0 means 1.0) and `extensions`.
    ///
    /// # Errors
    /// [`Error::ExtensionNotPresent`].
    pub(crate) fn new(api_version: u32, extensions: &[&CStr]) -> Result<Arc<Self>, Error> {
        let extensions = extensions::resolve(registry::extensions::INSTANCE, extensions)?;
        let api_version = match api_version {
            0 => vk::API_VERSION_1_0,
            version => version.min(extensions::API_VERSION),
        };
        Ok(Arc::new_cyclic(|this| Self {
            this: this.clone(),
            api_version,
            extensions,
            physical_device: handle::create(Arc::new(PhysicalDevice::new(this.clone()))),
            messengers: RwLock::default(),
        }))
    }

    /// Its one physical device.
    pub(crate) fn physical_device(&self) -> vk::PhysicalDevice {
        self.physical_device
    }

    /// What gates commands that are looked up through this instance.
    pub(crate) fn enabled(&self) -> Enabled<'_> {
        Enabled {
            api_version: self.api_version,
            instance_extensions: &self.extensions,
            device_extensions: extensions::device_names(),
        }
    }

    /// Registers a messenger.
    pub(crate) fn add_messenger(&self, messenger: Arc<DebugMessenger>) {
        let mut messengers = self
            .messengers
            .write()
            .unwrap_or_else(PoisonError::into_inner);
        messengers.push(messenger);
    }

    /// Removes a messenger.
    pub(crate) fn remove_messenger(&self, messenger: &Arc<DebugMessenger>) {
        let mut messengers = self
            .messengers
            .write()
            .unwrap_or_else(PoisonError::into_inner);
        messengers.retain(|other| !Arc::ptr_eq(other, messenger));
    }

    /// The registered messengers. A callback may use Vulkan, so no lock is held while it runs.
    pub(crate) fn messengers(&self) -> Vec<Arc<DebugMessenger>> {
        self.messengers
            .read()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    /// Sends a message of the driver's own to the messengers that want it.
    pub(crate) fn report(
        &self,
        severity: vk::DebugUtilsMessageSeverityFlagsEXT,
        types: vk::DebugUtilsMessageTypeFlagsEXT,
        id: &str,
        message: &str,
    ) {
        for messenger in self.messengers() {
            messenger.report(severity, types, id, message);
        }
    }

    /// Sends an error of the Vulkan command `command` to the messengers.
    pub(crate) fn report_error(&self, command: &str, error: &Error) {
        for messenger in self.messengers() {
            messenger.report_error(command, error);
        }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: the handle was made with the instance, and the application may not use it once that is destroyed.
        if let Err(error) = unsafe { handle::destroy(self.physical_device) } {
            log::error!("the physical device's handle was overwritten: {error}");
        }
    }
}
