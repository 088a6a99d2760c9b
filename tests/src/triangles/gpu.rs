//! A device that draws triangles: this driver's, by either door, or lavapipe's.

use std::ffi::CStr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::vk;
use gaurast::gaussian_primitive_topology;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as GaussianFeatures;

use super::Commands;
use crate::contexts::{Settings, with_settings};

/// A device with one queue and all features that it has. Cheap to clone; the last one destroys it.
#[derive(Clone)]
pub struct Gpu(Arc<Shared>);

struct Shared {
    name: String,
    queue: Mutex<vk::Queue>,
    family: u32,
    device: ash::Device,
    instance: ash::Instance,
    physical_device: vk::PhysicalDevice,
    memory: vk::PhysicalDeviceMemoryProperties,
    features: vk::PhysicalDeviceFeatures,
    limits: vk::PhysicalDeviceLimits,
    gaussian: Option<gaussian_primitive_topology::Device>,
    /// Last: it may own the library that all others call.
    _entry: ash::Entry,
}

/// Why there is no device.
#[derive(Clone, Debug, thiserror::Error)]
pub enum OpenError {
    /// There is no loader here.
    #[error("there is no Vulkan loader here: {0}")]
    NoLoader(String),
    /// The loader knows no such device.
    #[error("the Vulkan loader does not know {0}")]
    NoDevice(&'static str),
    /// Vulkan refused a step.
    #[error("Vulkan refused to {0}: {1}")]
    Refused(&'static str, vk::Result),
}

fn refused(what: &'static str) -> impl Fn(vk::Result) -> OpenError {
    move |result| OpenError::Refused(what, result)
}

impl Gpu {
    /// This driver, linked into the process.
    ///
    /// # Errors
    /// [`OpenError`] names the step that failed.
    pub fn embedded(settings: &Settings) -> Result<Self, OpenError> {
        with_settings(settings, || {
            Self::open(vulkan_gaurast::entry(), "a device", |_| true)
        })
    }

    /// This driver, linked into the process, with extensions and features of theirs beside those of the core version.
    ///
    /// # Errors
    /// [`OpenError`] names the step that failed.
    pub fn extended<T: vk::ExtendsDeviceCreateInfo>(
        extensions: &[&CStr],
        features: &mut T,
    ) -> Result<Self, OpenError> {
        with_settings(&Settings::default(), || {
            let entry = vulkan_gaurast::entry();
            Self::open_with(entry, "a device", |_| true, extensions, Some(features))
        })
    }

    /// This driver, through the loader. The process must have been started with its manifest in
    /// `VK_DRIVER_FILES`.
    ///
    /// # Errors
    /// [`OpenError`], for example where there is no loader.
    pub fn loaded() -> Result<Self, OpenError> {
        let is_own = |id: vk::DriverId| id != vk::DriverId::MESA_LLVMPIPE;
        Self::through_the_loader("this driver", is_own)
    }

    /// lavapipe, through the loader, sampling textures as accurately as it can if the process asks
    /// it to (see [`super::accurate_lavapipe`]).
    ///
    /// # Errors
    /// [`OpenError`], for example where there is no loader, or it does not know lavapipe.
    pub fn lavapipe() -> Result<Self, OpenError> {
        let is_lavapipe = |id| id == vk::DriverId::MESA_LLVMPIPE;
        Self::through_the_loader("lavapipe", is_lavapipe)
    }

    fn through_the_loader(
        wanted: &'static str,
        is_wanted: impl Fn(vk::DriverId) -> bool,
    ) -> Result<Self, OpenError> {
        with_settings(&Settings::default(), || {
            // SAFETY: the loader is the system's own.
            let entry = unsafe { ash::Entry::load() };
            let entry = entry.map_err(|error| OpenError::NoLoader(error.to_string()))?;
            Self::open(entry, wanted, is_wanted)
        })
    }

    fn open(
        entry: ash::Entry,
        wanted: &'static str,
        is_wanted: impl Fn(vk::DriverId) -> bool,
    ) -> Result<Self, OpenError> {
        let no_features = None::<&mut vk::PhysicalDeviceFeatures2<'_>>;
        Self::open_with(entry, wanted, is_wanted, &[], no_features)
    }

    fn open_with<T: vk::ExtendsDeviceCreateInfo>(
        entry: ash::Entry,
        wanted: &'static str,
        is_wanted: impl Fn(vk::DriverId) -> bool,
        extensions: &[&CStr],
        features: Option<&mut T>,
    ) -> Result<Self, OpenError> {
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&application);
        // SAFETY: the create infos are valid, and what is created lives as long as the instance.
        unsafe {
            let instance = entry
                .create_instance(&info, None)
                .map_err(refused("create an instance"))?;
            let found = find(&instance, is_wanted).and_then(|found| {
                let (physical_device, name) = found.ok_or(OpenError::NoDevice(wanted))?;
                let device = create_device(&instance, physical_device, extensions, features)?;
                Ok((physical_device, name, device))
            });
            let (physical_device, name, device) = match found {
                Ok(found) => found,
                Err(error) => {
                    instance.destroy_instance(None);
                    return Err(error);
                }
            };
            Ok(Self(Arc::new(Shared {
                name,
                queue: Mutex::new(device.get_device_queue(0, 0)),
                family: 0,
                memory: instance.get_physical_device_memory_properties(physical_device),
                features: instance.get_physical_device_features(physical_device),
                limits: instance
                    .get_physical_device_properties(physical_device)
                    .limits,
                gaussian: has_gaussians(&instance, physical_device)
                    .then(|| gaussian_primitive_topology::Device::new(&instance, &device)),
                device,
                physical_device,
                instance,
                _entry: entry,
            })))
        }
    }

    /// The driver's name and version.
    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// The device's functions.
    pub fn device(&self) -> &ash::Device {
        &self.0.device
    }

    /// The instance's functions.
    pub fn instance(&self) -> &ash::Instance {
        &self.0.instance
    }

    /// The physical device.
    pub fn physical_device(&self) -> vk::PhysicalDevice {
        self.0.physical_device
    }

    /// The features of Vulkan 1.0, all of which are enabled except robust access.
    pub fn features(&self) -> &vk::PhysicalDeviceFeatures {
        &self.0.features
    }

    /// The device's limits.
    pub fn limits(&self) -> &vk::PhysicalDeviceLimits {
        &self.0.limits
    }

    /// The functions of Gaussian draws, if the device has them.
    pub fn gaussian(&self) -> Option<&gaussian_primitive_topology::Device> {
        self.0.gaussian.as_ref()
    }

    /// What images of `format` with optimal tiling can be used for.
    pub fn format_features(&self, format: vk::Format) -> vk::FormatFeatureFlags {
        // SAFETY: the physical device is the instance's.
        unsafe {
            let instance = &self.0.instance;
            instance
                .get_physical_device_format_properties(self.0.physical_device, format)
                .optimal_tiling_features
        }
    }

    /// The first memory type of `bits` with all of `flags`.
    ///
    /// # Panics
    /// If there is none.
    pub(super) fn memory_type(&self, bits: u32, flags: vk::MemoryPropertyFlags) -> u32 {
        let types = self.0.memory.memory_types_as_slice();
        let fits = |index: &u32| {
            bits & (1 << index) != 0 && types[*index as usize].property_flags.contains(flags)
        };
        (0..types.len() as u32)
            .find(fits)
            .expect("a memory type that fits")
    }

    /// Records commands, submits them and waits for their end.
    pub fn run(&self, record: impl FnOnce(&Commands)) {
        self.record(record).submit();
    }

    /// Records commands that can be submitted any number of times. What they use must outlive them.
    pub fn record(&self, record: impl FnOnce(&Commands)) -> Recorded {
        let recorded = Recorded::new(self, vk::CommandBufferLevel::PRIMARY);
        let info = vk::CommandBufferBeginInfo::default();
        recorded.begin(&info);
        record(&Commands::new(self, recorded.raw));
        recorded.end();
        recorded
    }

    /// Records a secondary command buffer for a subpass or a render that `inheritance` describes.
    pub fn record_secondary(
        &self,
        inheritance: &vk::CommandBufferInheritanceInfo<'_>,
        record: impl FnOnce(&Commands),
    ) -> Recorded {
        let recorded = Recorded::new(self, vk::CommandBufferLevel::SECONDARY);
        let info = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::RENDER_PASS_CONTINUE)
            .inheritance_info(inheritance);
        recorded.begin(&info);
        record(&Commands::new(self, recorded.raw));
        recorded.end();
        recorded
    }

    fn queue(&self) -> MutexGuard<'_, vk::Queue> {
        self.0.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The first device whose driver is wanted, with its name and version.
fn find(
    instance: &ash::Instance,
    is_wanted: impl Fn(vk::DriverId) -> bool,
) -> Result<Option<(vk::PhysicalDevice, String)>, OpenError> {
    // SAFETY: the instance is alive.
    let devices = unsafe { instance.enumerate_physical_devices() };
    for device in devices.map_err(refused("list devices"))? {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
        // SAFETY: the physical device is the instance's.
        unsafe { instance.get_physical_device_properties2(device, &mut properties) };
        if is_wanted(driver.driver_id) {
            let text = |text: &CStr| text.to_string_lossy().into_owned();
            let name = text(driver.driver_name_as_c_str().unwrap_or_default());
            let version = text(driver.driver_info_as_c_str().unwrap_or_default());
            return Ok(Some((device, format!("{name} {version}"))));
        }
    }
    Ok(None)
}

/// Whether a device draws Gaussians.
fn has_gaussians(instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> bool {
    // SAFETY: the physical device is the instance's.
    let extensions = unsafe { instance.enumerate_device_extension_properties(physical_device) };
    let is_it = |extension: &vk::ExtensionProperties| {
        extension.extension_name_as_c_str() == Ok(gaussian_primitive_topology::NAME)
    };
    extensions.is_ok_and(|extensions| extensions.iter().any(is_it))
}

/// Creates a device with every core feature that it has except robust access, which costs time; with all features
/// of Gaussian draws, if it draws Gaussians; and with extensions and their features.
fn create_device<T: vk::ExtendsDeviceCreateInfo>(
    instance: &ash::Instance,
    physical_device: vk::PhysicalDevice,
    extensions: &[&CStr],
    extended: Option<&mut T>,
) -> Result<ash::Device, OpenError> {
    let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
    let mut vulkan_1_1 = vk::PhysicalDeviceVulkan11Features::default();
    let mut vulkan_1_2 = vk::PhysicalDeviceVulkan12Features::default();
    let mut vulkan_1_3 = vk::PhysicalDeviceVulkan13Features::default();
    let mut gaussian = GaussianFeatures::default();
    let has_gaussians = has_gaussians(instance, physical_device);
    let mut features = vk::PhysicalDeviceFeatures2::default()
        .push_next(&mut vulkan_1_1)
        .push_next(&mut vulkan_1_2)
        .push_next(&mut vulkan_1_3);
    if has_gaussians {
        features = features.push_next(&mut gaussian);
    }
    // SAFETY: the physical device is the instance's, and the create info is valid.
    unsafe {
        instance.get_physical_device_features2(physical_device, &mut features);
        let mut core = features.features;
        core.robust_buffer_access = vk::FALSE;
        // They are in a chain already.
        vulkan_1_1.p_next = std::ptr::null_mut();
        vulkan_1_2.p_next = std::ptr::null_mut();
        vulkan_1_3.p_next = std::ptr::null_mut();
        gaussian.p_next = std::ptr::null_mut();
        vulkan_1_3.robust_image_access = vk::FALSE;
        let mut names: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
        if has_gaussians {
            names.push(gaussian_primitive_topology::NAME.as_ptr());
        }
        let mut info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_features(&core)
            .push_next(&mut vulkan_1_1)
            .push_next(&mut vulkan_1_2)
            .push_next(&mut vulkan_1_3);
        info = info.enabled_extension_names(&names);
        if has_gaussians {
            info = info.push_next(&mut gaussian);
        }
        if let Some(extended) = extended {
            info = info.push_next(extended);
        }
        instance
            .create_device(physical_device, &info, None)
            .map_err(refused("create a device"))
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        // SAFETY: every resource keeps its device, so that none is left.
        unsafe {
            self.device.destroy_device(None);
            self.instance.destroy_instance(None);
        }
    }
}

/// A command buffer that is ready.
pub struct Recorded {
    gpu: Gpu,
    pool: vk::CommandPool,
    /// The command buffer.
    pub raw: vk::CommandBuffer,
}

impl Recorded {
    fn new(gpu: &Gpu, level: vk::CommandBufferLevel) -> Self {
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(gpu.0.family);
        // SAFETY: see `triangles`.
        unsafe {
            let pool = gpu
                .device()
                .create_command_pool(&info, None)
                .expect("a command pool");
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(pool)
                .level(level)
                .command_buffer_count(1);
            let buffers = gpu.device().allocate_command_buffers(&info);
            Self {
                gpu: gpu.clone(),
                pool,
                raw: buffers.expect("a command buffer")[0],
            }
        }
    }

    fn begin(&self, info: &vk::CommandBufferBeginInfo<'_>) {
        // SAFETY: see `triangles`.
        unsafe { self.gpu.device().begin_command_buffer(self.raw, info) }.expect("it begins");
    }

    fn end(&self) {
        // SAFETY: see `triangles`.
        unsafe { self.gpu.device().end_command_buffer(self.raw) }.expect("it ends");
    }

    /// Submits it and waits for its end.
    pub fn submit(&self) {
        let buffers = [self.raw];
        let submits = [vk::SubmitInfo::default().command_buffers(&buffers)];
        let queue = self.gpu.queue();
        // SAFETY: see `triangles`; the lock keeps other threads from the queue.
        unsafe {
            let device = self.gpu.device();
            device
                .queue_submit(*queue, &submits, vk::Fence::null())
                .expect("it is submitted");
            device.queue_wait_idle(*queue).expect("it finishes");
        }
    }
}

impl Drop for Recorded {
    fn drop(&mut self) {
        // SAFETY: see `triangles`.
        unsafe { self.gpu.device().destroy_command_pool(self.pool, None) };
    }
}
