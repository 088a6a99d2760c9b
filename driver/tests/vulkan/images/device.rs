//! A Vulkan device with images: this driver's, or lavapipe's through the loader.

use ash::vk;
use gaurast_runner::{Case, Missing, ignore};
use simdevice::Format;
use simdevice::format::Aspect;

pub const GENERAL: vk::ImageLayout = vk::ImageLayout::GENERAL;

/// A device with one queue.
pub struct Device {
    pub instance: ash::Instance,
    pub physical_device: vk::PhysicalDevice,
    pub device: ash::Device,
    queue: vk::Queue,
    pool: vk::CommandPool,
    mappable: u32,
    /// Dropping it unloads the loader.
    _entry: ash::Entry,
}

/// A mappable buffer with memory of its own.
#[derive(Clone, Copy)]
pub struct Buffer {
    pub buffer: vk::Buffer,
    memory: vk::DeviceMemory,
    size: u64,
}

/// The creation parameters of an image.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    pub format: vk::Format,
    pub ty: vk::ImageType,
    pub extent: [u32; 3],
    pub levels: u32,
    pub layers: u32,
    pub flags: vk::ImageCreateFlags,
}

/// An image with memory of its own, in the general layout.
#[derive(Clone, Copy)]
pub struct Image {
    pub image: vk::Image,
    memory: vk::DeviceMemory,
    pub shape: Shape,
}

impl Shape {
    /// A 2D image.
    pub fn flat(format: vk::Format, width: u32, height: u32) -> Self {
        Self {
            format,
            ty: vk::ImageType::TYPE_2D,
            extent: [width, height, 1],
            levels: 1,
            layers: 1,
            flags: vk::ImageCreateFlags::empty(),
        }
    }

    pub fn level_extent(&self, level: u32) -> [u32; 3] {
        self.extent.map(|size| (size >> level).max(1))
    }

    /// Texels, or blocks of texels, of a level of all layers.
    pub fn level_texels(&self, level: u32) -> usize {
        let side = device_format(self.format).block_side();
        let [width, height, depth] = self.level_extent(level);
        (width.div_ceil(side) * height.div_ceil(side) * depth * self.layers) as usize
    }

    /// Texels, or blocks of texels, of all levels and layers.
    pub fn texels(&self) -> usize {
        (0..self.levels).map(|level| self.level_texels(level)).sum()
    }

    /// The format of an aspect's texels in buffers.
    pub fn plane(&self, aspect: Aspect) -> Format {
        device_format(self.format).plane(aspect).unwrap()
    }
}

/// The device's format of the same name.
pub fn device_format(format: vk::Format) -> Format {
    let name = format!("{format:?}").replace('_', "");
    let found = Format::ALL.iter().copied();
    let mut found = found.filter(|known| format!("{known:?}").eq_ignore_ascii_case(&name));
    found.next().expect("a format that the device has")
}

pub fn aspect_flags(aspect: Aspect) -> vk::ImageAspectFlags {
    match aspect {
        Aspect::Color => vk::ImageAspectFlags::COLOR,
        Aspect::Depth => vk::ImageAspectFlags::DEPTH,
        Aspect::Stencil => vk::ImageAspectFlags::STENCIL,
    }
}

fn all_aspects(format: vk::Format) -> vk::ImageAspectFlags {
    let aspects = device_format(format).aspects().iter();
    aspects.fold(vk::ImageAspectFlags::empty(), |all, &aspect| {
        all | aspect_flags(aspect)
    })
}

impl Device {
    /// This driver, linked into the test.
    pub fn gaurast() -> Self {
        Self::open(vulkan_gaurast::entry(), |_| true).expect("the embedded device")
    }

    /// Lavapipe, through the loader.
    pub fn lavapipe() -> Self {
        // SAFETY: the loader is the system's own.
        let entry = unsafe { ash::Entry::load() }.expect("the system's loader");
        Self::open(entry, |id| id == vk::DriverId::MESA_LLVMPIPE).expect("lavapipe's device")
    }

    fn open(entry: ash::Entry, is_wanted: impl Fn(vk::DriverId) -> bool) -> Option<Self> {
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&application);
        // SAFETY: see the crate.
        unsafe {
            let instance = entry.create_instance(&info, None).ok()?;
            let devices = instance.enumerate_physical_devices().ok()?;
            let mut wanted = devices.into_iter().filter(|&device| {
                let mut driver = vk::PhysicalDeviceDriverProperties::default();
                let mut properties =
                    vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
                instance.get_physical_device_properties2(device, &mut properties);
                is_wanted(driver.driver_id)
            });
            let Some(physical_device) = wanted.next() else {
                drop(wanted);
                instance.destroy_instance(None);
                return None;
            };
            drop(wanted);
            let memory = instance.get_physical_device_memory_properties(physical_device);
            let coherent =
                vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
            let mappable = memory
                .memory_types_as_slice()
                .iter()
                .position(|ty| ty.property_flags.contains(coherent))?;
            let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
            let features = instance.get_physical_device_features(physical_device);
            let mut vulkan12 =
                vk::PhysicalDeviceVulkan12Features::default().sampler_mirror_clamp_to_edge(true);
            let info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .enabled_features(&features)
                .push_next(&mut vulkan12);
            let device = instance
                .create_device(physical_device, &info, None)
                .unwrap();
            let pool = device
                .create_command_pool(&vk::CommandPoolCreateInfo::default(), None)
                .unwrap();
            Some(Self {
                physical_device,
                queue: device.get_device_queue(0, 0),
                pool,
                mappable: mappable as u32,
                instance,
                device,
                _entry: entry,
            })
        }
    }

    /// The features of images of optimal tiling.
    pub fn features(&self, format: vk::Format) -> vk::FormatFeatureFlags {
        // SAFETY: see the crate.
        let properties = unsafe {
            self.instance
                .get_physical_device_format_properties(self.physical_device, format)
        };
        properties.optimal_tiling_features
    }

    /// The features of texel and vertex buffers.
    pub fn buffer_features(&self, format: vk::Format) -> vk::FormatFeatureFlags {
        // SAFETY: see the crate.
        let properties = unsafe {
            self.instance
                .get_physical_device_format_properties(self.physical_device, format)
        };
        properties.buffer_features
    }

    /// Records commands, submits them and waits.
    pub fn run(&self, record: impl FnOnce(&ash::Device, vk::CommandBuffer)) {
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(self.pool)
            .command_buffer_count(1);
        // SAFETY: see the crate.
        unsafe {
            let commands = self.device.allocate_command_buffers(&info).unwrap();
            let begin = vk::CommandBufferBeginInfo::default();
            self.device
                .begin_command_buffer(commands[0], &begin)
                .unwrap();
            record(&self.device, commands[0]);
            self.device.end_command_buffer(commands[0]).unwrap();
            let submit = [vk::SubmitInfo::default().command_buffers(&commands)];
            self.device
                .queue_submit(self.queue, &submit, vk::Fence::null())
                .unwrap();
            self.device.queue_wait_idle(self.queue).unwrap();
            self.device.free_command_buffers(self.pool, &commands);
        }
    }

    fn allocate(&self, requirements: vk::MemoryRequirements, mappable: bool) -> vk::DeviceMemory {
        let memory_type = if mappable {
            self.mappable
        } else {
            requirements.memory_type_bits.trailing_zeros()
        };
        let info = vk::MemoryAllocateInfo::default()
            .allocation_size(requirements.size)
            .memory_type_index(memory_type);
        // SAFETY: see the crate.
        unsafe { self.device.allocate_memory(&info, None).unwrap() }
    }

    /// A mappable buffer of zeros.
    pub fn buffer(&self, size: u64) -> Buffer {
        let info = vk::BufferCreateInfo::default().size(size).usage(
            vk::BufferUsageFlags::TRANSFER_SRC
                | vk::BufferUsageFlags::TRANSFER_DST
                | vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER
                | vk::BufferUsageFlags::STORAGE_TEXEL_BUFFER
                | vk::BufferUsageFlags::STORAGE_BUFFER,
        );
        // SAFETY: see the crate.
        unsafe {
            let buffer = self.device.create_buffer(&info, None).unwrap();
            let requirements = self.device.get_buffer_memory_requirements(buffer);
            let memory = self.allocate(requirements, true);
            self.device.bind_buffer_memory(buffer, memory, 0).unwrap();
            let buffer = Buffer {
                buffer,
                memory,
                size,
            };
            self.write(buffer, &vec![0; size as usize]);
            buffer
        }
    }

    /// Writes to the beginning of a buffer.
    pub fn write(&self, buffer: Buffer, bytes: &[u8]) {
        assert!(bytes.len() as u64 <= buffer.size);
        let flags = vk::MemoryMapFlags::empty();
        // SAFETY: see the crate; the mapping has room for the bytes.
        unsafe {
            let mapped = self
                .device
                .map_memory(buffer.memory, 0, vk::WHOLE_SIZE, flags)
                .unwrap();
            std::ptr::copy_nonoverlapping(bytes.as_ptr(), mapped.cast(), bytes.len());
            self.device.unmap_memory(buffer.memory);
        }
    }

    /// A buffer's bytes.
    pub fn read(&self, buffer: Buffer) -> Vec<u8> {
        let mut bytes = vec![0; buffer.size as usize];
        let flags = vk::MemoryMapFlags::empty();
        // SAFETY: see the crate; the mapping has as many bytes.
        unsafe {
            let mapped = self
                .device
                .map_memory(buffer.memory, 0, vk::WHOLE_SIZE, flags)
                .unwrap();
            std::ptr::copy_nonoverlapping(mapped.cast(), bytes.as_mut_ptr(), bytes.len());
            self.device.unmap_memory(buffer.memory);
        }
        bytes
    }

    pub fn free_buffer(&self, buffer: Buffer) {
        // SAFETY: see the crate.
        unsafe {
            self.device.destroy_buffer(buffer.buffer, None);
            self.device.free_memory(buffer.memory, None);
        }
    }

    /// An image with these usages besides transfers.
    pub fn image(&self, shape: Shape, usage: vk::ImageUsageFlags) -> Image {
        let [width, height, depth] = shape.extent;
        let info = vk::ImageCreateInfo::default()
            .flags(shape.flags)
            .image_type(shape.ty)
            .format(shape.format)
            .extent(vk::Extent3D {
                width,
                height,
                depth,
            })
            .mip_levels(shape.levels)
            .array_layers(shape.layers)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(usage | vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST);
        // SAFETY: see the crate.
        let (image, memory) = unsafe {
            let image = self.device.create_image(&info, None).unwrap();
            let requirements = self.device.get_image_memory_requirements(image);
            let memory = self.allocate(requirements, false);
            self.device.bind_image_memory(image, memory, 0).unwrap();
            (image, memory)
        };
        self.run(|device, commands| {
            let barrier = vk::ImageMemoryBarrier::default()
                .new_layout(GENERAL)
                .image(image)
                .subresource_range(vk::ImageSubresourceRange {
                    aspect_mask: all_aspects(shape.format),
                    base_mip_level: 0,
                    level_count: shape.levels,
                    base_array_layer: 0,
                    layer_count: shape.layers,
                });
            let all = vk::PipelineStageFlags::ALL_COMMANDS;
            let none = vk::DependencyFlags::empty();
            // SAFETY: see the crate.
            unsafe { device.cmd_pipeline_barrier(commands, all, all, none, &[], &[], &[barrier]) };
        });
        Image {
            image,
            memory,
            shape,
        }
    }

    pub fn free_image(&self, image: Image) {
        // SAFETY: see the crate.
        unsafe {
            self.device.destroy_image(image.image, None);
            self.device.free_memory(image.memory, None);
        }
    }

    /// A copy of every level of an aspect, tightly packed: levels from the largest down, in them layers.
    fn regions(image: &Image, aspect: Aspect) -> Vec<vk::BufferImageCopy> {
        let texel_size = image.shape.plane(aspect).texel_size() as u64;
        let mut offset = 0;
        (0..image.shape.levels)
            .map(|level| {
                let [width, height, depth] = image.shape.level_extent(level);
                let region = vk::BufferImageCopy::default()
                    .buffer_offset(offset)
                    .image_subresource(vk::ImageSubresourceLayers {
                        aspect_mask: aspect_flags(aspect),
                        mip_level: level,
                        base_array_layer: 0,
                        layer_count: image.shape.layers,
                    })
                    .image_extent(vk::Extent3D {
                        width,
                        height,
                        depth,
                    });
                let texels = image.shape.level_texels(level) as u64;
                // Offsets are multiples of texels and of four.
                offset = (offset + texels * texel_size).next_multiple_of(48);
                region
            })
            .collect()
    }

    fn staging_size(image: &Image, aspect: Aspect) -> u64 {
        let texel_size = image.shape.plane(aspect).texel_size() as u64;
        image.shape.texels() as u64 * texel_size + 48 * u64::from(image.shape.levels)
    }

    /// Writes all texels of an aspect, levels from the largest down, in them layers.
    pub fn upload(&self, image: &Image, aspect: Aspect, texels: &[u8]) {
        let buffer = self.buffer(Self::staging_size(image, aspect));
        let regions = Self::regions(image, aspect);
        let mut staged = vec![0; buffer.size as usize];
        let mut rest = texels;
        for region in &regions {
            let (level, after) = rest.split_at(Self::region_bytes(image, aspect, region));
            staged[region.buffer_offset as usize..][..level.len()].copy_from_slice(level);
            rest = after;
        }
        assert!(rest.is_empty());
        self.write(buffer, &staged);
        self.run(|device, commands| {
            let (from, to) = (buffer.buffer, image.image);
            // SAFETY: see the crate.
            unsafe { device.cmd_copy_buffer_to_image(commands, from, to, GENERAL, &regions) };
        });
        self.free_buffer(buffer);
    }

    fn region_bytes(image: &Image, aspect: Aspect, region: &vk::BufferImageCopy) -> usize {
        let texels = image.shape.level_texels(region.image_subresource.mip_level);
        texels * image.shape.plane(aspect).texel_size()
    }

    /// All texels of an aspect, in the order of [`Self::upload`].
    pub fn download(&self, image: &Image, aspect: Aspect) -> Vec<u8> {
        let buffer = self.buffer(Self::staging_size(image, aspect));
        let regions = Self::regions(image, aspect);
        self.run(|device, commands| {
            let (from, to) = (image.image, buffer.buffer);
            // SAFETY: see the crate.
            unsafe { device.cmd_copy_image_to_buffer(commands, from, GENERAL, to, &regions) };
        });
        let staged = self.read(buffer);
        self.free_buffer(buffer);
        let levels = regions.iter().flat_map(|region| {
            let bytes = Self::region_bytes(image, aspect, region);
            staged[region.buffer_offset as usize..][..bytes].to_vec()
        });
        levels.collect()
    }
}

/// The formats that both devices are capable of something with, and those that ours alone is.
pub struct Formats {
    pub of_both: Vec<vk::Format>,
    pub of_ours_alone: Vec<vk::Format>,
}

/// Finds the formats up to `last` with which devices are capable of something, as `is_capable` says.
pub fn formats(
    ours: &Device,
    theirs: &Device,
    last: vk::Format,
    is_capable: impl Fn(&Device, vk::Format) -> bool,
) -> Formats {
    let all = (1..=last.as_raw()).map(vk::Format::from_raw);
    let (of_both, of_ours_alone) = all
        .filter(|&format| is_capable(ours, format))
        .partition(|&format| is_capable(theirs, format));
    Formats {
        of_both,
        of_ours_alone,
    }
}

/// Ends the test as ignored if some of lavapipe's `operations` lack formats beside those that are known to be missing,
/// so that less was compared than should be.
pub fn expect_lacking(operations: &str, lacking: &[vk::Format], known: &[vk::Format]) {
    let new: Vec<_> = lacking
        .iter()
        .filter(|format| !known.contains(format))
        .collect();
    if !new.is_empty() {
        let reason = format!("lavapipe's {operations} lack {new:?}");
        ignore(Missing::Capability, reason);
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: see the crate.
        unsafe {
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
            self.instance.destroy_instance(None);
        }
    }
}

/// Runs `inside` on this device and lavapipe, in a process of its own where lavapipe filters in binary32 and takes no
/// short cuts. The test needs lavapipe.
pub fn exactly(case: &Case, inside: impl FnOnce(&Device, &Device)) {
    if case.is_alone() {
        return inside(&Device::gaurast(), &Device::lavapipe());
    }
    let exact = "no_aos_sampling,no_quad_lod,no_brilinear,no_rho_approx";
    let manifest = gaurast_runner::lavapipe_manifest().expect("the test needs lavapipe");
    case.run_alone(|command| {
        command
            .env("GALLIVM_PERF", exact)
            .env("VK_DRIVER_FILES", &manifest)
            .env("VK_ICD_FILENAMES", &manifest);
    });
}
