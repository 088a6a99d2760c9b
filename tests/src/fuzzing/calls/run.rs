//! A device and the objects that a run has created.

use ash::vk;
use gaurast::gaussian_primitive_topology;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as GaussianFeatures;
use gaurast_testkit::Messages;

use crate::fuzzing::bytes::Bytes;

/// The greatest number of objects of each type.
pub(super) const OBJECTS: usize = 6;
pub(super) const FORMATS: [vk::Format; 6] = [
    vk::Format::R32G32B32A32_SFLOAT,
    vk::Format::R8G8B8A8_UNORM,
    vk::Format::B8G8R8A8_SRGB,
    vk::Format::D32_SFLOAT,
    vk::Format::D24_UNORM_S8_UINT,
    vk::Format::R16_UINT,
];

pub(super) const DEPTH_FORMATS: [vk::Format; 2] = [vk::Format::D32_SFLOAT, vk::Format::D24_UNORM_S8_UINT];

/// The result of a run.
#[derive(Clone, Debug, Default)]
pub struct Ended {
    /// Number of calls that returned success or have no result.
    pub succeeded: u32,
    /// Number of calls that returned an error.
    pub failed: u32,
    /// Number of submissions that were executed.
    pub submitted: u32,
    /// The reason for which the device was lost, if it was.
    pub lost: Option<String>,
}

pub(super) struct Resource<T> {
    pub(super) handle: T,
    pub(super) memory: vk::DeviceMemory,
    pub(super) format: vk::Format,
    pub(super) extent: [u32; 2],
}

/// A device and the objects that a run has created.
pub(super) struct Run {
    instance: ash::Instance,
    pub(super) device: ash::Device,
    pub(super) gaussian: gaussian_primitive_topology::Device,
    pub(super) types: vk::PhysicalDeviceMemoryProperties,
    pub(super) queue: vk::Queue,
    pool: vk::CommandPool,
    pub(super) commands: vk::CommandBuffer,
    pub(super) layout: vk::PipelineLayout,
    pub(super) queries: vk::QueryPool,
    pub(super) buffers: Vec<Resource<vk::Buffer>>,
    pub(super) images: Vec<(Resource<vk::Image>, vk::ImageView)>,
    pub(super) pipelines: Vec<vk::Pipeline>,
    pub(super) ended: Ended,
    /// A messenger that stores the reason of a device loss in `messages`.
    messenger: vk::DebugUtilsMessengerEXT,
    debug_utils: ash::ext::debug_utils::Instance,
    messages: Box<Messages>,
    /// Dropped last, because it may own the library of all functions above.
    _entry: ash::Entry,
}

// The reason for all `unsafe` here is the same: these are Vulkan calls with valid handles and valid pointers. The
// driver relies on nothing else; see the module.
impl Run {
    pub(super) fn new() -> Self {
        let entry = vulkan_gaurast::entry();
        // SAFETY: see above.
        unsafe {
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
            let extensions = [ash::ext::debug_utils::NAME.as_ptr()];
            let info =
                vk::InstanceCreateInfo::default().application_info(&application).enabled_extension_names(&extensions);
            let instance = entry.create_instance(&info, None).expect("an instance");
            let messages = Box::<Messages>::default();
            let debug_utils = ash::ext::debug_utils::Instance::new(&entry, &instance);
            let messenger = debug_utils.create_debug_utils_messenger(&messages.messenger(), None).expect("a messenger");
            let physical = instance.enumerate_physical_devices().expect("devices")[0];
            let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
            let extensions = [gaussian_primitive_topology::NAME.as_ptr()];
            let mut gaussian = GaussianFeatures::default()
                .gaussian_primitive_topology(true)
                .primitive_order(true)
                .radial_distance_order(true)
                .orthographic_camera(true)
                .fisheye_camera(true)
                .equirectangular_camera(true)
                .per_pixel_order(true)
                .rasterization_float16(true)
                .unscented_projection(true)
                .gaussian_2d(true)
                .gaussian_distortion(true)
                .gaussian_depth_stencil(true)
                .gaussian_multisample(true)
                .gaussian_approximation(true);
            let mut core = vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true);
            // Core features and resets of command buffers are used without being enabled.
            let info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .enabled_extension_names(&extensions)
                .push_next(&mut core)
                .push_next(&mut gaussian);
            let device = instance.create_device(physical, &info, None).expect("a device");
            let pool = device.create_command_pool(&vk::CommandPoolCreateInfo::default(), None).expect("a pool");
            let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
            let commands = device.allocate_command_buffers(&info).expect("a command buffer")[0];
            let constants = [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::VERTEX).size(16)];
            let layout = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&constants);
            let queries = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(4);
            Self {
                gaussian: gaussian_primitive_topology::Device::new(&instance, &device),
                types: instance.get_physical_device_memory_properties(physical),
                queue: device.get_device_queue(0, 0),
                layout: device.create_pipeline_layout(&layout, None).expect("a layout"),
                queries: device.create_query_pool(&queries, None).expect("queries"),
                instance,
                device,
                pool,
                commands,
                buffers: Vec::new(),
                images: Vec::new(),
                pipelines: Vec::new(),
                ended: Ended::default(),
                messenger,
                debug_utils,
                messages,
                _entry: entry,
            }
        }
    }

    /// Counts the result of a call.
    pub(super) fn note<T>(&mut self, result: ash::prelude::VkResult<T>) -> Option<T> {
        match result {
            Ok(value) => {
                self.ended.succeeded += 1;
                Some(value)
            }
            Err(error) => {
                self.ended.failed += 1;
                if error == vk::Result::ERROR_DEVICE_LOST && self.ended.lost.is_none() {
                    self.ended.lost = Some(self.reason());
                }
                // UNKNOWN means a defect of the driver, or a handle that it does not know.
                assert_ne!(error, vk::Result::ERROR_UNKNOWN);
                None
            }
        }
    }

    /// The driver's message about the loss of the device.
    fn reason(&self) -> String {
        let messages = self.messages.take();
        let said = messages.iter().find(|it| it.id == "GAURAST-device-lost");
        said.map_or_else(|| "nothing was said".to_owned(), |it| it.text.clone())
    }

    pub(super) fn destroy(&mut self, bytes: &mut Bytes<'_>) {
        // No object is in use: submissions were waited for, and the command buffer is recorded anew.
        self.reset();
        // SAFETY: see above.
        unsafe {
            if bytes.rarely(2) && !self.buffers.is_empty() {
                let buffer = self.buffers.swap_remove(bytes.below(self.buffers.len()));
                self.device.destroy_buffer(buffer.handle, None);
                self.device.free_memory(buffer.memory, None);
            } else if !self.images.is_empty() {
                let (image, view) = self.images.swap_remove(bytes.below(self.images.len()));
                self.device.destroy_image_view(view, None);
                self.device.destroy_image(image.handle, None);
                self.device.free_memory(image.memory, None);
            }
        }
    }

    pub(super) fn reset(&mut self) {
        let flags = vk::CommandBufferResetFlags::empty();
        // SAFETY: see above.
        let reset = unsafe { self.device.reset_command_buffer(self.commands, flags) };
        self.note(reset);
    }

    pub(super) fn begin(&mut self, bytes: &mut Bytes<'_>) {
        let flags = bytes.one(&[vk::CommandBufferUsageFlags::empty(), vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT]);
        let info = vk::CommandBufferBeginInfo::default().flags(flags);
        // SAFETY: see above.
        let begun = unsafe { self.device.begin_command_buffer(self.commands, &info) };
        self.note(begun);
    }

    pub(super) fn submit(&mut self) {
        let commands = [self.commands];
        let submits = [vk::SubmitInfo::default().command_buffers(&commands)];
        // SAFETY: see above.
        unsafe {
            let ended = self.device.end_command_buffer(self.commands);
            self.note(ended);
            let submitted = self.device.queue_submit(self.queue, &submits, vk::Fence::null());
            if self.note(submitted).is_some() {
                self.ended.submitted += 1;
            }
            let idle = self.device.queue_wait_idle(self.queue);
            self.note(idle);
        }
        self.reset();
    }
}

/// An element of `all`, or `None` if it is empty.
pub(super) fn pick<'a, T>(bytes: &mut Bytes<'_>, all: &'a [T]) -> Option<&'a T> {
    (!all.is_empty()).then(|| &all[bytes.below(all.len())])
}

impl Drop for Run {
    fn drop(&mut self) {
        // SAFETY: see above; the device is idle, or lost.
        unsafe {
            let _ = self.device.device_wait_idle();
            for pipeline in &self.pipelines {
                self.device.destroy_pipeline(*pipeline, None);
            }
            for (image, view) in &self.images {
                self.device.destroy_image_view(*view, None);
                self.device.destroy_image(image.handle, None);
                self.device.free_memory(image.memory, None);
            }
            for buffer in &self.buffers {
                self.device.destroy_buffer(buffer.handle, None);
                self.device.free_memory(buffer.memory, None);
            }
            self.device.destroy_query_pool(self.queries, None);
            self.device.destroy_pipeline_layout(self.layout, None);
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
            self.debug_utils.destroy_debug_utils_messenger(self.messenger, None);
            self.instance.destroy_instance(None);
        }
    }
}
