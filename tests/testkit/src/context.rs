//! An instance and its devices, for tests of their creation.

use crate::Messages;
use ash::vk;
use std::ffi::CStr;

/// An instance of a driver. Dropping it destroys the instance.
pub struct Context {
    /// The entry of the driver or the loader.
    pub entry: ash::Entry,
    /// The instance, of version 1.3.
    pub instance: ash::Instance,
    /// Its one physical device.
    pub physical_device: vk::PhysicalDevice,
}

impl Context {
    /// Creates an instance of the entry's driver, version 1.3, with these extensions.
    pub fn new(entry: ash::Entry, extensions: &[&CStr]) -> Self {
        let names: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&application).enabled_extension_names(&names);
        // SAFETY: the creation info is valid.
        let instance = unsafe { entry.create_instance(&info, None) }.expect("an instance");
        Self::of(entry, instance)
    }

    /// Finds the one physical device of an instance.
    pub fn of(entry: ash::Entry, instance: ash::Instance) -> Self {
        // SAFETY: the instance is live.
        let physical_devices = unsafe { instance.enumerate_physical_devices() }.unwrap();
        let &[physical_device] = physical_devices.as_slice() else {
            panic!("there is one physical device, not {}", physical_devices.len());
        };
        Self { entry, instance, physical_device }
    }

    /// Creates an instance of the loader's first driver.
    pub fn loaded(extensions: &[&CStr]) -> Self {
        Self::new(loader(), extensions)
    }

    /// Creates an instance of the driver linked into the test.
    pub fn embedded(extensions: &[&CStr]) -> Self {
        Self::new(vulkan_gaurast::entry(), extensions)
    }

    /// Creates a device with one queue.
    pub fn device(
        &self,
        extensions: &[&CStr],
        features: &mut vk::PhysicalDeviceFeatures2<'_>,
    ) -> Result<ash::Device, vk::Result> {
        let names: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
        let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&names)
            .push_next(features);
        // SAFETY: the creation info is valid.
        unsafe { self.instance.create_device(self.physical_device, &info, None) }
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        // SAFETY: tests destroy the instance's objects first.
        unsafe { self.instance.destroy_instance(None) };
    }
}

/// The system's loader.
pub fn loader() -> ash::Entry {
    // SAFETY: the loader is the system's own.
    unsafe { ash::Entry::load() }.expect("the system's loader")
}

/// Creation info of a messenger that stores all messages in `messages`.
pub fn everything(messages: &Messages) -> vk::DebugUtilsMessengerCreateInfoEXT<'_> {
    use vk::DebugUtilsMessageSeverityFlagsEXT as Severity;
    messages.messenger_of(Severity::VERBOSE | Severity::INFO | Severity::WARNING | Severity::ERROR)
}
