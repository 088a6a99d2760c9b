//! A frame's draw.

use ash::vk;
use gaurast::gaussian_primitive_topology;

use crate::device::Device;
use crate::pipeline::BINDINGS;
use crate::resource::Buffer;
use crate::{DeviceScene, Target};
use gaurast_scene::Camera;

/// A recorder of draws into a command buffer.
pub(super) struct Recorder<'a> {
    pub(super) device: &'a Device,
    pub(super) gaussian: &'a gaussian_primitive_topology::Device,
    /// A command buffer that is recording.
    pub(super) commands: vk::CommandBuffer,
}

impl Recorder<'_> {
    /// Draws `scene` into the target's image, which is then in the layout of an attachment.
    pub(super) fn record(&self, target: &Target, scene: &DeviceScene, camera: &Camera) {
        let (image, pipeline) = (&target.image, &scene.pipeline);
        let camera = camera.to_vulkan();
        let area = vk::Rect2D::default().extent(image.extent());
        let viewport = vk::Viewport::default()
            .width(area.extent.width as f32)
            .height(area.extent.height as f32)
            .max_depth(1.0);
        let attachment = vk::RenderingAttachmentInfo::default()
            .image_view(image.view())
            .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE);
        let attachments = [attachment];
        let rendering = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(1)
            .color_attachments(&attachments);
        let buffers = scene.buffers.each_ref().map(Buffer::handle);
        use vk::PipelineStageFlags as Stage;
        let to_attachment = image
            .barrier(
                vk::ImageLayout::UNDEFINED,
                vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            )
            .dst_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE);
        self.barrier(
            Stage::TRANSFER,
            Stage::COLOR_ATTACHMENT_OUTPUT,
            to_attachment,
        );
        let raw = self.device.raw();
        let commands = self.commands;
        // SAFETY: the command buffer is recording; image, pipeline and buffers belong to the same
        // device and live until the submission has ended; the pipeline's dynamic state, vertex
        // buffers and camera are all set before the draw, whose vertices lie within the buffers.
        unsafe {
            raw.cmd_begin_rendering(commands, &rendering);
            raw.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, pipeline.handle());
            raw.cmd_bind_vertex_buffers(commands, 0, &buffers, &[0; BINDINGS]);
            raw.cmd_set_viewport(commands, 0, &[viewport]);
            raw.cmd_set_scissor(commands, 0, &[area]);
            (self.gaussian).cmd_set_gaussian_camera(commands, &camera);
            raw.cmd_draw(commands, scene.count, 1, 0, 0);
            raw.cmd_end_rendering(commands);
        }
    }

    fn barrier(
        &self,
        before: vk::PipelineStageFlags,
        after: vk::PipelineStageFlags,
        barrier: vk::ImageMemoryBarrier<'_>,
    ) {
        // SAFETY: the command buffer is recording, outside a render pass; the image lives until the submission has
        // ended.
        unsafe {
            self.device.raw().cmd_pipeline_barrier(
                self.commands,
                before,
                after,
                vk::DependencyFlags::empty(),
                &[],
                &[],
                &[barrier],
            );
        }
    }
}
