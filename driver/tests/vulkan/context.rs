//! An instance, its device, and what messengers heard.

use ash::vk;
use std::ffi::{CStr, c_void};
use std::sync::{Mutex, PoisonError};

/// An instance of the embedded driver. Destroyed when dropped.
pub struct Context {
    pub entry: ash::Entry,
    pub instance: ash::Instance,
    pub physical_device: vk::PhysicalDevice,
}

impl Context {
    /// An instance of the entry's driver, version 1.3, with these extensions.
    pub fn new(entry: ash::Entry, extensions: &[&CStr]) -> Self {
        let names: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_extension_names(&names);
        // SAFETY: the creation info is valid.
        let instance = unsafe { entry.create_instance(&info, None) }.expect("an instance");
        Self::of(entry, instance)
    }

    /// Finds the one physical device of an instance.
    pub fn of(entry: ash::Entry, instance: ash::Instance) -> Self {
        // SAFETY: the instance is live.
        let physical_devices = unsafe { instance.enumerate_physical_devices() }.unwrap();
        let &[physical_device] = physical_devices.as_slice() else {
            panic!(
                "there is one physical device, not {}",
                physical_devices.len()
            );
        };
        Self {
            entry,
            instance,
            physical_device,
        }
    }

    /// An instance of the driver linked into the test.
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
        unsafe {
            self.instance
                .create_device(self.physical_device, &info, None)
        }
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        // SAFETY: tests destroy the instance's objects first.
        unsafe { self.instance.destroy_instance(None) };
    }
}

/// The message ids and messages that a messenger heard.
#[derive(Default)]
pub struct Heard(Mutex<Vec<(String, String)>>);

impl Heard {
    /// Creation info of a messenger that hears everything and tells this.
    pub fn messenger(&self) -> vk::DebugUtilsMessengerCreateInfoEXT<'_> {
        use vk::{
            DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Type,
        };
        vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                Severity::VERBOSE | Severity::INFO | Severity::WARNING | Severity::ERROR,
            )
            .message_type(Type::GENERAL | Type::VALIDATION | Type::PERFORMANCE)
            .pfn_user_callback(Some(hear))
            .user_data(std::ptr::from_ref(self).cast_mut().cast())
    }

    /// Takes the messages heard since the last call.
    pub fn take(&self) -> Vec<(String, String)> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

unsafe extern "system" fn hear(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user_data: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the driver passes valid data with strings, and the user data of `Heard::messenger`.
    let (heard, id, message) = unsafe {
        let text =
            |text: *const std::ffi::c_char| CStr::from_ptr(text).to_string_lossy().into_owned();
        (
            &*user_data.cast::<Heard>(),
            text((*data).p_message_id_name),
            text((*data).p_message),
        )
    };
    heard
        .0
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .push((id, message));
    vk::FALSE
}
