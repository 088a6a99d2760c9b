//! Images with chroma for tests: their planes as the names of formats say, random texels, and memory.

use ash::vk;
use gaurast_testkit::texels::Noise;
use gaurast_testkit::{Buffer, Gpu};

/// The arrangement of luma and chroma.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrangement {
    /// One plane: luma, Cb, luma, Cr.
    LumaFirst,
    /// One plane: Cb, luma, Cr, luma.
    ChromaFirst,
    /// A plane of luma and one of chroma, whose texels are for these numbers of luma's.
    Two([u32; 2]),
    /// A plane of luma, one of Cb and one of Cr.
    Three([u32; 2]),
}

impl Arrangement {
    /// The texels of luma for each of chroma, along x and y.
    pub fn spacing(self) -> [u32; 2] {
        match self {
            Self::LumaFirst | Self::ChromaFirst => [2, 1],
            Self::Two(spacing) | Self::Three(spacing) => spacing,
        }
    }

    /// The number of planes.
    pub fn planes(self) -> usize {
        match self {
            Self::LumaFirst | Self::ChromaFirst => 1,
            Self::Two(_) => 2,
            Self::Three(_) => 3,
        }
    }
}

/// A component of chroma.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chroma {
    /// Cb.
    Cb,
    /// Cr.
    Cr,
}

/// A format and the size of an image.
#[derive(Clone, Copy, Debug)]
pub struct ImagePlan {
    /// The format.
    pub format: vk::Format,
    /// Its bits per component.
    pub bits: u32,
    /// Its arrangement.
    pub arrangement: Arrangement,
    /// The texels of luma.
    pub size: [u32; 2],
}

impl ImagePlan {
    /// Images of all formats with chroma.
    pub fn all(size: [u32; 2]) -> Vec<Self> {
        let core = vk::Format::G8B8G8R8_422_UNORM.as_raw()..=vk::Format::G16_B16_R16_3PLANE_444_UNORM.as_raw();
        let later = vk::Format::G8_B8R8_2PLANE_444_UNORM.as_raw()..=vk::Format::G16_B16R16_2PLANE_444_UNORM.as_raw();
        core.chain(later).map(vk::Format::from_raw).filter_map(|format| Self::new(format, size)).collect()
    }

    /// An image of a format; `None` if the format's name says that it has no chroma.
    pub fn new(format: vk::Format, size: [u32; 2]) -> Option<Self> {
        let name = format!("{format:?}");
        let has = |part: &str| name.contains(part);
        let spacing = match () {
            () if has("_420") => [2, 2],
            () if has("_422") => [2, 1],
            () if has("_444") => [1, 1],
            () => return None,
        };
        let arrangement = match () {
            () if has("2PLANE") => Arrangement::Two(spacing),
            () if has("3PLANE") => Arrangement::Three(spacing),
            () if name.starts_with('G') => Arrangement::LumaFirst,
            () => Arrangement::ChromaFirst,
        };
        let digits = name[1..].find(|letter: char| !letter.is_ascii_digit())?;
        Some(Self { format, bits: name[1..=digits].parse().ok()?, arrangement, size })
    }

    /// The texels of a plane, and the components of each. A texel of a single plane is for one of luma.
    pub fn plane(&self, number: usize) -> ([u32; 2], usize) {
        let [width, height] = self.size;
        let [columns, rows] = self.arrangement.spacing();
        match (self.arrangement, number) {
            (Arrangement::LumaFirst | Arrangement::ChromaFirst, _) => (self.size, 2),
            (_, 0) => (self.size, 1),
            (Arrangement::Two(_), _) => ([width / columns, height / rows], 2),
            _ => ([width / columns, height / rows], 1),
        }
    }

    /// The bytes of a component.
    pub fn component_size(&self) -> usize {
        if self.bits == 8 { 1 } else { 2 }
    }

    /// The aspect of a plane.
    pub fn aspect(&self, number: usize) -> vk::ImageAspectFlags {
        match (self.arrangement.planes(), number) {
            (1, _) => vk::ImageAspectFlags::COLOR,
            (_, 0) => vk::ImageAspectFlags::PLANE_0,
            (_, 1) => vk::ImageAspectFlags::PLANE_1,
            _ => vk::ImageAspectFlags::PLANE_2,
        }
    }

    /// A copy of a whole plane, from or to tightly packed texels at an offset.
    pub fn region(&self, number: usize, offset: u64) -> vk::BufferImageCopy {
        let ([width, height], _) = self.plane(number);
        vk::BufferImageCopy::default()
            .buffer_offset(offset)
            .image_subresource(layers(self.aspect(number)))
            .image_extent(vk::Extent3D { width, height, depth: 1 })
    }
}

/// The only layer and level of an aspect.
pub fn layers(aspect: vk::ImageAspectFlags) -> vk::ImageSubresourceLayers {
    vk::ImageSubresourceLayers { aspect_mask: aspect, mip_level: 0, base_array_layer: 0, layer_count: 1 }
}

/// The contents of an image: the codes of the components of each plane.
#[derive(Clone, Debug)]
pub struct Picture {
    /// The image.
    pub plan: ImagePlan,
    codes: Vec<Vec<u16>>,
}

impl Picture {
    /// Random codes.
    pub fn random(plan: ImagePlan, noise: &mut Noise) -> Self {
        let plane = |number| {
            let ([width, height], components) = plan.plane(number);
            let count = (width * height) as usize * components;
            (0..count).map(|_| (noise.bits() & ((1 << plan.bits) - 1)) as u16).collect()
        };
        Self { plan, codes: (0..plan.arrangement.planes()).map(plane).collect() }
    }

    /// The bytes of each plane's texels, tightly packed. Codes of ten and twelve bits are at the upper end of words.
    pub fn bytes(&self) -> Vec<Vec<u8>> {
        let shift = 8 * self.plan.component_size() as u32 - self.plan.bits;
        let bytes = |codes: &Vec<u16>| match self.plan.component_size() {
            1 => codes.iter().map(|&code| code as u8).collect(),
            _ => codes.iter().flat_map(|code| (code << shift).to_le_bytes()).collect::<Vec<u8>>(),
        };
        self.codes.iter().map(bytes).collect()
    }

    /// A component as a number from 0 to 1. The texel is clamped to the plane.
    fn component(&self, plane: usize, [width, height]: [u32; 2], stride: usize, at: [i64; 2], index: usize) -> f64 {
        let [x, y] = [at[0].clamp(0, i64::from(width) - 1), at[1].clamp(0, i64::from(height) - 1)];
        let code = self.codes[plane][(y * i64::from(width) + x) as usize * stride + index];
        f64::from(code) / f64::from((1u32 << self.plan.bits) - 1)
    }

    /// The luma of a texel, which is clamped to the image.
    pub fn luma(&self, at: [i64; 2]) -> f64 {
        match self.plan.arrangement {
            Arrangement::LumaFirst => self.component(0, self.plan.size, 2, at, 0),
            Arrangement::ChromaFirst => self.component(0, self.plan.size, 2, at, 1),
            _ => self.component(0, self.plan.size, 1, at, 0),
        }
    }

    /// A component of a texel of chroma, which is clamped to the image.
    pub fn chroma(&self, which: Chroma, at: [i64; 2]) -> f64 {
        let [width, height] = self.plan.size;
        let number = usize::from(which == Chroma::Cr);
        match self.plan.arrangement {
            Arrangement::LumaFirst => self.component(0, [width / 2, height], 4, at, 1 + 2 * number),
            Arrangement::ChromaFirst => self.component(0, [width / 2, height], 4, at, 2 * number),
            Arrangement::Two(_) => self.component(1, self.plan.plane(1).0, 2, at, number),
            Arrangement::Three(_) => self.component(1 + number, self.plan.plane(1).0, 1, at, 0),
        }
    }
}

/// An image with chroma in the layout `GENERAL`.
pub struct YcbcrImage {
    /// The image.
    pub raw: vk::Image,
    /// Its format and size.
    pub plan: ImagePlan,
    /// The memory of all planes, or of each.
    memory: Vec<vk::DeviceMemory>,
    gpu: Gpu,
}

impl YcbcrImage {
    /// An image in one memory.
    pub fn joint(gpu: &Gpu, plan: ImagePlan) -> Self {
        Self::new(gpu, plan, vk::ImageTiling::OPTIMAL, vk::ImageCreateFlags::empty(), vk::ImageUsageFlags::SAMPLED)
    }

    /// An image whose planes are in memory of their own.
    pub fn disjoint(gpu: &Gpu, plan: ImagePlan) -> Self {
        Self::new(gpu, plan, vk::ImageTiling::OPTIMAL, vk::ImageCreateFlags::DISJOINT, vk::ImageUsageFlags::SAMPLED)
    }

    /// A linear image.
    pub fn linear(gpu: &Gpu, plan: ImagePlan, is_disjoint: bool) -> Self {
        let flags = if is_disjoint { vk::ImageCreateFlags::DISJOINT } else { vk::ImageCreateFlags::empty() };
        Self::new(gpu, plan, vk::ImageTiling::LINEAR, flags, vk::ImageUsageFlags::SAMPLED)
    }

    /// An image with this tiling and these flags, in mappable memory, for copies and further usages.
    pub fn new(
        gpu: &Gpu,
        plan: ImagePlan,
        tiling: vk::ImageTiling,
        flags: vk::ImageCreateFlags,
        usage: vk::ImageUsageFlags,
    ) -> Self {
        let [width, height] = plan.size;
        let info = vk::ImageCreateInfo::default()
            .flags(flags)
            .image_type(vk::ImageType::TYPE_2D)
            .format(plan.format)
            .extent(vk::Extent3D { width, height, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(tiling)
            .usage(usage | vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST);
        let device = gpu.device();
        // SAFETY: see the crate.
        let raw = unsafe { device.create_image(&info, None) }.expect("an image");
        let mut image = Self { raw, plan, memory: Vec::new(), gpu: gpu.clone() };
        if flags.contains(vk::ImageCreateFlags::DISJOINT) {
            image.bind_planes(&info);
        } else {
            // SAFETY: see the crate.
            unsafe {
                let needed = device.get_image_memory_requirements(raw);
                let memory = image.allocate(needed, 0);
                device.bind_image_memory(raw, memory, 0).expect("memory");
            }
        }
        let range = vk::ImageSubresourceRange {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            base_mip_level: 0,
            level_count: 1,
            base_array_layer: 0,
            layer_count: 1,
        };
        gpu.run(|commands| commands.become_general(raw, range));
        image
    }

    /// Allocates memory with some bytes before the image.
    fn allocate(&mut self, needed: vk::MemoryRequirements, before: u64) -> vk::DeviceMemory {
        let mappable = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        let ty = self.gpu.memory_type(needed.memory_type_bits, mappable);
        let memory = gaurast_testkit::devices::allocate(&self.gpu, needed.size + before, ty);
        self.memory.push(memory);
        memory
    }

    /// Binds each plane to memory of its own, at the second place that its alignment allows; the last plane first.
    fn bind_planes(&mut self, info: &vk::ImageCreateInfo<'_>) {
        let device = self.gpu.device().clone();
        let mut places = Vec::new();
        for number in 0..self.plan.arrangement.planes() {
            let aspect = self.plan.aspect(number);
            let mut plane = vk::ImagePlaneMemoryRequirementsInfo::default().plane_aspect(aspect);
            let of_image = vk::ImageMemoryRequirementsInfo2::default().image(self.raw).push_next(&mut plane);
            let mut needed = vk::MemoryRequirements2::default();
            let of_info = vk::DeviceImageMemoryRequirements::default().create_info(info).plane_aspect(aspect);
            let mut same = vk::MemoryRequirements2::default();
            // SAFETY: see the crate.
            unsafe {
                device.get_image_memory_requirements2(&of_image, &mut needed);
                device.get_device_image_memory_requirements(&of_info, &mut same);
            }
            let needed = needed.memory_requirements;
            assert_eq!((needed.size, needed.alignment), (same.memory_requirements.size, needed.alignment));
            let memory = self.allocate(needed, needed.alignment);
            places.push((aspect, memory, needed.alignment));
        }
        for (aspect, memory, offset) in places.into_iter().rev() {
            let mut plane = vk::BindImagePlaneMemoryInfo::default().plane_aspect(aspect);
            let info = vk::BindImageMemoryInfo::default()
                .image(self.raw)
                .memory(memory)
                .memory_offset(offset)
                .push_next(&mut plane);
            // SAFETY: see the crate.
            unsafe { device.bind_image_memory2(&[info]) }.expect("memory of a plane");
        }
    }

    /// A view of all planes.
    pub fn view(&self, conversion: vk::SamplerYcbcrConversion) -> vk::ImageView {
        let mut chained = vk::SamplerYcbcrConversionInfo::default().conversion(conversion);
        let info = self.view_info(self.plan.format, vk::ImageAspectFlags::COLOR).push_next(&mut chained);
        // SAFETY: see the crate.
        unsafe { self.gpu.device().create_image_view(&info, None) }.expect("a view")
    }

    /// The create info of a view of an aspect.
    pub fn view_info(&self, format: vk::Format, aspect: vk::ImageAspectFlags) -> vk::ImageViewCreateInfo<'static> {
        vk::ImageViewCreateInfo::default()
            .image(self.raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(vk::ImageSubresourceRange {
                aspect_mask: aspect,
                base_mip_level: 0,
                level_count: 1,
                base_array_layer: 0,
                layer_count: 1,
            })
    }

    /// Copies of all planes from or to a buffer, and its size.
    fn regions(&self) -> (Vec<vk::BufferImageCopy>, Vec<std::ops::Range<usize>>) {
        let mut end = 0;
        let planes = (0..self.plan.arrangement.planes()).map(|number| {
            let ([width, height], components) = self.plan.plane(number);
            let begin = end;
            let size = (width * height) as usize * components * self.plan.component_size();
            end = (begin + size).next_multiple_of(16);
            (self.plan.region(number, begin as u64), begin..begin + size)
        });
        planes.unzip()
    }

    /// Copies a picture to the planes by one command.
    pub fn upload(&self, picture: &Picture) {
        let (regions, ranges) = self.regions();
        let mut staged = vec![0u8; ranges.last().map_or(0, |range| range.end)];
        for (range, bytes) in ranges.iter().zip(picture.bytes()) {
            staged[range.clone()].copy_from_slice(&bytes);
        }
        let buffer = Buffer::of(&self.gpu, &staged);
        self.gpu.run(|commands| commands.upload(&buffer, self.raw, &regions));
    }

    /// The bytes of each plane, copied by one command.
    pub fn download(&self) -> Vec<Vec<u8>> {
        let (regions, ranges) = self.regions();
        let buffer = Buffer::new(&self.gpu, ranges.last().map_or(0, |range| range.end) as u64);
        self.gpu.run(|commands| commands.download(self.raw, &buffer, &regions));
        let bytes = buffer.read();
        ranges.into_iter().map(|range| bytes[range].to_vec()).collect()
    }

    /// Writes a picture to the mapped memory of a linear image.
    pub fn write_mapped(&self, picture: &Picture) {
        let device = self.gpu.device();
        let is_disjoint = self.memory.len() > 1;
        for (number, bytes) in picture.bytes().into_iter().enumerate() {
            let ([width, height], components) = self.plan.plane(number);
            let row = width as usize * components * self.plan.component_size();
            let aspect = self.plan.aspect(number);
            let subresource = vk::ImageSubresource { aspect_mask: aspect, mip_level: 0, array_layer: 0 };
            // SAFETY: see the crate; rows lie within the plane, as is checked.
            unsafe {
                let layout = device.get_image_subresource_layout(self.raw, subresource);
                let (memory, before) = match is_disjoint {
                    true => {
                        let mut plane = vk::ImagePlaneMemoryRequirementsInfo::default().plane_aspect(aspect);
                        let info = vk::ImageMemoryRequirementsInfo2::default().image(self.raw).push_next(&mut plane);
                        let mut needed = vk::MemoryRequirements2::default();
                        device.get_image_memory_requirements2(&info, &mut needed);
                        assert!(layout.offset + layout.size <= needed.memory_requirements.size);
                        (self.memory[number], needed.memory_requirements.alignment)
                    }
                    false => {
                        let needed = device.get_image_memory_requirements(self.raw);
                        assert!(layout.offset + layout.size <= needed.size);
                        (self.memory[0], 0)
                    }
                };
                assert!(layout.row_pitch * u64::from(height - 1) + row as u64 <= layout.size);
                let flags = vk::MemoryMapFlags::empty();
                let mapped = device.map_memory(memory, 0, vk::WHOLE_SIZE, flags).expect("a mapping").cast::<u8>();
                for (y, bytes) in bytes.chunks(row).enumerate() {
                    let at = before + layout.offset + y as u64 * layout.row_pitch;
                    mapped.add(at as usize).copy_from_nonoverlapping(bytes.as_ptr(), bytes.len());
                }
                device.unmap_memory(memory);
            }
        }
    }
}

impl Drop for YcbcrImage {
    fn drop(&mut self) {
        let device = self.gpu.device();
        // SAFETY: see the crate.
        unsafe {
            device.destroy_image(self.raw, None);
            self.memory.iter().for_each(|&memory| device.free_memory(memory, None));
        }
    }
}
