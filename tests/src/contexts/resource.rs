//! Buffers and colour attachments that destroy themselves.

use ash::vk;
use bytemuck::{AnyBitPattern, NoUninit};

use super::Context;

/// A host-visible buffer with its memory.
pub struct Buffer {
    raw: vk::Buffer,
    memory: vk::DeviceMemory,
    size: u64,
    context: Context,
}

impl Buffer {
    /// A buffer of `size` bytes.
    pub fn new(context: &Context, size: u64) -> Self {
        use vk::BufferUsageFlags as Usage;
        use vk::MemoryPropertyFlags as Flags;
        let usage = Usage::TRANSFER_SRC
            | Usage::TRANSFER_DST
            | Usage::VERTEX_BUFFER
            | Usage::INDEX_BUFFER
            | Usage::INDIRECT_BUFFER;
        // Vulkan has no empty buffers.
        let size = size.max(4);
        let create_info = vk::BufferCreateInfo::default().size(size).usage(usage);
        let device = context.device();
        // SAFETY: see `contexts`.
        unsafe {
            let raw = device.create_buffer(&create_info, None).expect("a buffer");
            let requirements = device.get_buffer_memory_requirements(raw);
            let flags = Flags::HOST_VISIBLE | Flags::HOST_COHERENT;
            let memory = allocate(context, requirements, flags);
            device
                .bind_buffer_memory(raw, memory, 0)
                .expect("the buffer takes it");
            Self {
                raw,
                memory,
                size,
                context: context.clone(),
            }
        }
    }

    /// A buffer that holds `data`.
    pub fn of<T: NoUninit>(context: &Context, data: &[T]) -> Self {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let buffer = Self::new(context, bytes.len() as u64);
        // SAFETY: see `contexts`; the mapping has room for the bytes.
        unsafe {
            let mapped = buffer.map();
            mapped.copy_from_nonoverlapping(bytes.as_ptr(), bytes.len());
            context.device().unmap_memory(buffer.memory);
        }
        buffer
    }

    /// The handle.
    pub fn raw(&self) -> vk::Buffer {
        self.raw
    }

    /// The values that the buffer holds.
    pub fn read<T: AnyBitPattern>(&self) -> Vec<T> {
        let mut bytes = vec![0_u8; self.size as usize];
        // SAFETY: see `contexts`; the mapping has as many bytes.
        unsafe {
            let mapped = self.map();
            mapped.copy_to_nonoverlapping(bytes.as_mut_ptr(), bytes.len());
            self.context.device().unmap_memory(self.memory);
        }
        bytes
            .chunks_exact(size_of::<T>())
            .map(bytemuck::pod_read_unaligned)
            .collect()
    }

    fn map(&self) -> *mut u8 {
        let (device, flags) = (self.context.device(), vk::MemoryMapFlags::empty());
        // SAFETY: see `contexts`.
        let mapped = unsafe { device.map_memory(self.memory, 0, vk::WHOLE_SIZE, flags) };
        mapped.expect("host-visible memory").cast()
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        let device = self.context.device();
        // SAFETY: see `contexts`.
        unsafe {
            device.destroy_buffer(self.raw, None);
            device.free_memory(self.memory, None);
        }
    }
}

/// A colour attachment in device memory, with its view. Between passes its layout is general.
pub struct Target {
    pub(super) image: vk::Image,
    pub(super) view: vk::ImageView,
    memory: vk::DeviceMemory,
    /// The format.
    pub format: vk::Format,
    /// Width and height in pixels.
    pub extent: vk::Extent2D,
    context: Context,
}

impl Target {
    /// The layers and levels of a target: one.
    pub(super) const RANGE: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        base_mip_level: 0,
        level_count: 1,
        base_array_layer: 0,
        layer_count: 1,
    };

    /// A target of `size`, undefined until it is drawn to.
    pub fn new(context: &Context, format: vk::Format, [width, height]: [u32; 2]) -> Self {
        let extent = vk::Extent2D { width, height };
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
        let create_info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(extent.into())
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(usage);
        let device = context.device();
        // SAFETY: see `contexts`.
        unsafe {
            let image = device.create_image(&create_info, None).expect("an image");
            let requirements = device.get_image_memory_requirements(image);
            let flags = vk::MemoryPropertyFlags::DEVICE_LOCAL;
            let memory = allocate(context, requirements, flags);
            device
                .bind_image_memory(image, memory, 0)
                .expect("the image takes it");
            let view_info = vk::ImageViewCreateInfo::default()
                .image(image)
                .view_type(vk::ImageViewType::TYPE_2D)
                .format(format)
                .subresource_range(Self::RANGE);
            let view = device.create_image_view(&view_info, None).expect("a view");
            Self {
                image,
                view,
                memory,
                format,
                extent,
                context: context.clone(),
            }
        }
    }

    /// The texels, row by row from the top; `T` is a texel of the format.
    pub fn read<T: AnyBitPattern>(&self) -> Vec<T> {
        let texels = u64::from(self.extent.width) * u64::from(self.extent.height);
        let buffer = Buffer::new(&self.context, texels * size_of::<T>() as u64);
        self.context.run(|commands| commands.copy(self, &buffer));
        let mut values = buffer.read();
        values.truncate(texels as usize);
        values
    }
}

impl Drop for Target {
    fn drop(&mut self) {
        let device = self.context.device();
        // SAFETY: see `contexts`.
        unsafe {
            device.destroy_image_view(self.view, None);
            device.destroy_image(self.image, None);
            device.free_memory(self.memory, None);
        }
    }
}

fn allocate(
    context: &Context,
    requirements: vk::MemoryRequirements,
    flags: vk::MemoryPropertyFlags,
) -> vk::DeviceMemory {
    let memory_type = context.memory_type(requirements.memory_type_bits, flags);
    let allocate_info = vk::MemoryAllocateInfo::default()
        .allocation_size(requirements.size)
        .memory_type_index(memory_type);
    // SAFETY: see `contexts`.
    let memory = unsafe { context.device().allocate_memory(&allocate_info, None) };
    memory.expect("memory")
}
