//! Instances, and the commands that need none.

use crate::capabilities::extensions;
use crate::dispatch;
use crate::entry_points;
use crate::error::Error;
use crate::handle;
use crate::object::debug_messenger::DebugMessenger;
use crate::object::instance::Instance;
use crate::registry;
use crate::{pnext, pointer};
use ash::vk;
use std::ffi::{CStr, c_char};
use std::sync::Arc;

/// Creates an instance from a valid creation info.
unsafe fn new_instance(info: &vk::InstanceCreateInfo<'_>) -> Result<Arc<Instance>, Error> {
    // SAFETY: the caller promises a valid creation info, and so valid arrays of strings.
    let (layers, names) = unsafe {
        (
            pointer::slice(info.pp_enabled_layer_names, info.enabled_layer_count)?,
            pointer::strings(
                info.pp_enabled_extension_names,
                info.enabled_extension_count,
            )?,
        )
    };
    if !layers.is_empty() {
        return Err(Error::LayerNotPresent("in the driver".to_owned()));
    }
    // SAFETY: as above.
    let application = unsafe { pointer::optional(info.p_application_info) };
    Instance::new(
        application.map_or(0, |application| application.api_version),
        &names,
    )
}

entry_points! {
    #[doc(alias = "vkEnumerateInstanceVersion")]
    fn enumerate_instance_version(version: *mut u32) -> vk::Result {
        pointer::output(version, extensions::API_VERSION)
    }

    #[doc(alias = "vkEnumerateInstanceExtensionProperties")]
    fn enumerate_instance_extension_properties(
        layer: *const c_char,
        count: *mut u32,
        properties: *mut vk::ExtensionProperties,
    ) -> vk::Result {
        match pointer::string(layer) {
            None => pointer::enumerate(count, properties, &extensions::properties(registry::extensions::INSTANCE)),
            Some(layer) => Err(Error::LayerNotPresent(layer.to_string_lossy().into_owned())),
        }
    }

    #[doc(alias = "vkEnumerateInstanceLayerProperties")]
    fn enumerate_instance_layer_properties(
        count: *mut u32,
        properties: *mut vk::LayerProperties,
    ) -> vk::Result {
        pointer::enumerate(count, properties, &[])
    }

    #[doc(alias = "vkCreateInstance")]
    fn create_instance(
        info: *const vk::InstanceCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        instance: *mut vk::Instance,
    ) -> vk::Result {
        let info = pointer::input(info)?;
        match new_instance(info) {
            Ok(created) => pointer::output(instance, handle::create(created)),
            Err(error) => {
                // Messengers of the chain hear about the creation of the instance itself.
                let messengers = pnext::iter(info.p_next)
                    .filter_map(pnext::cast::<vk::DebugUtilsMessengerCreateInfoEXT<'_>>);
                for messenger in messengers {
                    DebugMessenger::new(messenger).report_error("vkCreateInstance", &error);
                }
                Err(error)
            }
        }
    }

    #[doc(alias = "vkEnumeratePhysicalDevices")]
    fn enumerate_physical_devices(
        instance: vk::Instance,
        count: *mut u32,
        physical_devices: *mut vk::PhysicalDevice,
    ) -> vk::Result {
        let instance = handle::get(instance)?;
        pointer::enumerate(count, physical_devices, &[instance.physical_device()])
    }

    #[doc(alias = "vkEnumeratePhysicalDeviceGroups")]
    fn enumerate_physical_device_groups(
        instance: vk::Instance,
        count: *mut u32,
        groups: *mut vk::PhysicalDeviceGroupProperties<'_>,
    ) -> vk::Result {
        let instance = handle::get(instance)?;
        pointer::enumerate_structures(count, groups, 1, |_, group| {
            group.physical_device_count = 1;
            group.physical_devices[0] = instance.physical_device();
            group.subset_allocation = vk::FALSE;
        })
    }

    #[doc(alias = "vkGetInstanceProcAddr")]
    fn get_instance_proc_addr(
        instance: vk::Instance,
        name: *const c_char,
    ) -> vk::PFN_vkVoidFunction {
        let name: &CStr = pointer::string(name).ok_or(Error::NullPointer { what: "name" })?;
        Ok(match handle::get_optional(instance)? {
            None => dispatch::global_command(name),
            Some(instance) => dispatch::instance_command(name, &instance.enabled()),
        })
    }
}
