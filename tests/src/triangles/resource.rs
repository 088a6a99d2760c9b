//! Buffers, images and samplers.

use ash::vk;
use bytemuck::Pod;

use super::Gpu;

/// A buffer that the host can write and read.
pub struct Buffer {
    /// The buffer.
    pub raw: vk::Buffer,
    /// Bytes.
    pub size: u64,
    memory: vk::DeviceMemory,
    gpu: Gpu,
}

impl Buffer {
    /// A buffer for any use that holds `contents`.
    pub fn of<T: Pod>(gpu: &Gpu, contents: &[T]) -> Self {
        let buffer = Self::new(gpu, size_of_val(contents).max(4) as u64);
        buffer.write(bytemuck::cast_slice(contents));
        buffer
    }

    /// A buffer of zeros for any use.
    pub fn new(gpu: &Gpu, size: u64) -> Self {
        use vk::BufferUsageFlags as Usage;
        let usage = Usage::VERTEX_BUFFER
            | Usage::INDEX_BUFFER
            | Usage::INDIRECT_BUFFER
            | Usage::UNIFORM_BUFFER
            | Usage::STORAGE_BUFFER
            | Usage::UNIFORM_TEXEL_BUFFER
            | Usage::TRANSFER_SRC
            | Usage::TRANSFER_DST;
        let info = vk::BufferCreateInfo::default().size(size).usage(usage);
        let flags = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        let device = gpu.device();
        // SAFETY: see `triangles`.
        let buffer = unsafe {
            let raw = device.create_buffer(&info, None).expect("a buffer");
            let needed = device.get_buffer_memory_requirements(raw);
            let memory = allocate(gpu, needed, flags);
            device
                .bind_buffer_memory(raw, memory, 0)
                .expect("a buffer is bound");
            Self {
                raw,
                size,
                memory,
                gpu: gpu.clone(),
            }
        };
        buffer.write(&vec![0; size as usize]);
        buffer
    }

    fn write(&self, bytes: &[u8]) {
        assert!(bytes.len() as u64 <= self.size);
        // SAFETY: the mapping is at least as long as the buffer, and the device is idle.
        self.mapped(|to| unsafe { to.copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) });
    }

    /// What it holds.
    pub fn read(&self) -> Vec<u8> {
        let mut bytes = vec![0; self.size as usize];
        // SAFETY: the mapping is at least as long as the buffer, and the device is idle.
        self.mapped(|from| unsafe {
            from.copy_to_nonoverlapping(bytes.as_mut_ptr(), bytes.len());
        });
        bytes
    }

    fn mapped(&self, access: impl FnOnce(*mut u8)) {
        let device = self.gpu.device();
        // SAFETY: see `triangles`; the memory is mappable and not mapped.
        unsafe {
            let start = device
                .map_memory(self.memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty())
                .expect("memory is mapped");
            access(start.cast());
            device.unmap_memory(self.memory);
        }
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: see `triangles`.
        unsafe {
            self.gpu.device().destroy_buffer(self.raw, None);
            self.gpu.device().free_memory(self.memory, None);
        }
    }
}

fn allocate(
    gpu: &Gpu,
    needed: vk::MemoryRequirements,
    flags: vk::MemoryPropertyFlags,
) -> vk::DeviceMemory {
    let info = vk::MemoryAllocateInfo::default()
        .allocation_size(needed.size)
        .memory_type_index(gpu.memory_type(needed.memory_type_bits, flags));
    // SAFETY: see `triangles`.
    unsafe { gpu.device().allocate_memory(&info, None) }.expect("memory")
}

/// What an [`Image`] is like.
#[derive(Clone, Copy, Debug)]
pub struct ImageOptions {
    /// Its format.
    pub format: vk::Format,
    /// Width, height and depth.
    pub size: [u32; 3],
    /// Levels.
    pub levels: u32,
    /// Layers.
    pub layers: u32,
    /// Samples per texel.
    pub samples: u32,
    /// What it is used for; transfers are added.
    pub usage: vk::ImageUsageFlags,
    /// The view's type, which decides the image's.
    pub view: vk::ImageViewType,
}

impl ImageOptions {
    /// A flat image of one level, one layer and one sample.
    pub fn new(format: vk::Format, [width, height]: [u32; 2], usage: vk::ImageUsageFlags) -> Self {
        Self {
            format,
            size: [width, height, 1],
            levels: 1,
            layers: 1,
            samples: 1,
            usage,
            view: vk::ImageViewType::TYPE_2D,
        }
    }

    fn image_type(&self) -> vk::ImageType {
        match self.view {
            vk::ImageViewType::TYPE_1D | vk::ImageViewType::TYPE_1D_ARRAY => vk::ImageType::TYPE_1D,
            vk::ImageViewType::TYPE_3D => vk::ImageType::TYPE_3D,
            _ => vk::ImageType::TYPE_2D,
        }
    }

    fn flags(&self) -> vk::ImageCreateFlags {
        match self.view {
            vk::ImageViewType::CUBE | vk::ImageViewType::CUBE_ARRAY => {
                vk::ImageCreateFlags::CUBE_COMPATIBLE
            }
            _ => vk::ImageCreateFlags::empty(),
        }
    }
}

/// An image in the layout `GENERAL`, with a view of all of it.
pub struct Image {
    /// The image.
    pub raw: vk::Image,
    /// The view, of depth alone where there is depth and stencil.
    pub view: vk::ImageView,
    /// What it is like.
    pub options: ImageOptions,
    /// A view of both aspects, for attachments.
    pub attachment: vk::ImageView,
    memory: vk::DeviceMemory,
    gpu: Gpu,
}

impl Image {
    /// Creates it. Its contents are undefined.
    pub fn new(gpu: &Gpu, options: &ImageOptions) -> Self {
        use vk::ImageUsageFlags as Usage;
        let [width, height, depth] = options.size;
        let mut usage = options.usage | Usage::TRANSFER_SRC;
        if options.samples == 1 {
            usage |= Usage::TRANSFER_DST;
        }
        let info = vk::ImageCreateInfo::default()
            .flags(options.flags())
            .image_type(options.image_type())
            .format(options.format)
            .extent(vk::Extent3D {
                width,
                height,
                depth,
            })
            .mip_levels(options.levels)
            .array_layers(options.layers)
            .samples(vk::SampleCountFlags::from_raw(options.samples))
            .usage(usage);
        let device = gpu.device();
        // SAFETY: see `triangles`.
        unsafe {
            let raw = device.create_image(&info, None).expect("an image");
            let needed = device.get_image_memory_requirements(raw);
            let memory = allocate(gpu, needed, vk::MemoryPropertyFlags::empty());
            device
                .bind_image_memory(raw, memory, 0)
                .expect("an image is bound");
            let aspects = aspects(options.format);
            let one = if aspects.contains(vk::ImageAspectFlags::DEPTH) {
                vk::ImageAspectFlags::DEPTH
            } else {
                aspects
            };
            let view = |aspects| {
                let info = vk::ImageViewCreateInfo::default()
                    .image(raw)
                    .view_type(options.view)
                    .format(options.format)
                    .subresource_range(range(aspects));
                device.create_image_view(&info, None).expect("a view")
            };
            let image = Self {
                raw,
                view: view(one),
                options: *options,
                attachment: view(aspects),
                memory,
                gpu: gpu.clone(),
            };
            gpu.run(|commands| commands.become_general(&image));
            image
        }
    }

    /// An image to sample from, with the texels of each level in turn, tightly packed, layer by
    /// layer.
    pub fn textured<T: Pod>(gpu: &Gpu, options: &ImageOptions, levels: &[Vec<T>]) -> Self {
        let options = ImageOptions {
            levels: levels.len() as u32,
            usage: options.usage | vk::ImageUsageFlags::SAMPLED,
            ..*options
        };
        let image = Self::new(gpu, &options);
        let contents: Vec<T> = levels.concat();
        let buffer = Buffer::of(gpu, &contents);
        let mut offset = 0;
        let regions: Vec<_> = (0..)
            .zip(levels)
            .map(|(level, texels)| {
                let region = image.region(vk::ImageAspectFlags::COLOR, level);
                let region = region.buffer_offset(offset);
                offset += size_of_val(texels.as_slice()) as u64;
                region
            })
            .collect();
        gpu.run(|commands| commands.upload(&buffer, &image, &regions));
        image
    }

    /// A copy of one level.
    pub(super) fn region(&self, aspect: vk::ImageAspectFlags, level: u32) -> vk::BufferImageCopy {
        let [width, height, depth] = self.options.size.map(|size| (size >> level).max(1));
        let layers = vk::ImageSubresourceLayers {
            aspect_mask: aspect,
            mip_level: level,
            base_array_layer: 0,
            layer_count: self.options.layers,
        };
        vk::BufferImageCopy::default()
            .image_subresource(layers)
            .image_extent(vk::Extent3D {
                width,
                height,
                depth,
            })
    }

    /// The texels of one aspect of level 0, tightly packed, `texel` bytes each.
    pub fn read(&self, aspect: vk::ImageAspectFlags, texel: u32) -> Vec<u8> {
        let texels = self.options.size.iter().product::<u32>() * self.options.layers;
        let buffer = Buffer::new(&self.gpu, u64::from(texels * texel));
        let region = self.region(aspect, 0);
        self.gpu
            .run(|commands| commands.download(self, &buffer, &[region]));
        buffer.read()
    }

    /// The device that it is on.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        let device = self.gpu.device();
        // SAFETY: see `triangles`.
        unsafe {
            device.destroy_image_view(self.view, None);
            device.destroy_image_view(self.attachment, None);
            device.destroy_image(self.raw, None);
            device.free_memory(self.memory, None);
        }
    }
}

/// The aspects of a format.
pub fn aspects(format: vk::Format) -> vk::ImageAspectFlags {
    use vk::Format as F;
    use vk::ImageAspectFlags as Aspect;
    match format {
        F::D16_UNORM | F::X8_D24_UNORM_PACK32 | F::D32_SFLOAT => Aspect::DEPTH,
        F::S8_UINT => Aspect::STENCIL,
        F::D16_UNORM_S8_UINT | F::D24_UNORM_S8_UINT | F::D32_SFLOAT_S8_UINT => {
            Aspect::DEPTH | Aspect::STENCIL
        }
        _ => Aspect::COLOR,
    }
}

/// All levels and layers.
pub fn range(aspects: vk::ImageAspectFlags) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange {
        aspect_mask: aspects,
        base_mip_level: 0,
        level_count: vk::REMAINING_MIP_LEVELS,
        base_array_layer: 0,
        layer_count: vk::REMAINING_ARRAY_LAYERS,
    }
}

/// A sampler.
pub struct Sampler {
    /// The sampler.
    pub raw: vk::Sampler,
    gpu: Gpu,
}

impl Sampler {
    /// Creates it.
    pub fn new(gpu: &Gpu, info: &vk::SamplerCreateInfo<'_>) -> Self {
        // SAFETY: see `triangles`.
        let raw = unsafe { gpu.device().create_sampler(info, None) }.expect("a sampler");
        Self {
            raw,
            gpu: gpu.clone(),
        }
    }
}

impl Drop for Sampler {
    fn drop(&mut self) {
        // SAFETY: see `triangles`.
        unsafe { self.gpu.device().destroy_sampler(self.raw, None) };
    }
}
