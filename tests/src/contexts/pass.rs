//! Recording: passes and what is drawn in them.

use ash::vk;
use gaurast::vk::GaussianCameraGAURAST;

use super::gaussian::INSTANCES;
use super::{Buffer, Context, DeviceScene, Pipeline, Target};

/// How a pass begins.
#[derive(Clone, Copy, Default)]
pub struct Pass<'a> {
    /// The colour that the render area is cleared to; without one the contents are loaded.
    pub clear: Option<[f32; 4]>,
    /// The render area, if it is not the whole target.
    pub area: Option<vk::Rect2D>,
    /// The render pass and framebuffer, if it is not dynamic rendering.
    pub object: Option<&'a PassObject>,
}

impl Pass<'_> {
    /// Clears the whole target to `color`.
    pub fn clear(color: [f32; 4]) -> Self {
        Self {
            clear: Some(color),
            ..Self::default()
        }
    }
}

/// A command buffer that is being recorded.
pub struct Commands<'a> {
    context: &'a Context,
    raw: vk::CommandBuffer,
}

impl<'a> Commands<'a> {
    pub(super) fn new(context: &'a Context, raw: vk::CommandBuffer) -> Self {
        Self { context, raw }
    }

    /// Records a pass over `target`, with the viewport and the scissor being all of it.
    pub fn pass(&self, target: &Target, pass: &Pass, record: impl FnOnce()) {
        let device = self.context.device();
        let whole = vk::Rect2D::default().extent(target.extent);
        let area = pass.area.unwrap_or(whole);
        let old_layout = match pass.clear {
            Some(_) if pass.area.is_none() => vk::ImageLayout::UNDEFINED,
            _ => vk::ImageLayout::GENERAL,
        };
        self.barrier(target, old_layout, vk::ImageLayout::GENERAL);
        let clear = vk::ClearValue {
            color: vk::ClearColorValue {
                float32: pass.clear.unwrap_or_default(),
            },
        };
        // SAFETY: see `contexts`.
        unsafe {
            if let Some(object) = pass.object {
                let clears = [clear];
                let begin_info = vk::RenderPassBeginInfo::default()
                    .render_pass(object.render_pass)
                    .framebuffer(object.framebuffer)
                    .render_area(area)
                    .clear_values(&clears);
                let contents = vk::SubpassContents::INLINE;
                device.cmd_begin_render_pass(self.raw, &begin_info, contents);
            } else {
                let attachments = [vk::RenderingAttachmentInfo::default()
                    .image_view(target.view)
                    .image_layout(vk::ImageLayout::GENERAL)
                    .load_op(load_op(pass))
                    .store_op(vk::AttachmentStoreOp::STORE)
                    .clear_value(clear)];
                let rendering = vk::RenderingInfo::default()
                    .render_area(area)
                    .layer_count(1)
                    .color_attachments(&attachments);
                device.cmd_begin_rendering(self.raw, &rendering);
            }
            let viewport = vk::Viewport::default()
                .width(target.extent.width as f32)
                .height(target.extent.height as f32)
                .max_depth(1.0);
            self.viewport(viewport);
            self.scissor(whole);
            record();
            if pass.object.is_some() {
                device.cmd_end_render_pass(self.raw);
            } else {
                device.cmd_end_rendering(self.raw);
            }
        }
    }

    /// Binds what a draw of `scene` needs.
    pub fn bind(&self, pipeline: &Pipeline, scene: &DeviceScene, camera: &GaussianCameraGAURAST) {
        let device = self.context.device();
        let buffers = scene.buffers.each_ref().map(Buffer::raw);
        // SAFETY: see `contexts`.
        unsafe {
            let bind_point = vk::PipelineBindPoint::GRAPHICS;
            device.cmd_bind_pipeline(self.raw, bind_point, pipeline.raw);
            device.cmd_bind_vertex_buffers(self.raw, 0, &buffers, &[0; 5]);
            let gaussian = self.context.gaussian();
            gaussian.cmd_set_gaussian_cameras(self.raw, &[*camera]);
        }
    }

    /// Records draws that share a sorted set.
    pub fn gaussian_set(&self, draws: impl FnOnce()) {
        let gaussian = self.context.gaussian();
        // SAFETY: see `contexts`.
        unsafe { gaussian.cmd_begin_gaussian_set(self.raw) };
        draws();
        // SAFETY: see `contexts`.
        unsafe { gaussian.cmd_end_gaussian_set(self.raw) };
    }

    /// Binds what a pipeline with [`PipelineOptions::instances`](super::PipelineOptions::instances) needs besides.
    pub fn bind_instances(&self, instances: &Buffer) {
        let (device, raw) = (self.context.device(), instances.raw());
        // SAFETY: see `contexts`.
        unsafe { device.cmd_bind_vertex_buffers(self.raw, INSTANCES, &[raw], &[0]) };
    }

    /// Binds 32-bit indices.
    pub fn bind_indices(&self, indices: &Buffer) {
        let (device, raw) = (self.context.device(), indices.raw());
        // SAFETY: see `contexts`.
        unsafe { device.cmd_bind_index_buffer(self.raw, raw, 0, vk::IndexType::UINT32) };
    }

    /// Sets the viewport.
    pub fn viewport(&self, viewport: vk::Viewport) {
        let device = self.context.device();
        // SAFETY: see `contexts`.
        unsafe { device.cmd_set_viewport(self.raw, 0, &[viewport]) };
    }

    /// Sets the scissor.
    pub fn scissor(&self, scissor: vk::Rect2D) {
        let device = self.context.device();
        // SAFETY: see `contexts`.
        unsafe { device.cmd_set_scissor(self.raw, 0, &[scissor]) };
    }

    /// `vkCmdDraw` with `[vertexCount, instanceCount, firstVertex, firstInstance]`.
    pub fn draw(&self, [vertices, instances, first_vertex, first_instance]: [u32; 4]) {
        let device = self.context.device();
        // SAFETY: see `contexts`.
        unsafe { device.cmd_draw(self.raw, vertices, instances, first_vertex, first_instance) };
    }

    /// `vkCmdDrawIndexed` of one instance.
    pub fn draw_indexed(&self, count: u32, first_index: u32, vertex_offset: i32) {
        let device = self.context.device();
        // SAFETY: see `contexts`.
        unsafe { device.cmd_draw_indexed(self.raw, count, 1, first_index, vertex_offset, 0) };
    }

    /// `vkCmdDrawIndirect` of `count` draws, 16 bytes apart.
    pub fn draw_indirect(&self, draws: &Buffer, count: u32) {
        let (device, raw) = (self.context.device(), draws.raw());
        // SAFETY: see `contexts`.
        unsafe { device.cmd_draw_indirect(self.raw, raw, 0, count, 16) };
    }

    /// Copies all texels of `target` to the beginning of `buffer`.
    pub(super) fn copy(&self, target: &Target, buffer: &Buffer) {
        let source = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        self.barrier(target, vk::ImageLayout::GENERAL, source);
        let layers = vk::ImageSubresourceLayers::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .layer_count(1);
        let regions = [vk::BufferImageCopy::default()
            .image_subresource(layers)
            .image_extent(target.extent.into())];
        let to_host = vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
            .dst_access_mask(vk::AccessFlags::HOST_READ);
        let device = self.context.device();
        // SAFETY: see `contexts`.
        unsafe {
            device.cmd_copy_image_to_buffer(self.raw, target.image, source, buffer.raw(), &regions);
            device.cmd_pipeline_barrier(
                self.raw,
                vk::PipelineStageFlags::TRANSFER,
                vk::PipelineStageFlags::HOST,
                vk::DependencyFlags::empty(),
                &[to_host],
                &[],
                &[],
            );
        }
        self.barrier(target, source, vk::ImageLayout::GENERAL);
    }

    /// Whatever was done to `target` before happens before whatever follows, in the layout `to`.
    fn barrier(&self, target: &Target, from: vk::ImageLayout, to: vk::ImageLayout) {
        let access = vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE;
        let barriers = [vk::ImageMemoryBarrier::default()
            .src_access_mask(access)
            .dst_access_mask(access)
            .old_layout(from)
            .new_layout(to)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(target.image)
            .subresource_range(Target::RANGE)];
        let all = vk::PipelineStageFlags::ALL_COMMANDS;
        let device = self.context.device();
        // SAFETY: see `contexts`.
        unsafe {
            device.cmd_pipeline_barrier(
                self.raw,
                all,
                all,
                vk::DependencyFlags::empty(),
                &[],
                &[],
                &barriers,
            );
        }
    }
}

fn load_op(pass: &Pass) -> vk::AttachmentLoadOp {
    match pass.clear {
        Some(_) => vk::AttachmentLoadOp::CLEAR,
        None => vk::AttachmentLoadOp::LOAD,
    }
}

/// A `VkRenderPass` with one subpass over one target, and its framebuffer.
pub struct PassObject {
    /// The render pass.
    pub render_pass: vk::RenderPass,
    framebuffer: vk::Framebuffer,
    context: Context,
}

impl PassObject {
    /// A render pass that clears `target` and keeps what is drawn.
    pub fn new(context: &Context, target: &Target) -> Self {
        let attachments = [vk::AttachmentDescription::default()
            .format(target.format)
            .samples(vk::SampleCountFlags::TYPE_1)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .initial_layout(vk::ImageLayout::GENERAL)
            .final_layout(vk::ImageLayout::GENERAL)];
        let references = [vk::AttachmentReference::default().layout(vk::ImageLayout::GENERAL)];
        let subpasses = [vk::SubpassDescription::default().color_attachments(&references)];
        let create_info = vk::RenderPassCreateInfo::default()
            .attachments(&attachments)
            .subpasses(&subpasses);
        let device = context.device();
        // SAFETY: see `contexts`.
        unsafe {
            let render_pass = device
                .create_render_pass(&create_info, None)
                .expect("a render pass");
            let views = [target.view];
            let framebuffer_info = vk::FramebufferCreateInfo::default()
                .render_pass(render_pass)
                .attachments(&views)
                .width(target.extent.width)
                .height(target.extent.height)
                .layers(1);
            let framebuffer = device
                .create_framebuffer(&framebuffer_info, None)
                .expect("a framebuffer");
            Self {
                render_pass,
                framebuffer,
                context: context.clone(),
            }
        }
    }
}

impl Drop for PassObject {
    fn drop(&mut self) {
        let device = self.context.device();
        // SAFETY: see `contexts`.
        unsafe {
            device.destroy_framebuffer(self.framebuffer, None);
            device.destroy_render_pass(self.render_pass, None);
        }
    }
}
