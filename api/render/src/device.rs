//! Instance, device and queue.

use std::ffi::CStr;

use ash::vk;
use gaurast::gaussian_primitive_topology;
use gaurast::vk::{
    PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as GaussianFeatures,
    PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST as GaussianProperties,
};

use crate::error::{During, RenderError};
use crate::options::DeviceOptions;

/// An instance, which outlives everything made from it.
struct Instance {
    raw: ash::Instance,
    /// The functions of debug messengers and the messenger, if the driver has them.
    messenger: Option<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    /// The receivers of messages and of the device's work, which have an address of their own.
    _options: Box<DeviceOptions>,
    /// The last field, so that it is dropped last: it may own the library that `raw` calls.
    _entry: ash::Entry,
}

impl Instance {
    fn new(entry: ash::Entry, options: &DeviceOptions) -> Result<Self, RenderError> {
        let options = Box::new(options.clone());
        let application = vk::ApplicationInfo::default().application_name(c"gaurast").api_version(vk::API_VERSION_1_3);
        let (mut of_driver, mut of_messenger) = (options.of_driver(), options.messenger());
        let mut create_info = vk::InstanceCreateInfo::default().application_info(&application);
        if let Some(of_driver) = &mut of_driver {
            create_info = create_info.push_next(of_driver);
        }
        let debug_utils = [ash::ext::debug_utils::NAME.as_ptr()];
        let has_messages = has_messages(&entry)?;
        if has_messages {
            create_info = create_info.enabled_extension_names(&debug_utils).push_next(&mut of_messenger);
        }
        // SAFETY: the structures are valid; `_entry` and `_options` outlive the instance.
        let raw = unsafe { entry.create_instance(&create_info, None) }.during("vkCreateInstance")?;
        let mut instance = Self { raw, messenger: None, _options: options, _entry: entry };
        if has_messages {
            let functions = ash::ext::debug_utils::Instance::new(&instance._entry, &instance.raw);
            // SAFETY: the extension is enabled, and the options outlive the messenger.
            let messenger = unsafe { functions.create_debug_utils_messenger(&instance._options.messenger(), None) };
            instance.messenger = Some((functions, messenger.during("vkCreateDebugUtilsMessengerEXT")?));
        }
        Ok(instance)
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: the device, the only other child, has been destroyed before.
        unsafe {
            if let Some((functions, messenger)) = &self.messenger {
                functions.destroy_debug_utils_messenger(*messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}

/// Returns true if the entry's drivers or layers report messages.
fn has_messages(entry: &ash::Entry) -> Result<bool, RenderError> {
    // SAFETY: the entry is valid.
    let extensions = unsafe { entry.enumerate_instance_extension_properties(None) }
        .during("vkEnumerateInstanceExtensionProperties")?;
    let is_it =
        |extension: &vk::ExtensionProperties| extension.extension_name_as_c_str() == Ok(ash::ext::debug_utils::NAME);
    Ok(extensions.iter().any(is_it))
}

/// The purpose of a device.
#[derive(Clone, Copy, Debug)]
pub enum Purpose<'a> {
    /// Drawing with the Gaussian primitive topology.
    Gaussians,
    /// Drawing triangles only, on the first device whose name contains this text.
    Triangles(&'a str),
}

/// A logical device, its queue, and its properties.
pub struct Device {
    raw: ash::Device,
    queue: vk::Queue,
    /// The functions of performance queries; None if the device doesn't support them.
    performance: Option<ash::khr::performance_query::Device>,
    physical: PhysicalDevice,
    /// The last field, so that it is dropped last: the device is its child.
    instance: Instance,
}

/// The names of the entry's devices that draw Gaussians.
///
/// # Errors
/// If Vulkan fails.
pub fn device_names(entry: ash::Entry) -> Result<Vec<String>, RenderError> {
    let instance = Instance::new(entry, &DeviceOptions::default())?;
    // SAFETY: the instance is alive.
    let handles = unsafe { instance.raw.enumerate_physical_devices() }.during("vkEnumeratePhysicalDevices")?;
    let mut names = Vec::new();
    for handle in handles {
        // SAFETY: the handle was just enumerated.
        let properties = unsafe { instance.raw.get_physical_device_properties(handle) };
        let name = properties.device_name_as_c_str().unwrap_or_default().to_string_lossy().into_owned();
        if PhysicalDevice::suitable(&instance.raw, handle, &properties, &name, Purpose::Gaussians)?.is_some() {
            names.push(name);
        }
    }
    Ok(names)
}

/// The properties of a memory type that serves a resource.
#[derive(Clone, Copy, Debug)]
pub struct MemoryPreference {
    /// The properties that it must have.
    pub required: vk::MemoryPropertyFlags,
    /// The properties that it must not have.
    pub excluded: vk::MemoryPropertyFlags,
}

impl MemoryPreference {
    /// Types that have these properties, whatever else they have.
    pub const fn having(required: vk::MemoryPropertyFlags) -> Self {
        Self { required, excluded: vk::MemoryPropertyFlags::empty() }
    }
}

/// A physical device and its queue family.
struct PhysicalDevice {
    handle: vk::PhysicalDevice,
    queue_family: u32,
    name: String,
    counts: bool,
    max_size: u32,
    max_gaussians: u64,
    max_sh_degree: u32,
    /// True if it draws lenses that distort.
    distorts: bool,
    /// True if it has the unscented transform with any sigma points.
    has_sigma_points: bool,
    has_surfel_cut_off: bool,
    /// True if it decodes attributes, and buffers have addresses, at which tables are.
    decodes: bool,
    memory: vk::PhysicalDeviceMemoryProperties,
}

impl Device {
    /// Creates a device on the first physical device of `entry` that serves the purpose.
    ///
    /// # Errors
    /// Returns an error if there is none, or Vulkan fails.
    pub fn new(entry: ash::Entry, purpose: Purpose<'_>, options: &DeviceOptions) -> Result<Self, RenderError> {
        let instance = Instance::new(entry, options)?;
        let physical = PhysicalDevice::choose(&instance.raw, purpose, &options.device)?;

        let priorities = [1.0];
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(physical.queue_family)
            .queue_priorities(&priorities)];
        let mut extensions = Vec::new();
        // Every feature of the extension is enabled if it is supported.
        let mut gaussian = GaussianFeatures::default();
        let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut gaussian);
        // SAFETY: the structures are valid; a device without the extension leaves its structure as it is.
        unsafe {
            (instance.raw).get_physical_device_features2(physical.handle, &mut features);
        }
        gaussian.p_next = std::ptr::null_mut();
        let mut rendering = vk::PhysicalDeviceDynamicRenderingFeatures::default().dynamic_rendering(true);
        let mut counting =
            vk::PhysicalDevicePerformanceQueryFeaturesKHR::default().performance_counter_query_pools(true);
        if matches!(purpose, Purpose::Gaussians) {
            extensions.push(gaussian_primitive_topology::NAME.as_ptr());
        }
        if physical.counts {
            extensions.push(ash::khr::performance_query::NAME.as_ptr());
        }
        let mut create_info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions)
            .push_next(&mut rendering);
        if matches!(purpose, Purpose::Gaussians) {
            create_info = create_info.push_next(&mut gaussian);
        }
        if physical.counts {
            create_info = create_info.push_next(&mut counting);
        }
        let mut addresses = vk::PhysicalDeviceBufferDeviceAddressFeatures::default().buffer_device_address(true);
        if physical.decodes {
            create_info = create_info.push_next(&mut addresses);
        }
        // SAFETY: the structures are valid, and the physical device has what is enabled.
        let raw =
            unsafe { instance.raw.create_device(physical.handle, &create_info, None) }.during("vkCreateDevice")?;
        Ok(Self {
            // SAFETY: the queue was requested at creation.
            queue: unsafe { raw.get_device_queue(physical.queue_family, 0) },
            performance: physical.counts.then(|| ash::khr::performance_query::Device::new(&instance.raw, &raw)),
            raw,
            physical,
            instance,
        })
    }

    /// The device's functions.
    pub fn raw(&self) -> &ash::Device {
        &self.raw
    }

    /// The queue; the device has only one.
    pub fn queue(&self) -> vk::Queue {
        self.queue
    }

    /// The queue's family.
    pub fn queue_family(&self) -> u32 {
        self.physical.queue_family
    }

    /// The functions of the Gaussian primitive topology, for a device created to draw Gaussians.
    pub fn gaussian_functions(&self) -> gaussian_primitive_topology::Device {
        gaussian_primitive_topology::Device::new(&self.instance.raw, &self.raw)
    }

    /// The functions of performance queries, if the device supports them.
    pub(super) fn performance(&self) -> Option<&ash::khr::performance_query::Device> {
        self.performance.as_ref()
    }

    /// The device's name.
    pub fn name(&self) -> &str {
        &self.physical.name
    }

    /// The greatest width and height of an attachment.
    pub(super) fn max_size(&self) -> u32 {
        self.physical.max_size
    }

    pub(super) fn max_gaussians(&self) -> u64 {
        self.physical.max_gaussians
    }

    pub(super) fn max_sh_degree(&self) -> u32 {
        self.physical.max_sh_degree
    }

    /// Returns true if the device draws lenses that distort.
    pub(super) fn distorts(&self) -> bool {
        self.physical.distorts
    }

    /// Returns true if the device decodes attributes.
    pub(super) fn decodes(&self) -> bool {
        self.physical.decodes
    }

    /// Returns true if the device has the unscented transform with any sigma points.
    pub(super) fn has_sigma_points(&self) -> bool {
        self.physical.has_sigma_points
    }

    /// Returns true if the device cuts off 2D Gaussians.
    pub(super) fn has_surfel_cut_off(&self) -> bool {
        self.physical.has_surfel_cut_off
    }

    /// The first memory type allowed by `type_bits` that fits one of `preferences`, tried in order.
    pub fn memory_type(&self, type_bits: u32, preferences: &[MemoryPreference]) -> Option<u32> {
        let types = self.physical.memory.memory_types_as_slice();
        preferences.iter().find_map(|preference| {
            (0..types.len() as u32).find(|index| {
                let flags = types[*index as usize].property_flags;
                let fits = flags.contains(preference.required) && !flags.intersects(preference.excluded);
                type_bits & (1 << index) != 0 && fits
            })
        })
    }

    /// The queue's counters, with their descriptions.
    pub(super) fn counters(&self) -> Result<Vec<CounterDescription>, RenderError> {
        let instance = ash::khr::performance_query::Instance::new(&self.instance._entry, &self.instance.raw);
        let (device, family) = (self.physical.handle, self.physical.queue_family);
        // SAFETY: the physical device has the extension, and the family exists.
        let count =
            unsafe { instance.enumerate_physical_device_queue_family_performance_query_counters_len(device, family) }
                .during("vkEnumeratePhysicalDeviceQueueFamilyPerformanceQueryCountersKHR")?;
        let mut counters = vec![vk::PerformanceCounterKHR::default(); count];
        let mut descriptions = vec![vk::PerformanceCounterDescriptionKHR::default(); count];
        // SAFETY: as above; both arrays hold default structures.
        unsafe {
            instance.enumerate_physical_device_queue_family_performance_query_counters(
                device,
                family,
                &mut counters,
                &mut descriptions,
            )
        }
        .during("vkEnumeratePhysicalDeviceQueueFamilyPerformanceQueryCountersKHR")?;
        let text = |array: &[std::ffi::c_char]| {
            CStr::from_bytes_until_nul(bytemuck::cast_slice(array)).unwrap_or_default().to_string_lossy().into_owned()
        };
        Ok(counters
            .iter()
            .zip(&descriptions)
            .map(|(counter, description)| CounterDescription {
                category: text(&description.category),
                name: text(&description.name),
                description: text(&description.description),
                impacting: description.flags.contains(vk::PerformanceCounterDescriptionFlagsKHR::PERFORMANCE_IMPACTING),
                unit: counter.unit,
                storage: counter.storage,
            })
            .collect())
    }

    /// The number of submissions that are needed to count what `create_info` names.
    pub(super) fn counter_passes(&self, create_info: &vk::QueryPoolPerformanceCreateInfoKHR<'_>) -> u32 {
        let instance = ash::khr::performance_query::Instance::new(&self.instance._entry, &self.instance.raw);
        // SAFETY: the physical device has the extension, and the structure names its counters.
        unsafe { instance.get_physical_device_queue_family_performance_query_passes(self.physical.handle, create_info) }
    }
}

/// A counter as the device enumerates it.
#[derive(Clone)]
pub(super) struct CounterDescription {
    pub(super) category: String,
    pub(super) name: String,
    pub(super) description: String,
    /// True if counting it changes performance.
    pub(super) impacting: bool,
    pub(super) unit: vk::PerformanceCounterUnitKHR,
    pub(super) storage: vk::PerformanceCounterStorageKHR,
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: every object made from the device holds it alive, so there is none left, and
        // every submission is waited for.
        unsafe { self.raw.destroy_device(None) };
    }
}

impl PhysicalDevice {
    /// The first physical device with `part` in its name that serves the purpose and has a graphics queue.
    fn choose(instance: &ash::Instance, purpose: Purpose<'_>, part: &str) -> Result<Self, RenderError> {
        // SAFETY: the instance is alive.
        let handles = unsafe { instance.enumerate_physical_devices() }.during("vkEnumeratePhysicalDevices")?;
        let mut found = Vec::new();
        for handle in handles {
            // SAFETY: the handle was just enumerated.
            let properties = unsafe { instance.get_physical_device_properties(handle) };
            let name = properties.device_name_as_c_str().unwrap_or_default().to_string_lossy().into_owned();
            if !name.contains(part) {
                found.push(name);
                continue;
            }
            if let Some(physical) = Self::suitable(instance, handle, &properties, &name, purpose)? {
                return Ok(physical);
            }
            found.push(name);
        }
        let found = if found.is_empty() { "none at all".to_owned() } else { found.join(", ") };
        Err(match purpose {
            Purpose::Gaussians if part.is_empty() => RenderError::NoDevice { found },
            Purpose::Gaussians => RenderError::NoSuchDevice { name: part.to_owned(), found },
            Purpose::Triangles(name) => RenderError::NoSuchDevice { name: name.to_owned(), found },
        })
    }

    fn suitable(
        instance: &ash::Instance,
        handle: vk::PhysicalDevice,
        properties: &vk::PhysicalDeviceProperties,
        name: &str,
        purpose: Purpose<'_>,
    ) -> Result<Option<Self>, RenderError> {
        // SAFETY: the handle is the instance's.
        let extensions = unsafe { instance.enumerate_device_extension_properties(handle) }
            .during("vkEnumerateDeviceExtensionProperties")?;
        let has = |name: &CStr| extensions.iter().any(|extension| extension.extension_name_as_c_str() == Ok(name));
        let serves = match purpose {
            Purpose::Gaussians => has(gaussian_primitive_topology::NAME),
            Purpose::Triangles(text) => name.contains(text),
        };
        if !serves || properties.api_version < vk::API_VERSION_1_3 {
            return Ok(None);
        }
        // SAFETY: the handle is the instance's.
        let families = unsafe { instance.get_physical_device_queue_family_properties(handle) };
        let graphics = families.iter().position(|family| family.queue_flags.contains(vk::QueueFlags::GRAPHICS));
        let Some(queue_family) = graphics else {
            return Ok(None);
        };
        // A device without the extension leaves its limits at zero.
        let mut gaussian = GaussianProperties::default();
        let mut chain = vk::PhysicalDeviceProperties2::default();
        if has(gaussian_primitive_topology::NAME) {
            chain = chain.push_next(&mut gaussian);
        }
        // SAFETY: the chain holds structures of extensions that the device has.
        unsafe { instance.get_physical_device_properties2(handle, &mut chain) };
        let draws_gaussians = matches!(purpose, Purpose::Gaussians);
        let counts = draws_gaussians && has(ash::khr::performance_query::NAME) && {
            let mut counting = vk::PhysicalDevicePerformanceQueryFeaturesKHR::default();
            let mut chain = vk::PhysicalDeviceFeatures2::default().push_next(&mut counting);
            // SAFETY: as above.
            unsafe { instance.get_physical_device_features2(handle, &mut chain) };
            counting.performance_counter_query_pools == vk::TRUE
        };
        let mut features = GaussianFeatures::default();
        let mut addresses = vk::PhysicalDeviceBufferDeviceAddressFeatures::default();
        if draws_gaussians && has(gaussian_primitive_topology::NAME) {
            let mut chain = vk::PhysicalDeviceFeatures2::default().push_next(&mut features).push_next(&mut addresses);
            // SAFETY: as above.
            unsafe { instance.get_physical_device_features2(handle, &mut chain) };
        }
        let limits = &properties.limits;
        let max_size = [
            limits.max_image_dimension2_d,
            limits.max_framebuffer_width,
            limits.max_framebuffer_height,
            limits.max_viewport_dimensions[0],
            limits.max_viewport_dimensions[1],
        ];
        Ok(Some(Self {
            handle,
            queue_family: queue_family as u32,
            name: name.to_owned(),
            counts,
            max_size: max_size.into_iter().min().unwrap_or_default(),
            max_gaussians: gaussian.max_gaussians_per_draw,
            max_sh_degree: gaussian.max_spherical_harmonics_degree,
            distorts: features.gaussian_distortion == vk::TRUE,
            decodes: [features.attribute_decoding, addresses.buffer_device_address] == [vk::TRUE; 2],
            has_surfel_cut_off: features.gaussian_2d_cut_off == vk::TRUE,
            has_sigma_points: [features.unscented_projection, features.unscented_parameters] == [vk::TRUE; 2],
            // SAFETY: the handle is the instance's.
            memory: unsafe { instance.get_physical_device_memory_properties(handle) },
        }))
    }
}
