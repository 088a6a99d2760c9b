//! Instances, with their version, extensions and listeners to messages, and the physical device of each instance.
//!
//! The version is 1.3: every core command's name is found. The version claims no conformance (`conformanceVersion` is
//! 0.0.0.0): features that 1.3 requires and that don't work yet are reported as false and refused by `vkCreateDevice`,
//! and commands that don't work yet fail with a message. With a lower version, dynamic rendering and synchronization2,
//! which do work, would depend on extensions that don't.

use crate::abi::error::Error;
use crate::abi::handle::{self, Reporter, objects};
use crate::abi::valid::{self, Structures};
use crate::convert;
use crate::listeners::{DebugMessenger, DebugReportCallback, Listeners, Message, ReportOrigin};
use crate::options::Options;
use crate::registry::extensions::{DEVICE, Extension, INSTANCE};
use crate::registry::newer;
use crate::window;
use ash::vk;
use std::ffi::CStr;
use std::sync::{Arc, LazyLock, Weak};

/// The version of the instance and of its device.
pub(crate) const API_VERSION: u32 = newer::HEADER_VERSION_COMPLETE;

/// The names of all device extensions.
pub(crate) fn device_extension_names() -> &'static [&'static CStr] {
    static NAMES: LazyLock<Vec<&'static CStr>> = LazyLock::new(|| DEVICE.iter().map(|&(name, _)| name).collect());
    &NAMES
}

/// The instance extensions; those of window systems only if there are window systems.
fn instance_extensions() -> Vec<Extension> {
    let listed = INSTANCE.iter().copied();
    listed.filter(|(name, _)| window::is_available(name)).collect()
}

/// The requested extensions, as the driver's own names.
///
/// # Errors
/// [`Error::ExtensionNotPresent`] for the first that isn't in `available`.
pub(crate) fn resolve_extensions(available: &[Extension], requested: &[&CStr]) -> Result<Vec<&'static CStr>, Error> {
    requested
        .iter()
        .map(|&name| {
            available
                .iter()
                .map(|&(known, _)| known)
                .find(|&known| known == name)
                .ok_or_else(|| Error::ExtensionNotPresent(name.to_string_lossy().into_owned()))
        })
        .collect()
}

/// The extensions as Vulkan enumerates them.
pub(crate) fn extension_properties(extensions: &[Extension]) -> Vec<vk::ExtensionProperties> {
    extensions
        .iter()
        .map(|&(name, spec_version)| {
            let mut properties = vk::ExtensionProperties::default().spec_version(spec_version);
            convert::write_string(&mut properties.extension_name, name);
            properties
        })
        .collect()
}

/// An instance. It owns its only physical device.
pub(crate) struct Instance {
    this: Weak<Self>,
    api_version: u32,
    extensions: Vec<&'static CStr>,
    options: Options,
    physical_device: vk::PhysicalDevice,
    messengers: Listeners<DebugMessenger>,
    report_callbacks: Listeners<DebugReportCallback>,
}

objects! {
    vk::Instance => Instance {
        fn reporter(&self) -> Option<Arc<dyn Reporter>> {
            Some(self.this.upgrade()?)
        }
    };
    vk::PhysicalDevice => PhysicalDevice {
        fn reporter(&self) -> Option<Arc<dyn Reporter>> {
            Some(self.instance.upgrade()?)
        }
    };
    vk::DebugUtilsMessengerEXT => DebugMessenger;
    vk::DebugReportCallbackEXT => DebugReportCallback;
}

/// The version and the extensions that decide which commands are found.
pub(crate) struct EnabledExtensions<'a> {
    /// The instance's `apiVersion`, at most the driver's.
    pub(crate) api_version: u32,
    /// Enabled instance extensions.
    pub(crate) instance_extensions: &'a [&'static CStr],
    /// Enabled device extensions.
    pub(crate) device_extensions: &'a [&'static CStr],
}

impl Instance {
    /// An instance for an application that requests `api_version` (0 means 1.0), `extensions` and, for its devices,
    /// `options`.
    ///
    /// # Errors
    /// [`Error::ExtensionNotPresent`].
    pub(crate) fn new(api_version: u32, extensions: &[&CStr], options: Options) -> Result<Arc<Self>, Error> {
        let extensions = resolve_extensions(&instance_extensions(), extensions)?;
        let api_version = match api_version {
            0 => vk::API_VERSION_1_0,
            version => version.min(API_VERSION),
        };
        Ok(Arc::new_cyclic(|this| Self {
            this: this.clone(),
            api_version,
            extensions,
            options,
            physical_device: handle::create(Arc::new(PhysicalDevice::new(this.clone()))),
            messengers: Listeners::default(),
            report_callbacks: Listeners::default(),
        }))
    }

    /// Its only physical device.
    pub(crate) fn physical_device(&self) -> vk::PhysicalDevice {
        self.physical_device
    }

    /// The options of its devices.
    pub(crate) fn options(&self) -> &Options {
        &self.options
    }

    /// The version and extensions that decide which commands are found through this instance.
    pub(crate) fn enabled_extensions(&self) -> EnabledExtensions<'_> {
        EnabledExtensions {
            api_version: self.api_version,
            instance_extensions: &self.extensions,
            device_extensions: device_extension_names(),
        }
    }

    /// Sends a message of the driver to the listeners that accept it.
    pub(crate) fn report(
        &self,
        severity: vk::DebugUtilsMessageSeverityFlagsEXT,
        types: vk::DebugUtilsMessageTypeFlagsEXT,
        id: &str,
        message: &str,
    ) {
        self.send(&Message::new(severity, types, id, message));
    }

    fn send(&self, message: &Message) {
        for messenger in self.messengers.all() {
            messenger.report(message);
        }
        for callback in self.report_callbacks.all() {
            callback.report(message);
        }
    }
}

impl Reporter for Instance {
    fn report_error(&self, command: &str, error: &Error) {
        self.send(&Message::of_error(command, error));
    }

    fn report_warning(&self, error: &Error) {
        self.send(&Message::of_warning(error));
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

/// The simulated GauRast device, before an application opens it.
pub(crate) struct PhysicalDevice {
    instance: Weak<Instance>,
}

impl PhysicalDevice {
    /// The physical device of an instance, which may still be under construction.
    pub(crate) fn new(instance: Weak<Instance>) -> Self {
        Self { instance }
    }

    /// Its instance.
    ///
    /// # Errors
    /// [`Error::InvalidHandle`] if the instance has been destroyed.
    pub(crate) fn require_instance(&self) -> Result<Arc<Instance>, Error> {
        self.instance.upgrade().ok_or(Error::InvalidHandle { expected: vk::ObjectType::INSTANCE, raw: 0 })
    }
}

/// Creates an instance from a valid creation info.
unsafe fn new_instance(info: &vk::InstanceCreateInfo<'_>) -> Result<Arc<Instance>, Error> {
    // SAFETY: the caller promises a valid creation info, and so valid arrays of strings.
    let (layers, names) = unsafe {
        (
            valid::slice(info.pp_enabled_layer_names, info.enabled_layer_count)?,
            valid::strings(info.pp_enabled_extension_names, info.enabled_extension_count)?,
        )
    };
    if !layers.is_empty() {
        return Err(Error::LayerNotPresent("in the driver".to_owned()));
    }
    // SAFETY: as above.
    let (application, options) = unsafe { (valid::optional(info.p_application_info), Options::of_chain(info.p_next)) };
    Instance::new(application.map_or(0, |application| application.api_version), &names, options)
}

#[doc(alias = "vkEnumerateInstanceVersion")]
pub(crate) fn enumerate_instance_version() -> Result<u32, Error> {
    Ok(API_VERSION)
}

#[doc(alias = "vkEnumerateInstanceExtensionProperties")]
pub(crate) fn enumerate_instance_extension_properties(
    layer_name: Option<&CStr>,
) -> Result<Vec<vk::ExtensionProperties>, Error> {
    match layer_name {
        None => Ok(extension_properties(&instance_extensions())),
        Some(layer) => Err(Error::LayerNotPresent(layer.to_string_lossy().into_owned())),
    }
}

#[doc(alias = "vkEnumerateInstanceLayerProperties")]
pub(crate) fn enumerate_instance_layer_properties() -> Result<[vk::LayerProperties; 0], Error> {
    Ok([])
}

/// # Safety
/// The create info and its chain are valid.
#[doc(alias = "vkCreateInstance")]
pub(crate) unsafe fn create_instance(create_info: &vk::InstanceCreateInfo<'_>) -> Result<Arc<Instance>, Error> {
    // SAFETY: the caller's promise.
    unsafe { new_instance(create_info) }.inspect_err(|error| {
        // Listeners in the chain receive errors of the creation of the instance itself.
        let message = Message::of_error("vkCreateInstance", error);
        // SAFETY: the caller's promise.
        for structure in unsafe { valid::chain(create_info.p_next) } {
            if let Some(info) = valid::cast::<vk::DebugUtilsMessengerCreateInfoEXT<'_>>(structure) {
                DebugMessenger::new(info).report(&message);
            }
            if let Some(info) = valid::cast::<vk::DebugReportCallbackCreateInfoEXT<'_>>(structure) {
                DebugReportCallback::new(info).report(&message);
            }
        }
    })
}

#[doc(alias = "vkEnumeratePhysicalDevices")]
pub(crate) fn enumerate_physical_devices(instance: &Instance) -> Result<[vk::PhysicalDevice; 1], Error> {
    Ok([instance.physical_device()])
}

#[doc(alias = "vkEnumeratePhysicalDeviceGroups")]
pub(crate) fn enumerate_physical_device_groups(
    instance: &Instance,
    physical_device_group_properties: Structures<'_, vk::PhysicalDeviceGroupProperties<'_>>,
) -> Result<vk::Result, Error> {
    physical_device_group_properties.fill(1, |_, group| {
        group.physical_device_count = 1;
        group.physical_devices[0] = instance.physical_device();
        group.subset_allocation = vk::FALSE;
    })
}

#[doc(alias = "vkCreateDebugUtilsMessengerEXT")]
pub(crate) fn create_debug_utils_messenger(
    instance: &Instance,
    create_info: &vk::DebugUtilsMessengerCreateInfoEXT<'_>,
) -> Result<Arc<DebugMessenger>, Error> {
    let created = Arc::new(DebugMessenger::new(create_info));
    instance.messengers.add(Arc::clone(&created));
    Ok(created)
}

#[doc(alias = "vkDestroyDebugUtilsMessengerEXT")]
pub(crate) fn destroy_debug_utils_messenger(
    instance: &Instance,
    messenger: Option<Arc<DebugMessenger>>,
) -> Result<(), Error> {
    if let Some(messenger) = messenger {
        instance.messengers.remove(&messenger);
    }
    Ok(())
}

/// # Safety
/// The data and what it points at are valid.
#[doc(alias = "vkSubmitDebugUtilsMessageEXT")]
pub(crate) unsafe fn submit_debug_utils_message(
    instance: &Instance,
    message_severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    message_types: vk::DebugUtilsMessageTypeFlagsEXT,
    callback_data: &vk::DebugUtilsMessengerCallbackDataEXT<'_>,
) -> Result<(), Error> {
    for messenger in instance.messengers.all() {
        // SAFETY: the caller's promise.
        unsafe { messenger.submit(message_severity, message_types, callback_data) };
    }
    Ok(())
}

#[doc(alias = "vkCreateDebugReportCallbackEXT")]
pub(crate) fn create_debug_report_callback(
    instance: &Instance,
    create_info: &vk::DebugReportCallbackCreateInfoEXT<'_>,
) -> Result<Arc<DebugReportCallback>, Error> {
    let created = Arc::new(DebugReportCallback::new(create_info));
    instance.report_callbacks.add(Arc::clone(&created));
    Ok(created)
}

#[doc(alias = "vkDestroyDebugReportCallbackEXT")]
pub(crate) fn destroy_debug_report_callback(
    instance: &Instance,
    callback: Option<Arc<DebugReportCallback>>,
) -> Result<(), Error> {
    if let Some(callback) = callback {
        instance.report_callbacks.remove(&callback);
    }
    Ok(())
}

#[doc(alias = "vkDebugReportMessageEXT")]
#[expect(clippy::too_many_arguments, reason = "Vulkan's signature")]
pub(crate) fn debug_report_message(
    instance: &Instance,
    flags: vk::DebugReportFlagsEXT,
    object_type: vk::DebugReportObjectTypeEXT,
    object: u64,
    location: usize,
    message_code: i32,
    layer_prefix: &CStr,
    message: &CStr,
) -> Result<(), Error> {
    let origin = ReportOrigin { object_type, object, location, message_code, layer_prefix };
    for callback in instance.report_callbacks.all() {
        // SAFETY: the callback is registered, so it is callable.
        unsafe { callback.submit(flags, origin, message) };
    }
    Ok(())
}
