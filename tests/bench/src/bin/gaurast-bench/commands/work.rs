//! Work for the driver alone: draws are recorded, and executed if that is asked for, and pipelines are created.
//!
//! This file uses only ash and an entry, so that it can be compiled with any revision of this driver, or with another
//! driver.

use std::time::{Duration, Instant};

use ash::{Device, Entry, Instance, vk};

/// The sides of the picture in pixels.
const SIDE: u32 = 64;

const FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;

const VERTEX: &[u8] = include_bytes!("../counts/shaders/plain.vert.spv");
const FRAGMENT: &[u8] = include_bytes!("../counts/shaders/plain.frag.spv");

/// A device and the objects that draws need.
pub struct Work {
    instance: Instance,
    device: Device,
    buffer: vk::Buffer,
    memories: Vec<vk::DeviceMemory>,
    image: vk::Image,
    view: vk::ImageView,
    modules: [vk::ShaderModule; 2],
    layout: vk::PipelineLayout,
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    queue: vk::Queue,
    pipeline: vk::Pipeline,
    // The functions of the handles above.
    _entry: Entry,
}

impl Work {
    /// Work for the first device of `entry`.
    ///
    /// # Errors
    /// The error of the Vulkan command that fails.
    pub fn new(entry: Entry) -> Result<Self, vk::Result> {
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&application);
        // SAFETY: structures are valid, and handles are those of this device.
        unsafe {
            let instance = entry.create_instance(&info, None)?;
            let physical = instance.enumerate_physical_devices()?[0];
            let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
            let mut features = vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true);
            let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).push_next(&mut features);
            let device = instance.create_device(physical, &info, None)?;

            let allocate = |needs: vk::MemoryRequirements| {
                let info = vk::MemoryAllocateInfo::default()
                    .allocation_size(needs.size)
                    .memory_type_index(needs.memory_type_bits.trailing_zeros());
                device.allocate_memory(&info, None)
            };
            let info = vk::BufferCreateInfo::default().size(4096).usage(vk::BufferUsageFlags::VERTEX_BUFFER);
            let buffer = device.create_buffer(&info, None)?;
            let of_buffer = allocate(device.get_buffer_memory_requirements(buffer))?;
            device.bind_buffer_memory(buffer, of_buffer, 0)?;
            let info = vk::ImageCreateInfo::default()
                .image_type(vk::ImageType::TYPE_2D)
                .format(FORMAT)
                .extent(vk::Extent3D { width: SIDE, height: SIDE, depth: 1 })
                .mip_levels(1)
                .array_layers(1)
                .samples(vk::SampleCountFlags::TYPE_1)
                .usage(vk::ImageUsageFlags::COLOR_ATTACHMENT);
            let image = device.create_image(&info, None)?;
            let of_image = allocate(device.get_image_memory_requirements(image))?;
            device.bind_image_memory(image, of_image, 0)?;
            let range = vk::ImageSubresourceRange::default()
                .aspect_mask(vk::ImageAspectFlags::COLOR)
                .level_count(1)
                .layer_count(1);
            let info = vk::ImageViewCreateInfo::default()
                .image(image)
                .view_type(vk::ImageViewType::TYPE_2D)
                .format(FORMAT)
                .subresource_range(range);
            let view = device.create_image_view(&info, None)?;

            let module = |code: &[u8]| {
                let words: Vec<u32> =
                    code.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect();
                let info = vk::ShaderModuleCreateInfo::default().code(&words);
                device.create_shader_module(&info, None)
            };
            let modules = [module(VERTEX)?, module(FRAGMENT)?];
            let layout = device.create_pipeline_layout(&Default::default(), None)?;
            let pool = device.create_command_pool(&Default::default(), None)?;
            let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
            let commands = device.allocate_command_buffers(&info)?[0];
            let mut work = Self {
                instance,
                buffer,
                memories: vec![of_buffer, of_image],
                image,
                view,
                modules,
                layout,
                pool,
                commands,
                queue: device.get_device_queue(0, 0),
                pipeline: vk::Pipeline::null(),
                device,
                _entry: entry,
            };
            work.pipeline = work.pipeline()?;
            Ok(work)
        }
    }

    /// A pipeline with two stages.
    fn pipeline(&self) -> Result<vk::Pipeline, vk::Result> {
        let stage =
            |stage, module| vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(c"main");
        let stages = [
            stage(vk::ShaderStageFlags::VERTEX, self.modules[0]),
            stage(vk::ShaderStageFlags::FRAGMENT, self.modules[1]),
        ];
        let bindings = [vk::VertexInputBindingDescription::default().stride(4 * 8)];
        let attribute = |location, offset| vk::VertexInputAttributeDescription {
            location,
            binding: 0,
            format: vk::Format::R32G32B32A32_SFLOAT,
            offset,
        };
        let attributes = [attribute(0, 0), attribute(1, 16)];
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(&attributes);
        let assembly =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let side = SIDE as f32;
        let viewports = [vk::Viewport::default().width(side).height(side).max_depth(1.0)];
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewports(&viewports).scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let samples =
            vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let writes = [vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&writes);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&[vk::DynamicState::SCISSOR]);
        let mut rendering = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&[FORMAT]);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(self.layout)
            .push_next(&mut rendering);
        // SAFETY: the structures are valid and live until the call returns.
        let created = unsafe { self.device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None) };
        created.map(|all| all[0]).map_err(|(_, result)| result)
    }

    /// Creates and destroys `count` pipelines, and returns the time that it took.
    ///
    /// # Errors
    /// The error of pipeline creation.
    pub fn create_pipelines(&self, count: u32) -> Result<Duration, vk::Result> {
        let start = Instant::now();
        for _ in 0..count {
            let pipeline = self.pipeline()?;
            // SAFETY: nothing was recorded with it.
            unsafe { self.device.destroy_pipeline(pipeline, None) };
        }
        Ok(start.elapsed())
    }

    /// Records `count` draws into one pass, each with a scissor and a vertex buffer of its own, and returns the time
    /// that it took. If `submits`, the draws are then executed, which is not in this time.
    ///
    /// # Errors
    /// The error of recording or of the submission.
    pub fn record_draws(&self, count: u32, submits: bool) -> Result<Duration, vk::Result> {
        let (device, commands) = (&self.device, self.commands);
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width: SIDE, height: SIDE } };
        let target = [vk::RenderingAttachmentInfo::default()
            .image_view(self.view)
            .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)];
        let pass = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&target);
        let color =
            vk::ImageSubresourceRange::default().aspect_mask(vk::ImageAspectFlags::COLOR).level_count(1).layer_count(1);
        let to_target = vk::ImageMemoryBarrier::default()
            .image(self.image)
            .subresource_range(color)
            .dst_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE)
            .new_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
        // SAFETY: commands are in order, and the command buffer is not in use before it is submitted or reset.
        unsafe {
            device.begin_command_buffer(commands, &Default::default())?;
            device.cmd_pipeline_barrier(
                commands,
                vk::PipelineStageFlags::TOP_OF_PIPE,
                vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT,
                vk::DependencyFlags::empty(),
                &[],
                &[],
                &[to_target],
            );
            device.cmd_begin_rendering(commands, &pass);
            device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, self.pipeline);
            let start = Instant::now();
            for draw in 0..count {
                let offset = u64::from(draw % 16) * 32;
                device.cmd_set_scissor(commands, 0, &[area]);
                device.cmd_bind_vertex_buffers(commands, 0, &[self.buffer], &[offset]);
                device.cmd_draw(commands, 3, 1, 0, draw);
            }
            let taken = start.elapsed();
            device.cmd_end_rendering(commands);
            device.end_command_buffer(commands)?;
            if submits {
                let buffers = [commands];
                let submission = vk::SubmitInfo::default().command_buffers(&buffers);
                device.queue_submit(self.queue, &[submission], vk::Fence::null())?;
                device.queue_wait_idle(self.queue)?;
            }
            device.reset_command_pool(self.pool, vk::CommandPoolResetFlags::RELEASE_RESOURCES)?;
            Ok(taken)
        }
    }
}

impl Drop for Work {
    fn drop(&mut self) {
        let device = &self.device;
        // SAFETY: nothing is in use any more, and each object is destroyed before the objects that it uses.
        unsafe {
            device.destroy_command_pool(self.pool, None);
            device.destroy_pipeline(self.pipeline, None);
            device.destroy_pipeline_layout(self.layout, None);
            for module in self.modules {
                device.destroy_shader_module(module, None);
            }
            device.destroy_image_view(self.view, None);
            device.destroy_image(self.image, None);
            device.destroy_buffer(self.buffer, None);
            for memory in &self.memories {
                device.free_memory(*memory, None);
            }
            device.destroy_device(None);
            self.instance.destroy_instance(None);
        }
    }
}
