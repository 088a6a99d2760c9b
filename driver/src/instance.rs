//! Instances, with their version, extensions and debug messengers, and the physical device of each instance.
//!
//! The version is 1.3: every core command's name is found. The version claims no conformance (`conformanceVersion` is
//! 0.0.0.0): features that 1.3 requires and that don't work yet are reported as false and refused by `vkCreateDevice`,
//! and commands that don't work yet fail with a message. With a lower version, dynamic rendering and synchronization2,
//! which do work, would depend on extensions that don't.

use crate::abi::error::Error;
use crate::abi::handle::{self, Reporter, objects};
use crate::abi::valid::{self, Structures};
use crate::convert;
use crate::registry::extensions::{DEVICE, Extension, INSTANCE};
use crate::window;
use ash::vk;
use std::ffi::{CStr, CString, c_void};
use std::sync::{Arc, LazyLock, PoisonError, RwLock, Weak};

/// The version of the instance and of its device.
pub(crate) const API_VERSION: u32 = vk::HEADER_VERSION_COMPLETE;

/// The names of all device extensions.
pub(crate) fn device_extension_names() -> &'static [&'static CStr] {
    static NAMES: LazyLock<Vec<&'static CStr>> =
        LazyLock::new(|| DEVICE.iter().map(|&(name, _)| name).collect());
    &NAMES
}

/// The instance extensions; those of window systems only if there are window systems.
fn instance_extensions() -> Vec<Extension> {
    let listed = INSTANCE.iter().copied();
    listed
        .filter(|(name, _)| window::is_available(name))
        .collect()
}

/// The requested extensions, as the driver's own names.
///
/// # Errors
/// [`Error::ExtensionNotPresent`] for the first that isn't in `available`.
pub(crate) fn resolve_extensions(
    available: &[Extension],
    requested: &[&CStr],
) -> Result<Vec<&'static CStr>, Error> {
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
    physical_device: vk::PhysicalDevice,
    messengers: RwLock<Vec<Arc<DebugMessenger>>>,
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
    /// An instance for an application that requests `api_version` (0 means 1.0) and `extensions`.
    ///
    /// # Errors
    /// [`Error::ExtensionNotPresent`].
    pub(crate) fn new(api_version: u32, extensions: &[&CStr]) -> Result<Arc<Self>, Error> {
        let extensions = resolve_extensions(&instance_extensions(), extensions)?;
        let api_version = match api_version {
            0 => vk::API_VERSION_1_0,
            version => version.min(API_VERSION),
        };
        Ok(Arc::new_cyclic(|this| Self {
            this: this.clone(),
            api_version,
            extensions,
            physical_device: handle::create(Arc::new(PhysicalDevice::new(this.clone()))),
            messengers: RwLock::default(),
        }))
    }

    /// Its only physical device.
    pub(crate) fn physical_device(&self) -> vk::PhysicalDevice {
        self.physical_device
    }

    /// The version and extensions that decide which commands are found through this instance.
    pub(crate) fn enabled(&self) -> EnabledExtensions<'_> {
        EnabledExtensions {
            api_version: self.api_version,
            instance_extensions: &self.extensions,
            device_extensions: device_extension_names(),
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

    /// Sends a message of the driver to the messengers that accept it.
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
}

impl Reporter for Instance {
    fn report_error(&self, command: &str, error: &Error) {
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
        self.instance.upgrade().ok_or(Error::InvalidHandle {
            expected: vk::ObjectType::INSTANCE,
            raw: 0,
        })
    }
}

/// A callback with its filter.
pub(crate) struct DebugMessenger {
    severities: vk::DebugUtilsMessageSeverityFlagsEXT,
    types: vk::DebugUtilsMessageTypeFlagsEXT,
    callback: vk::PFN_vkDebugUtilsMessengerCallbackEXT,
    user_data: *mut c_void,
}

// SAFETY: `user_data` is the application's and only handed back to its callback, which Vulkan may call on any thread.
unsafe impl Send for DebugMessenger {}
// SAFETY: as for `Send`.
unsafe impl Sync for DebugMessenger {}

impl DebugMessenger {
    /// The messenger that the application describes.
    pub(crate) fn new(info: &vk::DebugUtilsMessengerCreateInfoEXT<'_>) -> Self {
        Self {
            severities: info.message_severity,
            types: info.message_type,
            callback: info.pfn_user_callback,
            user_data: info.p_user_data,
        }
    }

    /// Calls the application's callback if its filter accepts the message.
    ///
    /// # Safety
    /// `data` and what it points at are valid; the application keeps its callback callable while it is registered.
    pub(crate) unsafe fn submit(
        &self,
        severity: vk::DebugUtilsMessageSeverityFlagsEXT,
        types: vk::DebugUtilsMessageTypeFlagsEXT,
        data: &vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    ) {
        let wanted = self.severities.contains(severity) && self.types.intersects(types);
        if let Some(callback) = self.callback.filter(|_| wanted) {
            // SAFETY: the caller's promise. The callback's result, which asks to abort the call, is meant for layers.
            unsafe { callback(severity, types, data, self.user_data) };
        }
    }

    /// Reports an error of the Vulkan command `command`.
    pub(crate) fn report_error(&self, command: &str, error: &Error) {
        let types = if error.is_usage() {
            vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
        } else {
            vk::DebugUtilsMessageTypeFlagsEXT::GENERAL
        };
        self.report(
            vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
            types,
            error.message_id(),
            &format!("{command}: {error}"),
        );
    }

    /// As [`DebugMessenger::submit`], with a message of the driver.
    pub(crate) fn report(
        &self,
        severity: vk::DebugUtilsMessageSeverityFlagsEXT,
        types: vk::DebugUtilsMessageTypeFlagsEXT,
        id: &str,
        message: &str,
    ) {
        let id = c_string(id);
        let message = c_string(message);
        let data = vk::DebugUtilsMessengerCallbackDataEXT::default()
            .message_id_name(&id)
            .message(&message);
        // SAFETY: the strings outlive the call; the messenger is registered, so its callback is callable.
        unsafe { self.submit(severity, types, &data) };
    }
}

/// The text up to its first zero byte.
fn c_string(text: &str) -> CString {
    let end = text.find('\0').unwrap_or(text.len());
    CString::new(&text[..end]).unwrap_or_default()
}

/// Creates an instance from a valid creation info.
unsafe fn new_instance(info: &vk::InstanceCreateInfo<'_>) -> Result<Arc<Instance>, Error> {
    // SAFETY: the caller promises a valid creation info, and so valid arrays of strings.
    let (layers, names) = unsafe {
        (
            valid::slice(info.pp_enabled_layer_names, info.enabled_layer_count)?,
            valid::strings(
                info.pp_enabled_extension_names,
                info.enabled_extension_count,
            )?,
        )
    };
    if !layers.is_empty() {
        return Err(Error::LayerNotPresent("in the driver".to_owned()));
    }
    // SAFETY: as above.
    let application = unsafe { valid::optional(info.p_application_info) };
    Instance::new(
        application.map_or(0, |application| application.api_version),
        &names,
    )
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
pub(crate) unsafe fn create_instance(
    create_info: &vk::InstanceCreateInfo<'_>,
) -> Result<Arc<Instance>, Error> {
    // SAFETY: the caller's promise.
    unsafe { new_instance(create_info) }.inspect_err(|error| {
        // Messengers in the chain receive errors of the creation of the instance itself.
        // SAFETY: the caller's promise.
        let messengers = unsafe { valid::chain(create_info.p_next) }
            .filter_map(valid::cast::<vk::DebugUtilsMessengerCreateInfoEXT<'_>>);
        for messenger in messengers {
            DebugMessenger::new(messenger).report_error("vkCreateInstance", error);
        }
    })
}

#[doc(alias = "vkEnumeratePhysicalDevices")]
pub(crate) fn enumerate_physical_devices(
    instance: &Instance,
) -> Result<[vk::PhysicalDevice; 1], Error> {
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
    instance.add_messenger(Arc::clone(&created));
    Ok(created)
}

#[doc(alias = "vkDestroyDebugUtilsMessengerEXT")]
pub(crate) fn destroy_debug_utils_messenger(
    instance: &Instance,
    messenger: Option<Arc<DebugMessenger>>,
) -> Result<(), Error> {
    if let Some(messenger) = messenger {
        instance.remove_messenger(&messenger);
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
    for messenger in instance.messengers() {
        // SAFETY: the caller's promise.
        unsafe { messenger.submit(message_severity, message_types, callback_data) };
    }
    Ok(())
}
