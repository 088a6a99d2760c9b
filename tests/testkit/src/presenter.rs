//! A device that presents to a surface, for tests.

use std::cell::Cell;
use std::ffi::CStr;

use ash::vk;

/// The default size of pictures.
pub const SIZE: [u32; 2] = [48, 32];

/// The options of a swapchain.
#[derive(Clone, Copy)]
pub struct SwapchainOptions {
    /// Width and height of its images.
    pub size: [u32; 2],
    /// Its present mode.
    pub mode: vk::PresentModeKHR,
    /// The least number of images.
    pub count: u32,
    /// The swapchain that it replaces, or null.
    pub old: vk::SwapchainKHR,
}

impl Default for SwapchainOptions {
    fn default() -> Self {
        Self { size: SIZE, mode: vk::PresentModeKHR::FIFO, count: 2, old: vk::SwapchainKHR::null() }
    }
}

/// A device with one queue, and a surface.
pub struct Presenter {
    instance: ash::Instance,
    physical: vk::PhysicalDevice,
    surfaces: ash::khr::surface::Instance,
    surface: vk::SurfaceKHR,
    device: ash::Device,
    swapchains: ash::khr::swapchain::Device,
    queue: vk::Queue,
    pool: vk::CommandPool,
    _entry: ash::Entry,
}

// SAFETY of all `unsafe` here: handles are used while they are valid, structures are valid, and a submission is waited
// for before any of its objects is destroyed.
impl Presenter {
    /// Creates a device of an instance with a surface extension, and the surface, which `create` makes.
    pub fn new(
        entry: ash::Entry,
        extension: &CStr,
        create: impl FnOnce(&ash::Entry, &ash::Instance) -> vk::SurfaceKHR,
    ) -> Self {
        let names = [ash::khr::surface::NAME.as_ptr(), extension.as_ptr()];
        let app = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&app).enabled_extension_names(&names);
        // SAFETY: see above.
        unsafe {
            let instance = entry.create_instance(&info, None).expect("an instance");
            let physical = instance.enumerate_physical_devices().expect("devices")[0];
            let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
            let names = [ash::khr::swapchain::NAME.as_ptr()];
            let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_extension_names(&names);
            let device = instance.create_device(physical, &info, None).expect("a device");
            let surface = create(&entry, &instance);
            let surfaces = ash::khr::surface::Instance::new(&entry, &instance);
            let supported = surfaces.get_physical_device_surface_support(physical, 0, surface);
            assert_eq!(supported, Ok(true));
            let info = vk::CommandPoolCreateInfo::default();
            Self {
                physical,
                surfaces,
                surface,
                swapchains: ash::khr::swapchain::Device::new(&instance, &device),
                queue: device.get_device_queue(0, 0),
                pool: device.create_command_pool(&info, None).expect("a pool"),
                device,
                instance,
                _entry: entry,
            }
        }
    }

    /// The capabilities of the surface.
    pub fn capabilities(&self) -> Result<vk::SurfaceCapabilitiesKHR, vk::Result> {
        // SAFETY: see above.
        unsafe { self.surfaces.get_physical_device_surface_capabilities(self.physical, self.surface) }
    }

    /// The formats of the surface.
    pub fn formats(&self) -> Vec<vk::Format> {
        // SAFETY: see above.
        let formats = unsafe { self.surfaces.get_physical_device_surface_formats(self.physical, self.surface) };
        let formats = formats.expect("formats").into_iter();
        formats.map(|it| it.format).collect()
    }

    /// The present modes of the surface.
    pub fn modes(&self) -> Vec<vk::PresentModeKHR> {
        // SAFETY: see above.
        let modes = unsafe { self.surfaces.get_physical_device_surface_present_modes(self.physical, self.surface) };
        modes.expect("modes")
    }

    /// Creates a swapchain of the surface.
    pub fn swapchain(&self, options: &SwapchainOptions) -> Result<Swapchain<'_>, vk::Result> {
        let [width, height] = options.size;
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(self.surface)
            .min_image_count(options.count)
            .image_format(vk::Format::B8G8R8A8_UNORM)
            .image_color_space(vk::ColorSpaceKHR::SRGB_NONLINEAR)
            .image_extent(vk::Extent2D { width, height })
            .image_array_layers(1)
            .image_usage(vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC)
            .pre_transform(vk::SurfaceTransformFlagsKHR::IDENTITY)
            .composite_alpha(vk::CompositeAlphaFlagsKHR::OPAQUE)
            .present_mode(options.mode)
            .old_swapchain(options.old);
        // SAFETY: see above.
        unsafe {
            let raw = self.swapchains.create_swapchain(&info, None)?;
            let images = self.swapchains.get_swapchain_images(raw).expect("images");
            Ok(Swapchain { presenter: self, raw, images, size: options.size, semaphores: Cell::default() })
        }
    }

    /// Records commands, submits them and waits for them.
    fn run(&self, waits: &[vk::Semaphore], signals: &[vk::Semaphore], record: impl FnOnce(vk::CommandBuffer)) {
        let info = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
        let device = &self.device;
        // SAFETY: see above.
        unsafe {
            let commands = device.allocate_command_buffers(&info).expect("commands");
            device.begin_command_buffer(commands[0], &Default::default()).expect("it begins");
            record(commands[0]);
            device.end_command_buffer(commands[0]).expect("it ends");
            let stages = vec![vk::PipelineStageFlags::ALL_COMMANDS; waits.len()];
            let submits = [vk::SubmitInfo::default()
                .wait_semaphores(waits)
                .wait_dst_stage_mask(&stages)
                .command_buffers(&commands)
                .signal_semaphores(signals)];
            device.queue_submit(self.queue, &submits, vk::Fence::null()).expect("it is submitted");
            device.queue_wait_idle(self.queue).expect("it is done");
            device.free_command_buffers(self.pool, &commands);
        }
    }

    /// The pixels of an image of [`SIZE`].
    pub fn read(&self, image: vk::Image) -> Vec<[u8; 4]> {
        let size = u64::from(4 * SIZE[0] * SIZE[1]);
        let info = vk::BufferCreateInfo::default().size(size).usage(vk::BufferUsageFlags::TRANSFER_DST);
        let device = &self.device;
        // SAFETY: see above.
        unsafe {
            let buffer = device.create_buffer(&info, None).expect("a buffer");
            let info = vk::MemoryAllocateInfo::default().allocation_size(size).memory_type_index(1);
            let memory = device.allocate_memory(&info, None).expect("memory");
            device.bind_buffer_memory(buffer, memory, 0).expect("it is bound");
            let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
            let region = vk::BufferImageCopy::default().image_subresource(layers).image_extent(vk::Extent3D {
                width: SIZE[0],
                height: SIZE[1],
                depth: 1,
            });
            self.run(&[], &[], |commands| {
                let layout = vk::ImageLayout::GENERAL;
                device.cmd_copy_image_to_buffer(commands, image, layout, buffer, &[region]);
            });
            let mapped = device.map_memory(memory, 0, size, Default::default()).expect("it is mapped");
            let pixels = std::slice::from_raw_parts(mapped.cast::<[u8; 4]>(), (SIZE[0] * SIZE[1]) as usize);
            let pixels = pixels.to_vec();
            device.destroy_buffer(buffer, None);
            device.free_memory(memory, None);
            pixels
        }
    }

    /// Destroys an image.
    pub fn destroy_image(&self, image: vk::Image) {
        // SAFETY: see above.
        unsafe { self.device.destroy_image(image, None) };
    }
}

impl Drop for Presenter {
    fn drop(&mut self) {
        // SAFETY: see above.
        unsafe {
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
            self.surfaces.destroy_surface(self.surface, None);
            self.instance.destroy_instance(None);
        }
    }
}

/// A swapchain of a [`Presenter`].
pub struct Swapchain<'a> {
    presenter: &'a Presenter,
    /// The handle.
    pub raw: vk::SwapchainKHR,
    /// Its images.
    pub images: Vec<vk::Image>,
    size: [u32; 2],
    /// Semaphores of frames, which are destroyed with the swapchain.
    semaphores: Cell<Vec<vk::Semaphore>>,
}

impl Swapchain<'_> {
    /// Acquires an image; the second value is true if the swapchain no longer matches the window exactly.
    pub fn acquire(&self, timeout: u64) -> Result<(u32, bool), vk::Result> {
        let device = &self.presenter.device;
        // SAFETY: see above.
        unsafe {
            let fence = device.create_fence(&Default::default(), None).expect("a fence");
            let semaphore = vk::Semaphore::null();
            let acquired = self.presenter.swapchains.acquire_next_image(self.raw, timeout, semaphore, fence);
            if acquired.is_ok() {
                device.wait_for_fences(&[fence], true, u64::MAX).expect("it is signaled");
            }
            device.destroy_fence(fence, None);
            acquired
        }
    }

    /// Presents an image; the value is true if the swapchain no longer matches the window exactly.
    pub fn present(&self, index: u32) -> Result<bool, vk::Result> {
        self.present_after(index, &[])
    }

    fn present_after(&self, index: u32, waits: &[vk::Semaphore]) -> Result<bool, vk::Result> {
        let (raws, indices) = ([self.raw], [index]);
        let mut results = [vk::Result::ERROR_UNKNOWN];
        let info = vk::PresentInfoKHR::default()
            .wait_semaphores(waits)
            .swapchains(&raws)
            .image_indices(&indices)
            .results(&mut results);
        let Presenter { swapchains, queue, .. } = self.presenter;
        // SAFETY: see above.
        let presented = unsafe { swapchains.queue_present(*queue, &info) };
        let whole = match presented {
            Ok(false) => vk::Result::SUCCESS,
            Ok(true) => vk::Result::SUBOPTIMAL_KHR,
            Err(error) => error,
        };
        assert_eq!(results, [whole]);
        presented
    }

    /// Acquires an image, clears it to a colour, and presents it, each step after the one before.
    pub fn frame(&self, color: [f32; 4]) -> (u32, Result<bool, vk::Result>) {
        let device = &self.presenter.device;
        // SAFETY: see above.
        unsafe {
            let semaphore = || device.create_semaphore(&Default::default(), None).expect("a semaphore");
            let (acquired, drawn) = (semaphore(), semaphore());
            let mut semaphores = self.semaphores.take();
            semaphores.extend([acquired, drawn]);
            self.semaphores.set(semaphores);
            let fence = vk::Fence::null();
            let swapchains = &self.presenter.swapchains;
            let (index, _) = match swapchains.acquire_next_image(self.raw, u64::MAX, acquired, fence) {
                Ok(acquired) => acquired,
                Err(error) => return (u32::MAX, Err(error)),
            };
            let range = vk::ImageSubresourceRange::default()
                .aspect_mask(vk::ImageAspectFlags::COLOR)
                .level_count(1)
                .layer_count(1);
            let image = self.images[index as usize];
            self.presenter.run(&[acquired], &[drawn], |commands| {
                let color = vk::ClearColorValue { float32: color };
                let layout = vk::ImageLayout::GENERAL;
                device.cmd_clear_color_image(commands, image, layout, &color, &[range]);
            });
            (index, self.present_after(index, &[drawn]))
        }
    }

    /// Creates another image that is bound to the memory of one of the swapchain's images.
    pub fn alias(&self, index: u32) -> vk::Image {
        let [width, height] = self.size;
        let mut of_swapchain = vk::ImageSwapchainCreateInfoKHR::default().swapchain(self.raw);
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(vk::Format::B8G8R8A8_UNORM)
            .extent(vk::Extent3D { width, height, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC)
            .push_next(&mut of_swapchain);
        let device = &self.presenter.device;
        // SAFETY: see above.
        unsafe {
            let image = device.create_image(&info, None).expect("an image");
            let mut of_swapchain =
                vk::BindImageMemorySwapchainInfoKHR::default().swapchain(self.raw).image_index(index);
            let bind = vk::BindImageMemoryInfo::default().image(image).push_next(&mut of_swapchain);
            device.bind_image_memory2(&[bind]).expect("it is bound");
            image
        }
    }
}

impl Drop for Swapchain<'_> {
    fn drop(&mut self) {
        // SAFETY: see above.
        unsafe {
            let _ = self.presenter.device.device_wait_idle();
            self.presenter.swapchains.destroy_swapchain(self.raw, None);
            for semaphore in self.semaphores.take() {
                self.presenter.device.destroy_semaphore(semaphore, None);
            }
        }
    }
}
