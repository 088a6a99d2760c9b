//! A device to test, with what every test needs around it.

use ash::vk;
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex};

/// Messages that the driver sent.
pub type Messages = Arc<Mutex<Vec<String>>>;

/// A device, its queue, a command pool, and what its messenger heard.
pub struct Gpu {
    pub physical_device: vk::PhysicalDevice,
    pub instance: ash::Instance,
    debug_utils: ash::ext::debug_utils::Instance,
    messenger: vk::DebugUtilsMessengerEXT,
    messages: Box<Messages>,
    pub device: ash::Device,
    pub gaussian: gaurast::gaussian_primitive_topology::Device,
    pub queue: vk::Queue,
    pub pool: vk::CommandPool,
    /// Dropping it unloads the loader.
    pub entry: ash::Entry,
}

/// A buffer with memory of its own.
#[derive(Clone, Copy)]
pub struct Buffer {
    pub buffer: vk::Buffer,
    pub memory: vk::DeviceMemory,
    pub size: u64,
}

/// An image with memory and a view of its own.
#[derive(Clone, Copy)]
pub struct Image {
    pub image: vk::Image,
    pub memory: vk::DeviceMemory,
    pub view: vk::ImageView,
    pub extent: vk::Extent2D,
}

/// The memory type that the host cannot map.
pub const DEVICE_ONLY: u32 = 0;
/// The memory type that the host can map.
pub const MAPPABLE: u32 = 1;

pub const COLOR: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: 1,
};

pub const COLOR_LAYERS: vk::ImageSubresourceLayers = vk::ImageSubresourceLayers {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    mip_level: 0,
    base_array_layer: 0,
    layer_count: 1,
};

unsafe extern "system" fn keep_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the driver passes valid callback data, and `user` is the box that outlives the messenger.
    let (message, messages) = unsafe {
        (
            (*data).message_as_c_str().unwrap_or_default(),
            &*user.cast::<Messages>(),
        )
    };
    let text = message.to_string_lossy().into_owned();
    messages.lock().unwrap().push(text);
    vk::FALSE
}

impl Gpu {
    /// Opens the device with all that it supports.
    pub fn new() -> Self {
        Self::of(vulkan_gaurast::entry(), &[])
    }

    /// Opens the device with all that it supports but the optional modes of the extension.
    pub fn without_modes() -> Self {
        let no_modes =
            gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST::default()
                .gaussian_primitive_topology(true);
        Self::with(vulkan_gaurast::entry(), &[], Some(no_modes))
    }

    /// Opens the device with all that it supports but the Gaussian topology.
    pub fn without_the_topology() -> Self {
        let nothing =
            gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST::default();
        Self::with(vulkan_gaurast::entry(), &[], Some(nothing))
    }

    /// Opens the device through some door, with layers.
    pub fn of(entry: ash::Entry, layers: &[&CStr]) -> Self {
        Self::with(entry, layers, None)
    }

    /// Opens the device through some door, with layers and with these of the extension's features, or all.
    fn with(
        entry: ash::Entry,
        layers: &[&CStr],
        modes: Option<gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST<'static>>,
    ) -> Self {
        let extensions = [
            gaurast::gaussian_primitive_topology::NAME,
            ash::khr::map_memory2::NAME,
            ash::khr::performance_query::NAME,
            ash::khr::push_descriptor::NAME,
            ash::ext::index_type_uint8::NAME,
            ash::ext::provoking_vertex::NAME,
            ash::ext::vertex_attribute_divisor::NAME,
        ];
        let app = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let instance_extensions = [ash::ext::debug_utils::NAME.as_ptr()];
        let layers: Vec<_> = layers.iter().map(|name| name.as_ptr()).collect();
        let instance_info = vk::InstanceCreateInfo::default()
            .application_info(&app)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&instance_extensions);
        let messages = Box::<Messages>::default();
        let messenger_info = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::ERROR
                    | vk::DebugUtilsMessageSeverityFlagsEXT::WARNING,
            )
            .message_type(
                vk::DebugUtilsMessageTypeFlagsEXT::GENERAL
                    | vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION,
            )
            .pfn_user_callback(Some(keep_message))
            .user_data(std::ptr::from_ref::<Messages>(&messages).cast_mut().cast());
        let names: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
        let queue_info = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(0)
            .queue_priorities(&[1.0])];
        // SAFETY: see the crate.
        unsafe {
            let instance = entry.create_instance(&instance_info, None).unwrap();
            let debug_utils = ash::ext::debug_utils::Instance::new(&entry, &instance);
            let messenger = debug_utils
                .create_debug_utils_messenger(&messenger_info, None)
                .unwrap();
            let physical_device = instance.enumerate_physical_devices().unwrap()[0];
            let mut gaussian =
                gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST::default();
            let mut vulkan12 = vk::PhysicalDeviceVulkan12Features::default();
            let mut vulkan13 = vk::PhysicalDeviceVulkan13Features::default();
            let mut performance = vk::PhysicalDevicePerformanceQueryFeaturesKHR::default();
            let mut indices = vk::PhysicalDeviceIndexTypeUint8FeaturesKHR::default();
            let mut provoking = vk::PhysicalDeviceProvokingVertexFeaturesEXT::default();
            let mut divisor = vk::PhysicalDeviceVertexAttributeDivisorFeaturesKHR::default();
            let mut vulkan11 = vk::PhysicalDeviceVulkan11Features::default();
            let mut features = vk::PhysicalDeviceFeatures2::default()
                .push_next(&mut indices)
                .push_next(&mut provoking)
                .push_next(&mut divisor)
                .push_next(&mut vulkan11)
                .push_next(&mut vulkan12)
                .push_next(&mut vulkan13)
                .push_next(&mut performance);
            instance.get_physical_device_features2(physical_device, &mut features);
            let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut gaussian);
            instance.get_physical_device_features2(physical_device, &mut all);
            let mut gaussian = modes.unwrap_or(gaussian);
            let device_info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queue_info)
                .enabled_extension_names(&names)
                .push_next(&mut features)
                .push_next(&mut gaussian);
            let device = instance
                .create_device(physical_device, &device_info, None)
                .unwrap();
            let gaussian = gaurast::gaussian_primitive_topology::Device::new(&instance, &device);
            let queue = device.get_device_queue(0, 0);
            let pool_info = vk::CommandPoolCreateInfo::default()
                .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
            let pool = device.create_command_pool(&pool_info, None).unwrap();
            Self {
                physical_device,
                instance,
                debug_utils,
                messenger,
                messages,
                device,
                gaussian,
                queue,
                pool,
                entry,
            }
        }
    }

    /// The instance, to load extensions by.
    pub fn instance(&self) -> &ash::Instance {
        &self.instance
    }

    /// What the messenger heard since the last call.
    pub fn take_messages(&self) -> Vec<String> {
        std::mem::take(&mut self.messages.lock().unwrap())
    }

    /// Memory of a type.
    pub fn allocate(&self, size: u64, memory_type: u32) -> vk::DeviceMemory {
        let info = vk::MemoryAllocateInfo::default()
            .allocation_size(size)
            .memory_type_index(memory_type);
        // SAFETY: see the crate.
        unsafe { self.device.allocate_memory(&info, None).unwrap() }
    }

    /// A buffer bound to memory of a type.
    pub fn buffer(&self, size: u64, memory_type: u32) -> Buffer {
        let usage = vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST
            | vk::BufferUsageFlags::VERTEX_BUFFER
            | vk::BufferUsageFlags::INDEX_BUFFER
            | vk::BufferUsageFlags::INDIRECT_BUFFER
            | vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::UNIFORM_BUFFER
            | vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER
            | vk::BufferUsageFlags::STORAGE_TEXEL_BUFFER;
        let info = vk::BufferCreateInfo::default().size(size).usage(usage);
        // SAFETY: see the crate.
        unsafe {
            let buffer = self.device.create_buffer(&info, None).unwrap();
            let requirements = self.device.get_buffer_memory_requirements(buffer);
            assert!(requirements.size >= size);
            assert_ne!(requirements.memory_type_bits & (1 << memory_type), 0);
            let memory = self.allocate(requirements.size, memory_type);
            self.device.bind_buffer_memory(buffer, memory, 0).unwrap();
            Buffer {
                buffer,
                memory,
                size,
            }
        }
    }

    /// A mappable buffer that holds `data`.
    pub fn buffer_of<T: bytemuck::NoUninit>(&self, data: &[T]) -> Buffer {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let buffer = self.buffer(bytes.len() as u64, MAPPABLE);
        self.write(buffer, bytes);
        buffer
    }

    /// Writes to the beginning of a mappable buffer.
    pub fn write(&self, buffer: Buffer, bytes: &[u8]) {
        assert!(bytes.len() as u64 <= buffer.size);
        // SAFETY: see the crate; the mapping has room for the bytes.
        unsafe {
            let flags = vk::MemoryMapFlags::empty();
            let mapped = self
                .device
                .map_memory(buffer.memory, 0, vk::WHOLE_SIZE, flags)
                .unwrap();
            std::ptr::copy_nonoverlapping(bytes.as_ptr(), mapped.cast(), bytes.len());
            self.device.unmap_memory(buffer.memory);
        }
    }

    /// What a mappable buffer holds.
    pub fn read<T: bytemuck::AnyBitPattern>(&self, buffer: Buffer) -> Vec<T> {
        let mut bytes = vec![0u8; buffer.size as usize];
        // SAFETY: see the crate; the mapping has as many bytes.
        unsafe {
            let flags = vk::MemoryMapFlags::empty();
            let mapped = self
                .device
                .map_memory(buffer.memory, 0, vk::WHOLE_SIZE, flags)
                .unwrap();
            std::ptr::copy_nonoverlapping(mapped.cast(), bytes.as_mut_ptr(), bytes.len());
            self.device.unmap_memory(buffer.memory);
        }
        bytes
            .chunks_exact(size_of::<T>())
            .map(bytemuck::pod_read_unaligned)
            .collect()
    }

    /// A 2D image bound to memory that the host cannot map, in the general layout, with a view.
    pub fn image(&self, format: vk::Format, width: u32, height: u32) -> Image {
        let extent = vk::Extent2D { width, height };
        let depth = matches!(format, vk::Format::D32_SFLOAT | vk::Format::D16_UNORM);
        let usage = if depth {
            vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT
        } else {
            vk::ImageUsageFlags::COLOR_ATTACHMENT
                | vk::ImageUsageFlags::SAMPLED
                | vk::ImageUsageFlags::STORAGE
        };
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(extent.into())
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(usage | vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST);
        // SAFETY: see the crate.
        unsafe {
            let image = self.device.create_image(&info, None).unwrap();
            let requirements = self.device.get_image_memory_requirements(image);
            let memory = self.allocate(requirements.size, DEVICE_ONLY);
            self.device.bind_image_memory(image, memory, 0).unwrap();
            let range = vk::ImageSubresourceRange {
                aspect_mask: if depth {
                    vk::ImageAspectFlags::DEPTH
                } else {
                    vk::ImageAspectFlags::COLOR
                },
                ..COLOR
            };
            let view_info = vk::ImageViewCreateInfo::default()
                .image(image)
                .view_type(vk::ImageViewType::TYPE_2D)
                .format(format)
                .subresource_range(range);
            let view = self.device.create_image_view(&view_info, None).unwrap();
            self.run(|device, commands| {
                let barriers = [vk::ImageMemoryBarrier::default()
                    .new_layout(vk::ImageLayout::GENERAL)
                    .image(image)
                    .subresource_range(range)];
                let all = vk::PipelineStageFlags::ALL_COMMANDS;
                let none = vk::DependencyFlags::empty();
                device.cmd_pipeline_barrier(commands, all, all, none, &[], &[], &barriers);
            });
            Image {
                image,
                memory,
                view,
                extent,
            }
        }
    }

    /// A primary command buffer.
    pub fn command_buffer(&self) -> vk::CommandBuffer {
        self.command_buffer_of(vk::CommandBufferLevel::PRIMARY)
    }

    /// A command buffer.
    pub fn command_buffer_of(&self, level: vk::CommandBufferLevel) -> vk::CommandBuffer {
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(self.pool)
            .level(level)
            .command_buffer_count(1);
        // SAFETY: see the crate.
        unsafe { self.device.allocate_command_buffers(&info).unwrap()[0] }
    }

    /// Records a primary command buffer.
    pub fn record(
        &self,
        record: impl FnOnce(&ash::Device, vk::CommandBuffer),
    ) -> Result<vk::CommandBuffer, vk::Result> {
        let command_buffer = self.command_buffer();
        let info = vk::CommandBufferBeginInfo::default();
        // SAFETY: see the crate.
        unsafe {
            self.device.begin_command_buffer(command_buffer, &info)?;
            record(&self.device, command_buffer);
            self.device.end_command_buffer(command_buffer)?;
        }
        Ok(command_buffer)
    }

    /// Submits a command buffer and waits for it.
    pub fn submit(&self, command_buffer: vk::CommandBuffer) {
        let command_buffers = [command_buffer];
        let submits = [vk::SubmitInfo::default().command_buffers(&command_buffers)];
        // SAFETY: see the crate.
        unsafe {
            self.device
                .queue_submit(self.queue, &submits, vk::Fence::null())
                .unwrap();
            self.device.queue_wait_idle(self.queue).unwrap();
        }
    }

    /// Records a command buffer, submits it and waits for it.
    pub fn run(&self, record: impl FnOnce(&ash::Device, vk::CommandBuffer)) {
        let command_buffer = self.record(record).unwrap();
        self.submit(command_buffer);
    }

    /// The texels of a colour image.
    pub fn read_image<T: bytemuck::AnyBitPattern>(&self, image: Image, texel_size: u64) -> Vec<T> {
        let vk::Extent2D { width, height } = image.extent;
        let size = u64::from(width) * u64::from(height) * texel_size;
        let buffer = self.buffer(size, MAPPABLE);
        self.run(|device, commands| {
            let region = [vk::BufferImageCopy::default()
                .image_subresource(COLOR_LAYERS)
                .image_extent(image.extent.into())];
            let layout = vk::ImageLayout::GENERAL;
            // SAFETY: see the crate.
            unsafe {
                device.cmd_copy_image_to_buffer(
                    commands,
                    image.image,
                    layout,
                    buffer.buffer,
                    &region,
                );
            }
        });
        let texels = self.read(buffer);
        self.free_buffer(buffer);
        texels
    }

    /// Destroys a buffer and its memory.
    pub fn free_buffer(&self, buffer: Buffer) {
        // SAFETY: see the crate.
        unsafe {
            self.device.destroy_buffer(buffer.buffer, None);
            self.device.free_memory(buffer.memory, None);
        }
    }

    /// Destroys an image, its view and its memory.
    pub fn free_image(&self, image: Image) {
        // SAFETY: see the crate.
        unsafe {
            self.device.destroy_image_view(image.view, None);
            self.device.destroy_image(image.image, None);
            self.device.free_memory(image.memory, None);
        }
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        // SAFETY: see the crate.
        unsafe {
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
            self.debug_utils
                .destroy_debug_utils_messenger(self.messenger, None);
            self.instance.destroy_instance(None);
        }
    }
}
