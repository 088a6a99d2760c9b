//! Buffers, images and samplers.

use ash::vk;
use bytemuck::{AnyBitPattern, NoUninit};
use simdevice::Format;

use crate::gpu::Gpu;

/// A buffer with memory of its own.
pub struct Buffer {
    /// The buffer.
    pub raw: vk::Buffer,
    /// Its size in bytes.
    pub size: u64,
    /// Its memory, which no other resource uses.
    pub memory: vk::DeviceMemory,
    gpu: Gpu,
}

impl Buffer {
    /// A mappable buffer for any use that holds `contents`.
    pub fn of<T: NoUninit>(gpu: &Gpu, contents: &[T]) -> Self {
        let buffer = Self::new(gpu, size_of_val(contents) as u64);
        buffer.write(contents);
        buffer
    }

    /// A mappable buffer of zeros for any use. It has at least four bytes, since Vulkan has no empty buffers.
    pub fn new(gpu: &Gpu, size: u64) -> Self {
        use vk::MemoryPropertyFlags as Flags;
        let buffer = Self::within(gpu, size, Flags::HOST_VISIBLE | Flags::HOST_COHERENT);
        buffer.write(&vec![0u8; buffer.size as usize]);
        buffer
    }

    /// A mappable buffer of zeros for a use that an extension adds, and any other use.
    pub fn with_usage(gpu: &Gpu, size: u64, usage: vk::BufferUsageFlags) -> Self {
        use vk::MemoryPropertyFlags as Flags;
        let flags = Flags::HOST_VISIBLE | Flags::HOST_COHERENT;
        let buffer = Self::create(gpu, size, flags, usage);
        buffer.write(&vec![0u8; buffer.size as usize]);
        buffer
    }

    /// A buffer for any use in the first memory type that has `flags`. Its contents are undefined.
    pub fn within(gpu: &Gpu, size: u64, flags: vk::MemoryPropertyFlags) -> Self {
        Self::create(gpu, size, flags, vk::BufferUsageFlags::empty())
    }

    fn create(gpu: &Gpu, size: u64, flags: vk::MemoryPropertyFlags, further: vk::BufferUsageFlags) -> Self {
        use vk::BufferUsageFlags as Usage;
        let size = size.max(4);
        let usage = Usage::VERTEX_BUFFER
            | Usage::INDEX_BUFFER
            | Usage::INDIRECT_BUFFER
            | Usage::UNIFORM_BUFFER
            | Usage::STORAGE_BUFFER
            | Usage::UNIFORM_TEXEL_BUFFER
            | Usage::STORAGE_TEXEL_BUFFER
            | Usage::TRANSFER_SRC
            | Usage::TRANSFER_DST
            | further;
        let info = vk::BufferCreateInfo::default().size(size).usage(usage);
        let device = gpu.device();
        // SAFETY: see the crate.
        unsafe {
            let raw = device.create_buffer(&info, None).expect("a buffer");
            let needed = device.get_buffer_memory_requirements(raw);
            let memory = allocate(gpu, needed, flags, further.contains(Usage::SHADER_DEVICE_ADDRESS));
            device.bind_buffer_memory(raw, memory, 0).expect("a buffer is bound");
            Self { raw, size, memory, gpu: gpu.clone() }
        }
    }

    /// Writes to the beginning of a mappable buffer.
    pub fn write<T: NoUninit>(&self, contents: &[T]) {
        let bytes: &[u8] = bytemuck::cast_slice(contents);
        assert!(bytes.len() as u64 <= self.size);
        // SAFETY: the mapping is at least as long as the buffer, and the device is idle.
        self.mapped(|to| unsafe { to.copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) });
    }

    /// The bytes of a mappable buffer.
    pub fn read(&self) -> Vec<u8> {
        let mut bytes = vec![0; self.size as usize];
        // SAFETY: the mapping is at least as long as the buffer, and the device is idle.
        self.mapped(|from| unsafe {
            from.copy_to_nonoverlapping(bytes.as_mut_ptr(), bytes.len());
        });
        bytes
    }

    /// The contents of a mappable buffer, as values.
    pub fn values<T: AnyBitPattern>(&self) -> Vec<T> {
        let bytes = self.read();
        let values = bytes.chunks_exact(size_of::<T>());
        values.map(bytemuck::pod_read_unaligned).collect()
    }

    fn mapped(&self, access: impl FnOnce(*mut u8)) {
        let device = self.gpu.device();
        // SAFETY: see the crate; the memory is mappable and not mapped.
        unsafe {
            let start = device
                .map_memory(self.memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty())
                .expect("memory is mapped");
            access(start.cast());
            device.unmap_memory(self.memory);
        }
    }
}

impl From<&Buffer> for vk::Buffer {
    fn from(buffer: &Buffer) -> Self {
        buffer.raw
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: see the crate.
        unsafe {
            self.gpu.device().destroy_buffer(self.raw, None);
            self.gpu.device().free_memory(self.memory, None);
        }
    }
}

/// A mappable buffer that shaders and the device find by its address.
pub struct Addressed {
    /// The buffer.
    pub buffer: Buffer,
    /// The address of its first byte.
    pub address: vk::DeviceAddress,
    /// Its size in bytes.
    pub size: u64,
}

impl Addressed {
    /// A buffer that holds `contents`.
    pub fn of<T: NoUninit>(gpu: &Gpu, contents: &[T]) -> Self {
        let buffer = Buffer::with_usage(gpu, size_of_val(contents) as u64, vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS);
        buffer.write(contents);
        let info = vk::BufferDeviceAddressInfo::default().buffer(buffer.raw);
        // SAFETY: see the crate.
        let address = unsafe { gpu.device().get_buffer_device_address(&info) };
        Self { address, size: buffer.size, buffer }
    }
}

fn allocate(
    gpu: &Gpu,
    needed: vk::MemoryRequirements,
    flags: vk::MemoryPropertyFlags,
    has_address: bool,
) -> vk::DeviceMemory {
    let mut addresses = vk::MemoryAllocateFlagsInfo::default().flags(vk::MemoryAllocateFlags::DEVICE_ADDRESS);
    let mut info = vk::MemoryAllocateInfo::default()
        .allocation_size(needed.size)
        .memory_type_index(gpu.memory_type(needed.memory_type_bits, flags));
    if has_address {
        info = info.push_next(&mut addresses);
    }
    // SAFETY: see the crate.
    unsafe { gpu.device().allocate_memory(&info, None) }.expect("memory")
}

/// The options of an [`Image`].
#[derive(Clone, Copy, Debug)]
pub struct ImageOptions {
    /// Its format.
    pub format: vk::Format,
    /// Width, height and depth.
    pub size: [u32; 3],
    /// Number of levels.
    pub levels: u32,
    /// Number of layers.
    pub layers: u32,
    /// Samples per texel.
    pub samples: u32,
    /// Its usage; transfers are added.
    pub usage: vk::ImageUsageFlags,
    /// The view's type, which determines the image's type.
    pub view: vk::ImageViewType,
    /// Flags in addition to those that the view requires.
    pub flags: vk::ImageCreateFlags,
}

impl ImageOptions {
    /// A 2D image of one level, one layer and one sample.
    pub fn new(format: vk::Format, [width, height]: [u32; 2], usage: vk::ImageUsageFlags) -> Self {
        Self {
            format,
            size: [width, height, 1],
            levels: 1,
            layers: 1,
            samples: 1,
            usage,
            view: vk::ImageViewType::TYPE_2D,
            flags: vk::ImageCreateFlags::empty(),
        }
    }

    /// Width, height and depth of a level.
    pub fn level_size(&self, level: u32) -> [u32; 3] {
        self.size.map(|size| (size >> level).max(1))
    }

    /// Texels, or blocks of texels, of a level of all layers.
    pub fn level_texels(&self, level: u32) -> usize {
        let [across, down] = device_format(self.format).block_extent();
        let [width, height, depth] = self.level_size(level);
        (width.div_ceil(across) * height.div_ceil(down) * depth * self.layers) as usize
    }

    /// Texels, or blocks of texels, of all levels and layers.
    pub fn texels(&self) -> usize {
        (0..self.levels).map(|level| self.level_texels(level)).sum()
    }

    fn image_type(&self) -> vk::ImageType {
        match self.view {
            vk::ImageViewType::TYPE_1D | vk::ImageViewType::TYPE_1D_ARRAY => vk::ImageType::TYPE_1D,
            vk::ImageViewType::TYPE_3D => vk::ImageType::TYPE_3D,
            _ => vk::ImageType::TYPE_2D,
        }
    }

    fn all_flags(&self) -> vk::ImageCreateFlags {
        match self.view {
            vk::ImageViewType::CUBE | vk::ImageViewType::CUBE_ARRAY => {
                self.flags | vk::ImageCreateFlags::CUBE_COMPATIBLE
            }
            _ => self.flags,
        }
    }

    /// Returns true if images of this usage can have views.
    fn has_views(&self) -> bool {
        use vk::ImageUsageFlags as Usage;
        self.usage.intersects(
            Usage::SAMPLED
                | Usage::STORAGE
                | Usage::COLOR_ATTACHMENT
                | Usage::DEPTH_STENCIL_ATTACHMENT
                | Usage::INPUT_ATTACHMENT,
        )
    }
}

/// An image in the layout `GENERAL`, with a view of all of it if its usage permits views.
pub struct Image {
    /// The image.
    pub raw: vk::Image,
    /// The view, of the depth aspect alone if there is depth and stencil.
    pub view: vk::ImageView,
    /// Its options.
    pub options: ImageOptions,
    /// A view of both aspects, for attachments.
    pub attachment: vk::ImageView,
    memory: vk::DeviceMemory,
    gpu: Gpu,
}

impl Image {
    /// Creates the image. Its contents are undefined.
    pub fn new(gpu: &Gpu, options: &ImageOptions) -> Self {
        use vk::ImageUsageFlags as Usage;
        let [width, height, depth] = options.size;
        let mut usage = options.usage | Usage::TRANSFER_SRC;
        if options.samples == 1 {
            usage |= Usage::TRANSFER_DST;
        }
        let info = vk::ImageCreateInfo::default()
            .flags(options.all_flags())
            .image_type(options.image_type())
            .format(options.format)
            .extent(vk::Extent3D { width, height, depth })
            .mip_levels(options.levels)
            .array_layers(options.layers)
            .samples(vk::SampleCountFlags::from_raw(options.samples))
            .usage(usage);
        let device = gpu.device();
        // SAFETY: see the crate.
        unsafe {
            let raw = device.create_image(&info, None).expect("an image");
            let needed = device.get_image_memory_requirements(raw);
            let memory = allocate(gpu, needed, vk::MemoryPropertyFlags::empty(), false);
            device.bind_image_memory(raw, memory, 0).expect("an image is bound");
            let aspects = aspects(options.format);
            let one = if aspects.contains(vk::ImageAspectFlags::DEPTH) { vk::ImageAspectFlags::DEPTH } else { aspects };
            let view = |aspects| {
                if !options.has_views() {
                    return vk::ImageView::null();
                }
                let info = vk::ImageViewCreateInfo::default()
                    .image(raw)
                    .view_type(options.view)
                    .format(options.format)
                    .subresource_range(range(aspects));
                device.create_image_view(&info, None).expect("a view")
            };
            let image =
                Self { raw, view: view(one), options: *options, attachment: view(aspects), memory, gpu: gpu.clone() };
            gpu.run(|commands| commands.become_general(raw, range(aspects)));
            image
        }
    }

    /// An image to sample from, with the texels of each level in turn, tightly packed, layer by
    /// layer.
    pub fn textured<T: NoUninit>(gpu: &Gpu, options: &ImageOptions, levels: &[Vec<T>]) -> Self {
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

    /// A copy of one level with all its layers.
    pub fn region(&self, aspect: vk::ImageAspectFlags, level: u32) -> vk::BufferImageCopy {
        let [width, height, depth] = self.options.level_size(level);
        let layers = vk::ImageSubresourceLayers {
            aspect_mask: aspect,
            mip_level: level,
            base_array_layer: 0,
            layer_count: self.options.layers,
        };
        vk::BufferImageCopy::default().image_subresource(layers).image_extent(vk::Extent3D { width, height, depth })
    }

    /// The texels of one aspect of level 0, tightly packed, `texel` bytes each.
    pub fn read(&self, aspect: vk::ImageAspectFlags, texel: u32) -> Vec<u8> {
        let texels = self.options.size.iter().product::<u32>() * self.options.layers;
        let buffer = Buffer::new(&self.gpu, u64::from(texels * texel));
        let region = self.region(aspect, 0);
        self.gpu.run(|commands| commands.download(self, &buffer, &[region]));
        let mut bytes = buffer.read();
        bytes.truncate((texels * texel) as usize);
        bytes
    }

    /// The colours of level 0; `T` is a texel.
    pub fn colors<T: AnyBitPattern>(&self) -> Vec<T> {
        let bytes = self.read(vk::ImageAspectFlags::COLOR, size_of::<T>() as u32);
        let texels = bytes.chunks_exact(size_of::<T>());
        texels.map(bytemuck::pod_read_unaligned).collect()
    }

    /// Copies of every level of an aspect to a buffer, with the bytes of each, and the total number of bytes.
    fn staged(&self, aspect: vk::ImageAspectFlags) -> (Vec<(vk::BufferImageCopy, usize)>, u64) {
        let plane = aspect_format(self.options.format, aspect);
        let mut offset = 0;
        let regions = (0..self.options.levels)
            .map(|level| {
                let region = self.region(aspect, level).buffer_offset(offset);
                let bytes = self.options.level_texels(level) * plane.texel_size();
                // Offsets are multiples of texels and of four.
                offset = (offset + bytes as u64).next_multiple_of(48);
                (region, bytes)
            })
            .collect();
        (regions, offset)
    }

    /// Writes all texels of an aspect, tightly packed: levels from the largest down, and layers within each level.
    pub fn upload(&self, aspect: vk::ImageAspectFlags, texels: &[u8]) {
        let (levels, size) = self.staged(aspect);
        let mut staged = vec![0; size as usize];
        let mut rest = texels;
        for (region, bytes) in &levels {
            let (level, after) = rest.split_at(*bytes);
            staged[region.buffer_offset as usize..][..level.len()].copy_from_slice(level);
            rest = after;
        }
        assert!(rest.is_empty());
        let buffer = Buffer::of(&self.gpu, &staged);
        let regions: Vec<_> = levels.iter().map(|(region, _)| *region).collect();
        self.gpu.run(|commands| commands.upload(&buffer, self, &regions));
    }

    /// All texels of an aspect, in the order of [`Self::upload`].
    pub fn download(&self, aspect: vk::ImageAspectFlags) -> Vec<u8> {
        let (levels, size) = self.staged(aspect);
        let buffer = Buffer::new(&self.gpu, size);
        let regions: Vec<_> = levels.iter().map(|(region, _)| *region).collect();
        self.gpu.run(|commands| commands.download(self, &buffer, &regions));
        let staged = buffer.read();
        let levels =
            levels.iter().flat_map(|(region, bytes)| staged[region.buffer_offset as usize..][..*bytes].to_vec());
        levels.collect()
    }

    /// The device of the image.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        let device = self.gpu.device();
        // SAFETY: see the crate.
        unsafe {
            device.destroy_image_view(self.view, None);
            device.destroy_image_view(self.attachment, None);
            device.destroy_image(self.raw, None);
            device.free_memory(self.memory, None);
        }
    }
}

impl From<&Image> for vk::Image {
    fn from(image: &Image) -> Self {
        image.raw
    }
}

/// The device's format of the same name.
///
/// # Panics
/// If the device has none.
pub fn device_format(format: vk::Format) -> Format {
    let name = format!("{format:?}").trim_end_matches("_KHR").replace('_', "");
    let found = Format::ALL.iter().copied();
    let mut found = found.filter(|known| format!("{known:?}").eq_ignore_ascii_case(&name));
    found.next().expect("a format that the device has")
}

/// The format of an aspect's texels in buffers.
///
/// # Panics
/// If a format has no such aspect.
pub fn aspect_format(format: vk::Format, aspect: vk::ImageAspectFlags) -> Format {
    use simdevice::format::Aspect;
    let aspect = match aspect {
        vk::ImageAspectFlags::DEPTH => Aspect::Depth,
        vk::ImageAspectFlags::STENCIL => Aspect::Stencil,
        _ => Aspect::Color,
    };
    let plane = device_format(format).plane(aspect);
    plane.expect("a format with this aspect")
}

/// Bytes of a texel of one aspect when copied to a buffer.
///
/// # Panics
/// If the device has no such format.
pub fn texel_size(format: vk::Format) -> u32 {
    device_format(format).texel_size() as u32
}

/// The aspects of a format.
pub fn aspects(format: vk::Format) -> vk::ImageAspectFlags {
    use vk::Format as F;
    use vk::ImageAspectFlags as Aspect;
    match format {
        F::D16_UNORM | F::X8_D24_UNORM_PACK32 | F::D32_SFLOAT => Aspect::DEPTH,
        F::S8_UINT => Aspect::STENCIL,
        F::D16_UNORM_S8_UINT | F::D24_UNORM_S8_UINT | F::D32_SFLOAT_S8_UINT => Aspect::DEPTH | Aspect::STENCIL,
        _ => Aspect::COLOR,
    }
}

/// The formats of the depth and the stencil attachment; undefined for an aspect that the format lacks.
pub fn depth_and_stencil(format: vk::Format) -> (vk::Format, vk::Format) {
    let of = |aspect| {
        if aspects(format).contains(aspect) { format } else { vk::Format::UNDEFINED }
    };
    (of(vk::ImageAspectFlags::DEPTH), of(vk::ImageAspectFlags::STENCIL))
}

/// All levels and layers of the aspects.
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
    /// Creates the sampler.
    pub fn new(gpu: &Gpu, info: &vk::SamplerCreateInfo<'_>) -> Self {
        // SAFETY: see the crate.
        let raw = unsafe { gpu.device().create_sampler(info, None) }.expect("a sampler");
        Self { raw, gpu: gpu.clone() }
    }
}

impl Drop for Sampler {
    fn drop(&mut self) {
        // SAFETY: see the crate.
        unsafe { self.gpu.device().destroy_sampler(self.raw, None) };
    }
}
