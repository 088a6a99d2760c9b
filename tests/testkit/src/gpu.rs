//! A device, and commands that are recorded and submitted on it.

use std::cell::Cell;
use std::ffi::CStr;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::vk;
use gaurast::gaussian_primitive_topology;
use gaurast::vk::GaussianCameraGAURAST;

use crate::messages::Message;
use crate::open::Opened;
use crate::pass::{Attachments, Bindable, Pass};
use crate::settings::Settings;

pub use crate::open::{Driver, OpenError, Opening};

/// A device with one queue and all its features. Cloning is cheap; dropping the last clone destroys the device.
#[derive(Clone)]
pub struct Gpu(Arc<Shared>);

struct Shared {
    queue: Mutex<vk::Queue>,
    opened: Opened,
}

impl fmt::Debug for Gpu {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Gpu").field(&self.name()).finish()
    }
}

impl Gpu {
    /// Opens this driver, linked into the process.
    ///
    /// # Errors
    /// [`OpenError`] names the step that failed.
    pub fn embedded(settings: &Settings) -> Result<Self, OpenError> {
        Self::open(&Opening { settings: *settings, ..Opening::of(Driver::Embedded) })
    }

    /// Opens this driver, linked into the process, with extensions and their features in addition to those of the core
    /// version.
    ///
    /// # Errors
    /// [`OpenError`] names the step that failed.
    pub fn extended<T: vk::ExtendsDeviceCreateInfo>(extensions: &[&CStr], features: &mut T) -> Result<Self, OpenError> {
        let opening = Opening { extensions, ..Opening::of(Driver::Embedded) };
        Self::open_with(&opening, features)
    }

    /// Opens a driver's device with the options in `opening`, and with features of its extensions.
    ///
    /// # Errors
    /// [`OpenError`] names the step that failed.
    pub fn open_with<T: vk::ExtendsDeviceCreateInfo>(
        opening: &Opening<'_>,
        features: &mut T,
    ) -> Result<Self, OpenError> {
        Self::of(Opened::new(None, opening, Some(features)))
    }

    /// Opens this driver through the loader. The process must have been started with the driver's manifest in
    /// `VK_DRIVER_FILES`.
    ///
    /// # Errors
    /// [`OpenError`], for example if there is no loader.
    pub fn loaded() -> Result<Self, OpenError> {
        Self::open(&Opening::of(Driver::Loaded))
    }

    /// Opens lavapipe through the loader. It samples textures as accurately as it can if the process requests that (see
    /// [`accurate_lavapipe`](crate::loader::accurate_lavapipe)).
    ///
    /// # Errors
    /// [`OpenError`], for example if there is no loader, or it does not find lavapipe.
    pub fn lavapipe() -> Result<Self, OpenError> {
        Self::open(&Opening::of(Driver::Lavapipe))
    }

    /// Opens a driver's device with the options in `opening`.
    ///
    /// # Errors
    /// [`OpenError`] names the step that failed.
    pub fn open(opening: &Opening<'_>) -> Result<Self, OpenError> {
        Self::of(Opened::new(None, opening, None::<&mut vk::PhysicalDeviceFeatures2<'_>>))
    }

    fn of(opened: Result<Opened, OpenError>) -> Result<Self, OpenError> {
        let opened = opened?;
        Ok(Self(Arc::new(Shared { queue: Mutex::new(opened.queue), opened })))
    }

    /// The driver's name and version.
    pub fn name(&self) -> &str {
        &self.0.opened.name
    }

    /// The entry, for loading extensions.
    pub fn entry(&self) -> &ash::Entry {
        &self.0.opened.entry
    }

    /// The instance's functions.
    pub fn instance(&self) -> &ash::Instance {
        &self.0.opened.instance
    }

    /// The physical device.
    pub fn physical_device(&self) -> vk::PhysicalDevice {
        self.0.opened.physical_device
    }

    /// The device's functions.
    pub fn device(&self) -> &ash::Device {
        &self.0.opened.device
    }

    /// The features of Vulkan 1.0, all of which are enabled except robust access.
    pub fn features(&self) -> &vk::PhysicalDeviceFeatures {
        &self.0.opened.features
    }

    /// The device's limits.
    pub fn limits(&self) -> &vk::PhysicalDeviceLimits {
        &self.0.opened.limits
    }

    /// The functions of Gaussian draws, if the device has them.
    pub fn gaussian(&self) -> Option<&gaussian_primitive_topology::Device> {
        self.0.opened.gaussian.as_ref()
    }

    /// The warnings and errors reported since the last call.
    pub fn messages(&self) -> Vec<Message> {
        self.0.opened.messages.take()
    }

    /// The texts of the warnings and errors reported since the last call.
    pub fn message_texts(&self) -> Vec<String> {
        let messages = self.messages().into_iter();
        messages.map(|message| message.text).collect()
    }

    /// The properties of a format.
    pub fn format_properties(&self, format: vk::Format) -> vk::FormatProperties {
        // SAFETY: the physical device is the instance's.
        unsafe { self.instance().get_physical_device_format_properties(self.physical_device(), format) }
    }

    /// The features of `format` for images with optimal tiling.
    pub fn format_features(&self, format: vk::Format) -> vk::FormatFeatureFlags {
        self.format_properties(format).optimal_tiling_features
    }

    /// The first memory type of `bits` with all of `flags`.
    ///
    /// # Panics
    /// If there is none.
    pub fn memory_type(&self, bits: u32, flags: vk::MemoryPropertyFlags) -> u32 {
        let types = self.0.opened.memory.memory_types_as_slice();
        let fits = |index: &u32| bits & (1 << index) != 0 && types[*index as usize].property_flags.contains(flags);
        (0..types.len() as u32).find(fits).expect("a memory type that fits")
    }

    /// Records commands, submits them and waits for their completion.
    pub fn run(&self, record: impl FnOnce(&Commands)) {
        self.record(record).submit();
    }

    /// Records commands that can be submitted any number of times. The objects that they use must outlive them.
    pub fn record(&self, record: impl FnOnce(&Commands)) -> Recorded {
        self.try_record(record).expect("it ends")
    }

    /// Records commands that can be submitted any number of times.
    ///
    /// # Errors
    /// The error of ending the command buffer, if a command was wrong.
    pub fn try_record(&self, record: impl FnOnce(&Commands)) -> Result<Recorded, vk::Result> {
        let primary = vk::CommandBufferLevel::PRIMARY;
        self.record_as(primary, &vk::CommandBufferBeginInfo::default(), record)
    }

    /// Records a secondary command buffer for a subpass or a render that `inheritance` describes.
    pub fn record_secondary(
        &self,
        inheritance: &vk::CommandBufferInheritanceInfo<'_>,
        record: impl FnOnce(&Commands),
    ) -> Recorded {
        let info = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::RENDER_PASS_CONTINUE)
            .inheritance_info(inheritance);
        self.record_as(vk::CommandBufferLevel::SECONDARY, &info, record).expect("it ends")
    }

    /// Records a command buffer.
    ///
    /// # Errors
    /// The error of ending the command buffer, if a command was wrong.
    pub fn record_as(
        &self,
        level: vk::CommandBufferLevel,
        info: &vk::CommandBufferBeginInfo<'_>,
        record: impl FnOnce(&Commands),
    ) -> Result<Recorded, vk::Result> {
        let recorded = Recorded::new(self, level);
        recorded.begin(info);
        record(&Commands::new(self, recorded.raw));
        // SAFETY: see the crate.
        unsafe { self.device().end_command_buffer(recorded.raw) }?;
        Ok(recorded)
    }

    /// The queue. Threads must not submit to it at the same time.
    pub fn queue(&self) -> vk::Queue {
        self.0.opened.queue
    }

    fn lock_queue(&self) -> MutexGuard<'_, vk::Queue> {
        self.0.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A command buffer that is being recorded.
pub struct Commands {
    gpu: Gpu,
    /// The command buffer.
    pub raw: vk::CommandBuffer,
    layout: Cell<vk::PipelineLayout>,
}

impl Commands {
    fn new(gpu: &Gpu, raw: vk::CommandBuffer) -> Self {
        Self { gpu: gpu.clone(), raw, layout: Cell::new(vk::PipelineLayout::null()) }
    }

    /// The device that commands are recorded for.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The device's functions.
    pub fn device(&self) -> &ash::Device {
        self.gpu.device()
    }

    /// The device's functions and the command buffer, for commands that have no method here.
    pub fn raw(&self) -> (&ash::Device, vk::CommandBuffer) {
        (self.gpu.device(), self.raw)
    }

    /// Records a barrier: all later commands wait for all earlier ones.
    pub fn barrier(&self) {
        self.barriers(&[]);
    }

    fn barriers(&self, images: &[vk::ImageMemoryBarrier<'_>]) {
        let memory = [vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
            .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)];
        let all = vk::PipelineStageFlags::ALL_COMMANDS;
        let flags = vk::DependencyFlags::empty();
        // SAFETY: see the crate.
        unsafe {
            self.device().cmd_pipeline_barrier(self.raw, all, all, flags, &memory, &[], images);
        }
    }

    /// Records the transition of an image's aspects from the undefined layout to `GENERAL`.
    pub fn become_general(&self, image: vk::Image, range: vk::ImageSubresourceRange) {
        let ignored = vk::QUEUE_FAMILY_IGNORED;
        self.barriers(&[vk::ImageMemoryBarrier::default()
            .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)
            .new_layout(vk::ImageLayout::GENERAL)
            .src_queue_family_index(ignored)
            .dst_queue_family_index(ignored)
            .image(image)
            .subresource_range(range)]);
    }

    /// Copies a buffer to an image.
    pub fn upload(&self, from: impl Into<vk::Buffer>, to: impl Into<vk::Image>, regions: &[vk::BufferImageCopy]) {
        let (from, to, layout) = (from.into(), to.into(), vk::ImageLayout::GENERAL);
        // SAFETY: see the crate.
        unsafe {
            self.device().cmd_copy_buffer_to_image(self.raw, from, to, layout, regions);
        }
        self.barrier();
    }

    /// Copies an image to a buffer.
    pub fn download(&self, from: impl Into<vk::Image>, to: impl Into<vk::Buffer>, regions: &[vk::BufferImageCopy]) {
        let (from, to, layout) = (from.into(), to.into(), vk::ImageLayout::GENERAL);
        self.barrier();
        // SAFETY: see the crate.
        unsafe {
            self.device().cmd_copy_image_to_buffer(self.raw, from, layout, to, regions);
        }
        self.barrier();
    }

    /// Records a pass over `target`, with viewport and scissor set to all of it.
    pub fn pass(&self, target: &impl Attachments, pass: &Pass, draws: impl FnOnce()) {
        self.barrier();
        target.begin(self.device(), self.raw, pass);
        if pass.flags.is_empty() {
            self.whole(target);
        }
        draws();
        target.end(self.device(), self.raw);
        self.barrier();
    }

    /// Sets viewport and scissor to all of `target`.
    pub fn whole(&self, target: &impl Attachments) {
        let [width, height] = target.size();
        self.viewport([0.0, 0.0, width as f32, height as f32], [0.0, 1.0]);
        self.scissor([0, 0], [width, height]);
    }

    /// Sets the viewport to x, y, width and height, and its depth range.
    pub fn viewport(&self, [x, y, width, height]: [f32; 4], [min_depth, max_depth]: [f32; 2]) {
        let viewport = vk::Viewport { x, y, width, height, min_depth, max_depth };
        // SAFETY: see the crate.
        unsafe { self.device().cmd_set_viewport(self.raw, 0, &[viewport]) };
    }

    /// Sets the scissor.
    pub fn scissor(&self, [x, y]: [i32; 2], [width, height]: [u32; 2]) {
        let scissor = vk::Rect2D { offset: vk::Offset2D { x, y }, extent: vk::Extent2D { width, height } };
        // SAFETY: see the crate.
        unsafe { self.device().cmd_set_scissor(self.raw, 0, &[scissor]) };
    }

    /// Sets the stencil reference of both faces.
    pub fn stencil_reference(&self, reference: u32) {
        let faces = vk::StencilFaceFlags::FRONT_AND_BACK;
        // SAFETY: see the crate.
        unsafe {
            self.device().cmd_set_stencil_reference(self.raw, faces, reference);
        }
    }

    /// Binds a graphics pipeline.
    pub fn bind(&self, pipeline: &impl Bindable) {
        let (pipeline, layout) = pipeline.handles();
        self.layout.set(layout);
        let point = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: see the crate.
        unsafe {
            self.device().cmd_bind_pipeline(self.raw, point, pipeline);
        }
    }

    /// Binds a descriptor set for the graphics pipeline that was bound last.
    pub fn bind_set(&self, set: impl Into<vk::DescriptorSet>, dynamic_offsets: &[u32]) {
        let (point, sets) = (vk::PipelineBindPoint::GRAPHICS, [set.into()]);
        // SAFETY: see the crate.
        unsafe {
            self.device().cmd_bind_descriptor_sets(self.raw, point, self.layout.get(), 0, &sets, dynamic_offsets);
        }
    }

    /// Sets push constants from `offset`, for all graphics stages.
    pub fn push<T: bytemuck::Pod>(&self, offset: u32, constants: &[T]) {
        let bytes = bytemuck::cast_slice(constants);
        let stages = vk::ShaderStageFlags::ALL_GRAPHICS;
        // SAFETY: see the crate.
        unsafe {
            self.device().cmd_push_constants(self.raw, self.layout.get(), stages, offset, bytes);
        }
    }

    /// Binds a vertex buffer to binding 0.
    pub fn vertices(&self, buffer: impl Into<vk::Buffer>) {
        self.vertex_buffer(0, buffer, 0);
    }

    /// Binds a vertex buffer to any binding.
    pub fn vertex_buffer(&self, binding: u32, buffer: impl Into<vk::Buffer>, offset: u64) {
        let buffers = [buffer.into()];
        // SAFETY: see the crate.
        unsafe {
            self.device().cmd_bind_vertex_buffers(self.raw, binding, &buffers, &[offset]);
        }
    }

    /// Binds an index buffer.
    pub fn indices(&self, buffer: impl Into<vk::Buffer>, offset: u64, index_type: vk::IndexType) {
        let buffer = buffer.into();
        // SAFETY: see the crate.
        unsafe {
            self.device().cmd_bind_index_buffer(self.raw, buffer, offset, index_type);
        }
    }

    /// Sets the camera of Gaussian draws.
    ///
    /// # Panics
    /// If the device doesn't draw Gaussians.
    pub fn camera(&self, camera: &GaussianCameraGAURAST) {
        let gaussian = self.gpu.gaussian().expect("a device that draws Gaussians");
        // SAFETY: see the crate.
        unsafe { gaussian.cmd_set_gaussian_cameras(self.raw, &[*camera]) };
    }

    /// Records draws that share a sorted set.
    ///
    /// # Panics
    /// If the device doesn't draw Gaussians.
    pub fn gaussian_set(&self, draws: impl FnOnce()) {
        let gaussian = self.gpu.gaussian().expect("a device that draws Gaussians");
        // SAFETY: see the crate.
        unsafe { gaussian.cmd_begin_gaussian_set(self.raw) };
        draws();
        // SAFETY: see the crate.
        unsafe { gaussian.cmd_end_gaussian_set(self.raw) };
    }

    /// Draws `vertices` as one instance.
    pub fn draw(&self, vertices: std::ops::Range<u32>) {
        self.draw_instances(vertices, 0..1);
    }

    /// Draws `vertices` for each of `instances`.
    pub fn draw_instances(&self, vertices: std::ops::Range<u32>, instances: std::ops::Range<u32>) {
        let (count, first) = (vertices.end - vertices.start, vertices.start);
        let (many, first_instance) = (instances.end - instances.start, instances.start);
        // SAFETY: see the crate.
        unsafe {
            self.device().cmd_draw(self.raw, count, many, first, first_instance);
        }
    }

    /// Draws indexed vertices as one instance.
    pub fn draw_indexed(&self, indices: std::ops::Range<u32>, vertex_offset: i32) {
        let (count, first) = (indices.end - indices.start, indices.start);
        // SAFETY: see the crate.
        unsafe {
            self.device().cmd_draw_indexed(self.raw, count, 1, first, vertex_offset, 0);
        }
    }

    /// Records `count` indirect draws, whose parameters are in a buffer, 16 bytes apart.
    pub fn draw_indirect(&self, draws: impl Into<vk::Buffer>, count: u32) {
        let draws = draws.into();
        // SAFETY: see the crate.
        unsafe {
            self.device().cmd_draw_indirect(self.raw, draws, 0, count, 16);
        }
    }
}

/// A recorded command buffer.
#[derive(Debug)]
pub struct Recorded {
    gpu: Gpu,
    pool: vk::CommandPool,
    /// The command buffer.
    pub raw: vk::CommandBuffer,
}

impl Recorded {
    fn new(gpu: &Gpu, level: vk::CommandBufferLevel) -> Self {
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(0);
        // SAFETY: see the crate.
        unsafe {
            let pool = gpu.device().create_command_pool(&info, None).expect("a command pool");
            let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).level(level).command_buffer_count(1);
            let buffers = gpu.device().allocate_command_buffers(&info);
            Self { gpu: gpu.clone(), pool, raw: buffers.expect("a command buffer")[0] }
        }
    }

    fn begin(&self, info: &vk::CommandBufferBeginInfo<'_>) {
        // SAFETY: see the crate.
        unsafe { self.gpu.device().begin_command_buffer(self.raw, info) }.expect("it begins");
    }

    /// Submits it and waits for its completion.
    pub fn submit(&self) {
        self.try_submit().expect("it finishes");
    }

    /// Submits it and waits for its completion.
    ///
    /// # Errors
    /// The error of the submission or of waiting, for example that the device is lost.
    pub fn try_submit(&self) -> Result<(), vk::Result> {
        let buffers = [self.raw];
        let submits = [vk::SubmitInfo::default().command_buffers(&buffers)];
        let queue = self.gpu.lock_queue();
        // SAFETY: see the crate; the lock keeps other threads from the queue.
        unsafe {
            let device = self.gpu.device();
            device.queue_submit(*queue, &submits, vk::Fence::null())?;
            device.queue_wait_idle(*queue)
        }
    }
}

impl Drop for Recorded {
    fn drop(&mut self) {
        // SAFETY: see the crate.
        unsafe { self.gpu.device().destroy_command_pool(self.pool, None) };
    }
}
