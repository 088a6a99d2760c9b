//! Devices to test: a Vulkan instance, device and queue, and what a Gaussian draw needs around it.
//!
//! Everything here is an ordinary application of the driver. `unsafe` has one reason throughout:
//! these are Vulkan calls on objects of one [`Context`], which every resource keeps alive, and
//! every submission is waited for before a resource can go. What a test records stays within
//! Vulkan's valid usage; a draw beyond its buffers would be a mistake in the test, which the driver
//! answers with zeros, not with foreign memory.

pub(crate) mod gaussian;
mod pass;
mod resource;
mod settings;

pub use gaussian::{DeviceScene, Instance, Pipeline, PipelineOptions, over, replace};
pub use pass::{Commands, Pass, PassObject};
pub use resource::{Buffer, Target};
pub use settings::{Settings, with_settings};

use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;
use gaurast::gaussian_primitive_topology;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as GaussianFeatures;

/// A message that a debug messenger heard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// The message's id name, such as a VUID.
    pub id: String,
    /// What it says.
    pub text: String,
}

/// What a messenger has heard, and what hears it: its user data.
pub(crate) type Messages = Mutex<Vec<Message>>;

/// A device with one queue, on which tests draw. Cheap to clone; the last one destroys it.
#[derive(Clone)]
pub struct Context(Arc<Shared>);

struct Shared {
    pool: vk::CommandPool,
    queue: vk::Queue,
    gaussian: gaussian_primitive_topology::Device,
    device: ash::Device,
    memory: vk::PhysicalDeviceMemoryProperties,
    messenger: vk::DebugUtilsMessengerEXT,
    debug_utils: ash::ext::debug_utils::Instance,
    instance: ash::Instance,
    /// The messenger's user data.
    messages: Box<Messages>,
    /// Last: it may own the library that all others call.
    _entry: ash::Entry,
}

impl Context {
    /// A device of the driver that is linked into the test, with workers as `settings` say.
    pub fn embedded(settings: &Settings) -> Self {
        with_settings(settings, || Self::new(vulkan_gaurast::entry(), &[]))
    }

    /// The first device of `entry` that draws Gaussians, under `layers`. Warnings and errors are
    /// kept as [`Context::messages`].
    ///
    /// # Panics
    /// If there is none, or Vulkan fails.
    pub fn new(entry: ash::Entry, layers: &[&CStr]) -> Self {
        let messages = Box::<Messages>::default();
        let mut messenger_info = messenger_info(&messages);
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let layers: Vec<_> = layers.iter().map(|layer| layer.as_ptr()).collect();
        let extensions = [ash::ext::debug_utils::NAME.as_ptr()];
        let create_info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions);
        let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
        let extensions = [gaussian_primitive_topology::NAME.as_ptr()];
        let mut gaussian = GaussianFeatures::default()
            .gaussian_primitive_topology(true)
            .opacity_compensation(true)
            .radial_distance_order(true)
            .primitive_order(true)
            .per_pixel_order(true)
            .gaussian_2d(true)
            .rasterization_float16(true)
            .gaussian_approximation(true)
            .orthographic_camera(true)
            .fisheye_camera(true)
            .equirectangular_camera(true)
            .gaussian_instancing(true)
            .merged_draws(true)
            .unscented_projection(true);
        let mut vulkan_1_3 = vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true);
        let device_info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions)
            .push_next(&mut vulkan_1_3)
            .push_next(&mut gaussian);
        // SAFETY: see the module; the messages outlive the messenger that writes to them.
        unsafe {
            let instance_info = create_info.push_next(&mut messenger_info);
            let instance = entry
                .create_instance(&instance_info, None)
                .expect("an instance");
            let debug_utils = ash::ext::debug_utils::Instance::new(&entry, &instance);
            let messenger = debug_utils
                .create_debug_utils_messenger(&self::messenger_info(&messages), None)
                .expect("a messenger");
            let physical_device = physical_device(&instance);
            let device = instance
                .create_device(physical_device, &device_info, None)
                .expect("a device");
            let pool_info = vk::CommandPoolCreateInfo::default();
            Self(Arc::new(Shared {
                pool: device
                    .create_command_pool(&pool_info, None)
                    .expect("a command pool"),
                queue: device.get_device_queue(0, 0),
                gaussian: gaussian_primitive_topology::Device::new(&instance, &device),
                memory: instance.get_physical_device_memory_properties(physical_device),
                device,
                messenger,
                debug_utils,
                instance,
                messages,
                _entry: entry,
            }))
        }
    }

    /// The device's functions.
    pub fn device(&self) -> &ash::Device {
        &self.0.device
    }

    /// The extension's functions.
    pub fn gaussian(&self) -> &gaussian_primitive_topology::Device {
        &self.0.gaussian
    }

    /// The warnings and errors heard since the last call.
    pub fn messages(&self) -> Vec<Message> {
        std::mem::take(&mut lock(&self.0.messages))
    }

    /// Records commands, submits them and waits for their end.
    pub fn run(&self, record: impl FnOnce(&Commands<'_>)) {
        let (device, queue) = (self.device(), self.0.queue);
        let allocate_info = vk::CommandBufferAllocateInfo::default()
            .command_pool(self.0.pool)
            .level(vk::CommandBufferLevel::PRIMARY)
            .command_buffer_count(1);
        let begin_info = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: see the module.
        unsafe {
            let buffers = device
                .allocate_command_buffers(&allocate_info)
                .expect("a command buffer");
            device
                .begin_command_buffer(buffers[0], &begin_info)
                .expect("it begins");
            record(&Commands::new(self, buffers[0]));
            device.end_command_buffer(buffers[0]).expect("it ends");
            let submits = [vk::SubmitInfo::default().command_buffers(&buffers)];
            device
                .queue_submit(queue, &submits, vk::Fence::null())
                .expect("it is submitted");
            device.queue_wait_idle(queue).expect("it finishes");
            device.free_command_buffers(self.0.pool, &buffers);
        }
    }

    /// The first memory type of `bits` with all of `flags`, or the first of `bits`.
    fn memory_type(&self, bits: u32, flags: vk::MemoryPropertyFlags) -> u32 {
        let types = self.0.memory.memory_types_as_slice();
        let allowed = || (0..types.len() as u32).filter(|index| bits & (1 << index) != 0);
        allowed()
            .find(|&index| types[index as usize].property_flags.contains(flags))
            .or(allowed().next())
            .expect("resources have a memory type")
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        // SAFETY: see the module; every resource held this, so there is none left.
        unsafe {
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
            self.debug_utils
                .destroy_debug_utils_messenger(self.messenger, None);
            self.instance.destroy_instance(None);
        }
    }
}

/// The first physical device with the extension.
fn physical_device(instance: &ash::Instance) -> vk::PhysicalDevice {
    // SAFETY: see the module.
    let devices = unsafe { instance.enumerate_physical_devices() }.expect("physical devices");
    let draws_gaussians = |device: &vk::PhysicalDevice| {
        // SAFETY: see the module.
        let extensions = unsafe { instance.enumerate_device_extension_properties(*device) };
        extensions.expect("its extensions").iter().any(|extension| {
            extension.extension_name_as_c_str() == Ok(gaussian_primitive_topology::NAME)
        })
    };
    devices
        .into_iter()
        .find(draws_gaussians)
        .expect("a device that draws Gaussians")
}

/// A messenger that keeps warnings and errors in `messages`, which must outlive it.
pub(crate) fn messenger_info(messages: &Messages) -> vk::DebugUtilsMessengerCreateInfoEXT<'_> {
    use vk::{
        DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Type,
    };
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(Severity::WARNING | Severity::ERROR)
        .message_type(Type::GENERAL | Type::VALIDATION | Type::PERFORMANCE)
        .pfn_user_callback(Some(hear))
        .user_data(std::ptr::from_ref(messages).cast_mut().cast())
}

unsafe extern "system" fn hear(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user_data: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the caller passes valid data, and the user data of `messenger_info`.
    let (message, messages) = unsafe {
        let text = |text: Option<&CStr>| text.unwrap_or_default().to_string_lossy().into_owned();
        let message = Message {
            id: text((*data).message_id_name_as_c_str()),
            text: text((*data).message_as_c_str()),
        };
        (message, &*user_data.cast::<Messages>())
    };
    lock(messages).push(message);
    vk::FALSE
}

fn lock(messages: &Messages) -> std::sync::MutexGuard<'_, Vec<Message>> {
    messages.lock().unwrap_or_else(PoisonError::into_inner)
}
