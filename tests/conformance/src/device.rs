//! A Vulkan device under test: an instance, a device with every feature of the extension that it supports, and a queue.
//!
//! The reason for all `unsafe` in this crate is the same: these are Vulkan calls on objects of one [`Device`], made as
//! the specification allows, and every submission is waited for before the objects that it uses are destroyed.

use std::cell::RefCell;
use std::ffi::c_void;
use std::path::Path;

use ash::vk;
use bytemuck::{AnyBitPattern, NoUninit};
use gaurast::gaussian_primitive_topology;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as Features;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST as Properties;

/// The reason for which a command failed, or no device can be tested.
#[derive(Debug)]
pub struct Error(pub String);

impl From<vk::Result> for Error {
    fn from(result: vk::Result) -> Self {
        Self(format!("Vulkan answers {result:?}"))
    }
}

/// The device under test.
pub struct Device {
    pool: vk::CommandPool,
    queue: vk::Queue,
    pub(crate) gaussian: gaussian_primitive_topology::Device,
    pub(crate) raw: ash::Device,
    memory: vk::PhysicalDeviceMemoryProperties,
    pub(crate) physical_device: vk::PhysicalDevice,
    pub(crate) instance: ash::Instance,
    /// The supported features, all of which are enabled.
    pub features: Features<'static>,
    depth_bounds: bool,
    /// The extension's properties.
    pub properties: Properties<'static>,
    /// The device's name.
    pub name: String,
    /// Dropped last, because it may own the library of all functions above.
    _entry: ash::Entry,
}

impl Device {
    /// Opens a driver's device. `driver` is one of these: `embedded` for the driver that is linked into this program;
    /// the path of a manifest, which becomes the loader's only one; `loader` for the loader's first device that draws
    /// Gaussians; or a part of such a device's name.
    ///
    /// # Errors
    /// If there is no such device, or Vulkan fails.
    pub fn open(driver: &str) -> Result<Self, Error> {
        if driver == "embedded" {
            return Self::of(vulkan_gaurast::entry(), "");
        }
        let is_manifest = Path::new(driver)
            .extension()
            .is_some_and(|extension| extension == "json");
        if is_manifest {
            for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
                // SAFETY: the program opens its device before it starts a second thread.
                unsafe { std::env::set_var(variable, driver) };
            }
        }
        // SAFETY: the library is the system's Vulkan loader.
        let entry = unsafe { ash::Entry::load() };
        let entry = entry.map_err(|error| Error(format!("there is no Vulkan loader: {error}")))?;
        let any = is_manifest || driver == "loader";
        Self::of(entry, if any { "" } else { driver })
    }

    /// Opens the first device of `entry` that draws Gaussians and whose name contains `name`.
    ///
    /// # Errors
    /// If there is no such device, or Vulkan fails.
    pub fn of(entry: ash::Entry, name: &str) -> Result<Self, Error> {
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let instance_info = vk::InstanceCreateInfo::default().application_info(&application);
        // SAFETY: see the module.
        unsafe {
            let instance = entry.create_instance(&instance_info, None)?;
            let Some(physical_device) = find(&instance, name)? else {
                instance.destroy_instance(None);
                return Err(Error(
                    "no device has the extension and such a name".to_owned(),
                ));
            };
            let mut features = Features::default();
            let mut features_2 = vk::PhysicalDeviceFeatures2::default().push_next(&mut features);
            instance.get_physical_device_features2(physical_device, &mut features_2);
            let core = features_2.features;
            features.p_next = std::ptr::null_mut();
            let mut properties = Properties::default();
            let mut properties_2 =
                vk::PhysicalDeviceProperties2::default().push_next(&mut properties);
            instance.get_physical_device_properties2(physical_device, &mut properties_2);
            let name = properties_2
                .properties
                .device_name_as_c_str()
                .unwrap_or_default();
            let name = name.to_string_lossy().into_owned();
            properties.p_next = std::ptr::null_mut();

            let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
            let extensions = [gaussian_primitive_topology::NAME.as_ptr()];
            let mut enabled = features;
            let mut vulkan_1_3 =
                vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true);
            let core =
                vk::PhysicalDeviceFeatures::default().depth_bounds(core.depth_bounds != vk::FALSE);
            let device_info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .enabled_extension_names(&extensions)
                .enabled_features(&core)
                .push_next(&mut vulkan_1_3)
                .push_next(&mut enabled);
            let raw = instance.create_device(physical_device, &device_info, None)?;
            let pool = raw.create_command_pool(&vk::CommandPoolCreateInfo::default(), None)?;
            Ok(Self {
                pool,
                queue: raw.get_device_queue(0, 0),
                gaussian: gaussian_primitive_topology::Device::new(&instance, &raw),
                memory: instance.get_physical_device_memory_properties(physical_device),
                raw,
                physical_device,
                instance,
                features,
                depth_bounds: core.depth_bounds != vk::FALSE,
                properties,
                name,
                _entry: entry,
            })
        }
    }

    /// Returns true if images of a format can have a usage and can be copied from and to.
    pub(crate) fn has_format(&self, format: vk::Format, usage: vk::FormatFeatureFlags) -> bool {
        // SAFETY: see the module.
        let properties = unsafe {
            self.instance
                .get_physical_device_format_properties(self.physical_device, format)
        };
        properties.optimal_tiling_features.contains(usage)
    }

    /// Returns true if the device supports the depth bounds test.
    pub(crate) fn has_depth_bounds(&self) -> bool {
        self.depth_bounds
    }

    /// Records commands, submits them and waits for their completion.
    pub(crate) fn run(&self, record: impl FnOnce(vk::CommandBuffer)) -> Result<(), Error> {
        let allocate_info = vk::CommandBufferAllocateInfo::default()
            .command_pool(self.pool)
            .command_buffer_count(1);
        // SAFETY: see the module.
        unsafe {
            let commands = self.raw.allocate_command_buffers(&allocate_info)?;
            self.raw
                .begin_command_buffer(commands[0], &vk::CommandBufferBeginInfo::default())?;
            record(commands[0]);
            let ended = self.raw.end_command_buffer(commands[0]);
            let submits = [vk::SubmitInfo::default().command_buffers(&commands)];
            let submitted = ended.and_then(|()| {
                self.raw
                    .queue_submit(self.queue, &submits, vk::Fence::null())?;
                self.raw.queue_wait_idle(self.queue)
            });
            self.raw.free_command_buffers(self.pool, &commands);
            Ok(submitted?)
        }
    }

    fn memory_type(&self, bits: u32, flags: vk::MemoryPropertyFlags) -> u32 {
        let types = self.memory.memory_types_as_slice();
        let allowed = || (0..types.len() as u32).filter(|index| bits >> index & 1 == 1);
        let fits = |index: &u32| types[*index as usize].property_flags.contains(flags);
        allowed().find(fits).or(allowed().next()).unwrap_or(0)
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: see the module; every scope has ended.
        unsafe {
            self.raw.destroy_command_pool(self.pool, None);
            self.raw.destroy_device(None);
            self.instance.destroy_instance(None);
        }
    }
}

/// The first physical device with the extension whose name contains `name`.
fn find(instance: &ash::Instance, name: &str) -> Result<Option<vk::PhysicalDevice>, vk::Result> {
    // SAFETY: see the module.
    unsafe {
        for device in instance.enumerate_physical_devices()? {
            let extensions = instance.enumerate_device_extension_properties(device)?;
            let properties = instance.get_physical_device_properties(device);
            let own = properties
                .device_name_as_c_str()
                .unwrap_or_default()
                .to_string_lossy();
            if own.contains(name)
                && extensions.iter().any(|extension| {
                    extension.extension_name_as_c_str() == Ok(gaussian_primitive_topology::NAME)
                })
            {
                return Ok(Some(device));
            }
        }
        Ok(None)
    }
}

type Destroy = Box<dyn FnOnce(&ash::Device)>;

/// The objects of one draw. They are destroyed together, in reverse order of creation.
pub(crate) struct Scope<'a> {
    pub(crate) device: &'a Device,
    objects: RefCell<Vec<Destroy>>,
}

/// A host-visible buffer.
#[derive(Clone, Copy)]
pub(crate) struct Buffer {
    pub(crate) raw: vk::Buffer,
    pub(crate) size: u64,
    mapped: *mut c_void,
}

/// An image with its view.
#[derive(Clone, Copy)]
pub(crate) struct Image {
    pub(crate) raw: vk::Image,
    pub(crate) view: vk::ImageView,
    pub(crate) aspect: vk::ImageAspectFlags,
}

impl<'a> Scope<'a> {
    pub(crate) fn new(device: &'a Device) -> Self {
        Self {
            device,
            objects: RefCell::default(),
        }
    }

    /// Registers a function that is called at the end of the scope.
    pub(crate) fn later(&self, destroy: impl FnOnce(&ash::Device) + 'static) {
        self.objects.borrow_mut().push(Box::new(destroy));
    }

    fn allocate(
        &self,
        requirements: vk::MemoryRequirements,
        flags: vk::MemoryPropertyFlags,
    ) -> Result<vk::DeviceMemory, Error> {
        let allocate_info = vk::MemoryAllocateInfo::default()
            .allocation_size(requirements.size)
            .memory_type_index(
                self.device
                    .memory_type(requirements.memory_type_bits, flags),
            );
        // SAFETY: see the module.
        let memory = unsafe { self.device.raw.allocate_memory(&allocate_info, None)? };
        // SAFETY: see the module.
        self.later(move |device| unsafe { device.free_memory(memory, None) });
        Ok(memory)
    }

    /// A buffer of zeros.
    pub(crate) fn buffer(&self, size: u64) -> Result<Buffer, Error> {
        use vk::BufferUsageFlags as Usage;
        use vk::MemoryPropertyFlags as Flags;
        let size = size.max(16);
        let usage = Usage::TRANSFER_SRC
            | Usage::TRANSFER_DST
            | Usage::VERTEX_BUFFER
            | Usage::INDEX_BUFFER
            | Usage::INDIRECT_BUFFER
            | Usage::UNIFORM_BUFFER;
        let create_info = vk::BufferCreateInfo::default().size(size).usage(usage);
        let device = &self.device.raw;
        // SAFETY: see the module; the mapping is large enough for the bytes.
        unsafe {
            let raw = device.create_buffer(&create_info, None)?;
            self.later(move |device| device.destroy_buffer(raw, None));
            let requirements = device.get_buffer_memory_requirements(raw);
            let memory = self.allocate(requirements, Flags::HOST_VISIBLE | Flags::HOST_COHERENT)?;
            device.bind_buffer_memory(raw, memory, 0)?;
            let mapped =
                device.map_memory(memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty())?;
            mapped.cast::<u8>().write_bytes(0, size as usize);
            Ok(Buffer { raw, size, mapped })
        }
    }

    /// A buffer that holds `data`.
    pub(crate) fn buffer_of<T: NoUninit>(&self, data: &[T]) -> Result<Buffer, Error> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let buffer = self.buffer(bytes.len() as u64)?;
        // SAFETY: see the module; the buffer is large enough for the bytes.
        unsafe {
            buffer
                .mapped
                .cast::<u8>()
                .copy_from_nonoverlapping(bytes.as_ptr(), bytes.len());
        };
        Ok(buffer)
    }

    /// Reads the first `count` values of a buffer.
    pub(crate) fn read<T: AnyBitPattern>(&self, buffer: &Buffer, count: usize) -> Vec<T> {
        let mut bytes = vec![0_u8; buffer.size as usize];
        // SAFETY: see the module; the buffer is large enough.
        unsafe {
            buffer
                .mapped
                .cast::<u8>()
                .copy_to_nonoverlapping(bytes.as_mut_ptr(), bytes.len());
        }
        let values = bytes.chunks_exact(size_of::<T>()).take(count);
        values.map(bytemuck::pod_read_unaligned).collect()
    }

    /// An attachment of width x height pixels, which can be copied from and to.
    pub(crate) fn image(
        &self,
        format: vk::Format,
        [width, height]: [u32; 2],
        samples: u32,
        aspect: vk::ImageAspectFlags,
    ) -> Result<Image, Error> {
        use vk::ImageUsageFlags as Usage;
        let attachment = if aspect == vk::ImageAspectFlags::COLOR {
            Usage::COLOR_ATTACHMENT
        } else {
            Usage::DEPTH_STENCIL_ATTACHMENT
        };
        let create_info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D {
                width,
                height,
                depth: 1,
            })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::from_raw(samples))
            .usage(attachment | Usage::TRANSFER_SRC | Usage::TRANSFER_DST);
        let device = &self.device.raw;
        // SAFETY: see the module.
        unsafe {
            let raw = device.create_image(&create_info, None)?;
            self.later(move |device| device.destroy_image(raw, None));
            let requirements = device.get_image_memory_requirements(raw);
            let memory = self.allocate(requirements, vk::MemoryPropertyFlags::DEVICE_LOCAL)?;
            device.bind_image_memory(raw, memory, 0)?;
            let view_info = vk::ImageViewCreateInfo::default()
                .image(raw)
                .view_type(vk::ImageViewType::TYPE_2D)
                .format(format)
                .subresource_range(whole(aspect));
            let view = device.create_image_view(&view_info, None)?;
            self.later(move |device| device.destroy_image_view(view, None));
            Ok(Image { raw, view, aspect })
        }
    }
}

impl Drop for Scope<'_> {
    fn drop(&mut self) {
        while let Some(destroy) = self.objects.get_mut().pop() {
            destroy(&self.device.raw);
        }
    }
}

/// The range of the only level and layer.
pub(crate) fn whole(aspect: vk::ImageAspectFlags) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange::default()
        .aspect_mask(aspect)
        .level_count(1)
        .layer_count(1)
}
