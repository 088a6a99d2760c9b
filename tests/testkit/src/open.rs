//! Opening devices: instance, messenger, physical device, and a device with one queue.

use std::ffi::CStr;
use std::sync::Arc;

use ash::vk;
use gaurast::WorkTrace;
use gaurast::gaussian_primitive_topology;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as GaussianFeatures;

use crate::messages::Messages;
use crate::settings::Settings;

/// A driver that tests use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Driver {
    /// This driver, linked into the process.
    Embedded,
    /// This driver, through the loader.
    Loaded,
    /// lavapipe, through the loader.
    Lavapipe,
    /// Any driver that draws Gaussians, through the loader.
    Extended,
    /// Any driver, through the loader.
    Any,
}

impl Driver {
    fn name(self) -> &'static str {
        match self {
            Self::Embedded => "a device",
            Self::Loaded => "this driver",
            Self::Lavapipe => "lavapipe",
            Self::Extended => "a device that draws Gaussians",
            Self::Any => "any device",
        }
    }

    fn is(self, id: vk::DriverId) -> bool {
        match self {
            Self::Embedded | Self::Extended | Self::Any => true,
            Self::Loaded => id != vk::DriverId::MESA_LLVMPIPE,
            Self::Lavapipe => id == vk::DriverId::MESA_LLVMPIPE,
        }
    }

    fn entry(self) -> Result<ash::Entry, OpenError> {
        match self {
            Self::Embedded => Ok(vulkan_gaurast::entry()),
            Self::Loaded | Self::Lavapipe | Self::Extended | Self::Any => {
                // SAFETY: the loader is the system's own.
                unsafe { ash::Entry::load() }.map_err(|error| OpenError::NoLoader(error.to_string()))
            }
        }
    }
}

/// The options for opening a device. All supported features of the core versions are enabled in any case.
#[derive(Clone, Copy, Debug)]
pub struct Opening<'a> {
    /// The driver.
    pub driver: Driver,
    /// The settings of the embedded driver.
    pub settings: Settings<'a>,
    /// A part of the device's name; empty for any device.
    pub device: &'a str,
    /// Layers of the instance.
    pub layers: &'a [&'a CStr],
    /// Extensions of the device, in addition to Gaussian draws.
    pub extensions: &'a [&'a CStr],
    /// True to enable [`EXTENSIONS`] too, with all their supported features.
    pub all_extensions: bool,
    /// Features of Gaussian draws, or `None` for all that the device supports.
    pub gaussian: Option<GaussianFeatures<'static>>,
    /// True to make access beyond a resource's end robust. It costs time.
    pub robust: bool,
    /// True to enable nothing else but [`Opening::extensions`], without their features.
    pub bare: bool,
}

impl Opening<'_> {
    /// The default options for a driver: Gaussian draws if it has them, and no robust access.
    pub const fn of(driver: Driver) -> Self {
        Self {
            driver,
            settings: Settings::DEFAULT,
            device: "",
            layers: &[],
            extensions: &[],
            all_extensions: false,
            gaussian: None,
            robust: false,
            bare: false,
        }
    }
}

/// Extensions of this driver that tests use.
pub const EXTENSIONS: [&CStr; 11] = [
    ash::ext::external_memory_host::NAME,
    ash::khr::external_fence_fd::NAME,
    ash::khr::external_memory_fd::NAME,
    ash::khr::external_semaphore_fd::NAME,
    ash::khr::map_memory2::NAME,
    ash::khr::performance_query::NAME,
    ash::khr::push_descriptor::NAME,
    ash::ext::calibrated_timestamps::NAME,
    ash::ext::index_type_uint8::NAME,
    ash::ext::provoking_vertex::NAME,
    ash::ext::vertex_attribute_divisor::NAME,
];

/// The reason for which no device was opened.
#[derive(Clone, Debug, thiserror::Error)]
pub enum OpenError {
    /// The Vulkan loader is missing.
    #[error("there is no Vulkan loader here: {0}")]
    NoLoader(String),
    /// The loader finds no such device.
    #[error("the Vulkan loader does not know {0}")]
    NoDevice(&'static str),
    /// Vulkan refused a step.
    #[error("Vulkan refused to {0}: {1}")]
    Refused(&'static str, vk::Result),
}

pub(crate) fn refused(what: &'static str) -> impl Fn(vk::Result) -> OpenError {
    move |result| OpenError::Refused(what, result)
}

/// An instance and its device with their properties. Dropping it destroys them.
pub(crate) struct Opened {
    pub(crate) name: String,
    pub(crate) queue: vk::Queue,
    pub(crate) device: ash::Device,
    pub(crate) instance: ash::Instance,
    pub(crate) physical_device: vk::PhysicalDevice,
    pub(crate) memory: vk::PhysicalDeviceMemoryProperties,
    pub(crate) features: vk::PhysicalDeviceFeatures,
    pub(crate) limits: vk::PhysicalDeviceLimits,
    pub(crate) gaussian: Option<gaussian_primitive_topology::Device>,
    pub(crate) messages: Box<Messages>,
    messenger: vk::DebugUtilsMessengerEXT,
    /// The receiver of the device's work.
    _trace: Option<Arc<WorkTrace>>,
    debug_utils: ash::ext::debug_utils::Instance,
    /// Dropped last, because it may own the library of all functions above.
    pub(crate) entry: ash::Entry,
}

impl Opened {
    /// Opens a device. It uses `entry` if given, and enables `features` of extensions.
    pub(crate) fn new<T: vk::ExtendsDeviceCreateInfo>(
        entry: Option<ash::Entry>,
        opening: &Opening<'_>,
        features: Option<&mut T>,
    ) -> Result<Self, OpenError> {
        let driver = opening.driver;
        let entry = entry.map_or_else(|| driver.entry(), Ok)?;
        let messages = Box::<Messages>::default();
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let layers: Vec<_> = opening.layers.iter().map(|layer| layer.as_ptr()).collect();
        let extensions = [ash::ext::debug_utils::NAME.as_ptr()];
        let mut messenger_info = messages.messenger();
        let mut options = opening.settings.options();
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions)
            .push_next(&mut messenger_info);
        if driver == Driver::Embedded {
            info = info.push_next(&mut options);
        }
        // SAFETY: the create infos are valid, what is created lives as long as the instance, and the messages and the
        // trace outlive the messenger and the device that write to them.
        unsafe {
            let instance = entry.create_instance(&info, None).map_err(refused("create an instance"))?;
            let debug_utils = ash::ext::debug_utils::Instance::new(&entry, &instance);
            let messenger = debug_utils.create_debug_utils_messenger(&messages.messenger(), None);
            let found = messenger
                .map_err(refused("create a messenger"))
                .and_then(|_| find(&instance, opening))
                .and_then(|found| {
                    let (physical_device, name) = found.ok_or(OpenError::NoDevice(driver.name()))?;
                    let device = create_device(&instance, physical_device, opening, features)?;
                    Ok((physical_device, name, device))
                });
            let messenger = messenger.unwrap_or_default();
            let (physical_device, name, device) = match found {
                Ok(found) => found,
                Err(error) => {
                    debug_utils.destroy_debug_utils_messenger(messenger, None);
                    instance.destroy_instance(None);
                    return Err(error);
                }
            };
            let properties = instance.get_physical_device_properties(physical_device);
            Ok(Self {
                name,
                queue: device.get_device_queue(0, 0),
                memory: instance.get_physical_device_memory_properties(physical_device),
                features: instance.get_physical_device_features(physical_device),
                limits: properties.limits,
                gaussian: has_gaussians(&instance, physical_device)
                    .then(|| gaussian_primitive_topology::Device::new(&instance, &device)),
                device,
                physical_device,
                instance,
                messages,
                messenger,
                _trace: opening.settings.trace.cloned(),
                debug_utils,
                entry,
            })
        }
    }
}

impl Drop for Opened {
    fn drop(&mut self) {
        // SAFETY: every resource keeps its device, so that none is left.
        unsafe {
            self.device.destroy_device(None);
            self.debug_utils.destroy_debug_utils_messenger(self.messenger, None);
            self.instance.destroy_instance(None);
        }
    }
}

/// The first device of the requested driver and name, with its driver's name and version.
fn find(instance: &ash::Instance, opening: &Opening<'_>) -> Result<Option<(vk::PhysicalDevice, String)>, OpenError> {
    // SAFETY: the instance is alive.
    let devices = unsafe { instance.enumerate_physical_devices() };
    for device in devices.map_err(refused("list devices"))? {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
        // SAFETY: the physical device is the instance's.
        unsafe { instance.get_physical_device_properties2(device, &mut properties) };
        let text = |text: &CStr| text.to_string_lossy().into_owned();
        let own = properties.properties;
        let is_named = text(own.device_name_as_c_str().unwrap_or_default()).contains(opening.device);
        let draws = opening.driver != Driver::Extended || has_gaussians(instance, device);
        if opening.driver.is(driver.driver_id) && is_named && draws {
            let name = text(driver.driver_name_as_c_str().unwrap_or_default());
            let version = text(driver.driver_info_as_c_str().unwrap_or_default());
            return Ok(Some((device, format!("{name} {version}"))));
        }
    }
    Ok(None)
}

/// Returns true if a device draws Gaussians.
pub(crate) fn has_gaussians(instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> bool {
    // SAFETY: the physical device is the instance's.
    let extensions = unsafe { instance.enumerate_device_extension_properties(physical_device) };
    let is_it = |extension: &vk::ExtensionProperties| {
        extension.extension_name_as_c_str() == Ok(gaussian_primitive_topology::NAME)
    };
    extensions.is_ok_and(|extensions| extensions.iter().any(is_it))
}

/// Creates a device with every core feature that it supports, features of Gaussian draws if it has them, and extensions
/// with their features.
fn create_device<T: vk::ExtendsDeviceCreateInfo>(
    instance: &ash::Instance,
    physical_device: vk::PhysicalDevice,
    opening: &Opening<'_>,
    extended: Option<&mut T>,
) -> Result<ash::Device, OpenError> {
    let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
    let mut vulkan_1_1 = vk::PhysicalDeviceVulkan11Features::default();
    let mut vulkan_1_2 = vk::PhysicalDeviceVulkan12Features::default();
    let mut vulkan_1_3 = vk::PhysicalDeviceVulkan13Features::default();
    let mut gaussian = GaussianFeatures::default();
    let mut performance = vk::PhysicalDevicePerformanceQueryFeaturesKHR::default();
    let mut indices = vk::PhysicalDeviceIndexTypeUint8FeaturesKHR::default();
    let mut provoking = vk::PhysicalDeviceProvokingVertexFeaturesEXT::default();
    let mut divisor = vk::PhysicalDeviceVertexAttributeDivisorFeaturesKHR::default();
    let has_gaussians = has_gaussians(instance, physical_device);
    let mut names: Vec<_> = opening.extensions.iter().map(|name| name.as_ptr()).collect();
    if has_gaussians && !opening.bare {
        names.push(gaussian_primitive_topology::NAME.as_ptr());
    }
    let mut features = vk::PhysicalDeviceFeatures2::default()
        .push_next(&mut vulkan_1_1)
        .push_next(&mut vulkan_1_2)
        .push_next(&mut vulkan_1_3);
    if has_gaussians {
        features = features.push_next(&mut gaussian);
    }
    if opening.all_extensions {
        names.extend(EXTENSIONS.map(CStr::as_ptr));
        features = features
            .push_next(&mut performance)
            .push_next(&mut indices)
            .push_next(&mut provoking)
            .push_next(&mut divisor);
    }
    // SAFETY: the physical device is the instance's, and the create info is valid.
    unsafe {
        instance.get_physical_device_features2(physical_device, &mut features);
        let mut core = features.features;
        // This structure is already part of a chain.
        vulkan_1_1.p_next = std::ptr::null_mut();
        vulkan_1_2.p_next = std::ptr::null_mut();
        vulkan_1_3.p_next = std::ptr::null_mut();
        gaussian.p_next = std::ptr::null_mut();
        performance.p_next = std::ptr::null_mut();
        indices.p_next = std::ptr::null_mut();
        provoking.p_next = std::ptr::null_mut();
        divisor.p_next = std::ptr::null_mut();
        if !opening.robust {
            core.robust_buffer_access = vk::FALSE;
            vulkan_1_3.robust_image_access = vk::FALSE;
        }
        gaussian = opening.gaussian.unwrap_or(gaussian);
        if opening.bare {
            core = vk::PhysicalDeviceFeatures { robust_buffer_access: core.robust_buffer_access, ..Default::default() };
            vulkan_1_1 = vk::PhysicalDeviceVulkan11Features::default();
            vulkan_1_2 = vk::PhysicalDeviceVulkan12Features::default();
            vulkan_1_3 = vk::PhysicalDeviceVulkan13Features {
                robust_image_access: vulkan_1_3.robust_image_access,
                ..Default::default()
            };
            gaussian = opening.gaussian.unwrap_or_default();
        }
        let mut info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_features(&core)
            .enabled_extension_names(&names)
            .push_next(&mut vulkan_1_1)
            .push_next(&mut vulkan_1_2)
            .push_next(&mut vulkan_1_3);
        if has_gaussians && (!opening.bare || opening.gaussian.is_some()) {
            info = info.push_next(&mut gaussian);
        }
        if opening.all_extensions {
            info = info
                .push_next(&mut performance)
                .push_next(&mut indices)
                .push_next(&mut provoking)
                .push_next(&mut divisor);
        }
        if let Some(extended) = extended {
            info = info.push_next(extended);
        }
        instance.create_device(physical_device, &info, None).map_err(refused("create a device"))
    }
}
