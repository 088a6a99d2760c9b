//! A frame's draw, and the one that draws what is far at half size.
//!
//! What is far is small and blurred by the dilation as it is, so that a quarter of the pixels tell nearly as much. It goes
//! into an image of half the size, which a blit stretches over the target; what is near is drawn over that. The two are
//! sets of their own, so that they are composited exactly as one would be, but for what the stretching blurs.

use std::sync::Arc;

use ash::vk;
use gaurast::gaussian_primitive_topology;
use gaurast::vk::GaussianCameraGAURAST;

use crate::device::Device;
use crate::pipeline::{BINDINGS, GaussianPipeline};
use crate::resource::{Buffer, Image};
use crate::{COLOR_FORMAT, DeviceScene, RenderError, Target};
use gaurast_scene::Camera;

/// How a scene's far part is drawn.
pub(super) struct Far {
    /// The least view depth of what is far.
    depth: f32,
    /// Draws what is near over it.
    over: GaussianPipeline,
}

impl Far {
    pub(super) fn new(depth: f32, over: GaussianPipeline) -> Self {
        Self { depth, over }
    }

    /// The cameras of what is far and of what is near: all depths are one's or the other's.
    fn cameras(&self, camera: &Camera, half: vk::Extent2D) -> [GaussianCameraGAURAST<'static>; 2] {
        let far = camera.resized([half.width, half.height]).to_vulkan();
        let near = camera.to_vulkan();
        let depth = self.depth.max(near.near_plane.next_up());
        [far.near_plane(depth.next_down()), near.far_plane(depth)]
    }
}

/// An image half as wide and high as another.
pub(super) fn half_of(device: &Arc<Device>, whole: &Image) -> Result<Image, RenderError> {
    let whole = whole.extent();
    let extent = vk::Extent2D {
        width: whole.width.div_ceil(2),
        height: whole.height.div_ceil(2),
    };
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
    Image::new(device, extent, COLOR_FORMAT, usage)
}

/// What records draws.
pub(super) struct Recorder<'a> {
    pub(super) device: &'a Device,
    pub(super) gaussian: &'a gaussian_primitive_topology::Device,
    /// A command buffer that is recording.
    pub(super) commands: vk::CommandBuffer,
}

impl Recorder<'_> {
    /// Draws `scene` into the target's image, which is then in the layout of an attachment.
    pub(super) fn record(&self, target: &Target, scene: &DeviceScene, camera: &Camera) {
        let (Some(far), Some(half)) = (&scene.far, &target.half) else {
            let camera = camera.to_vulkan();
            return self.draw(&target.image, scene, &scene.pipeline, &camera, false);
        };
        let [far_camera, near_camera] = far.cameras(camera, half.extent());
        self.draw(half, scene, &scene.pipeline, &far_camera, false);
        self.stretch(half, &target.image);
        self.draw(&target.image, scene, &far.over, &near_camera, true);
    }

    /// Draws into `image`, which is an attachment already if what it holds is kept, and else is cleared to nothing.
    fn draw(
        &self,
        image: &Image,
        scene: &DeviceScene,
        pipeline: &GaussianPipeline,
        camera: &GaussianCameraGAURAST<'_>,
        keep: bool,
    ) {
        let area = vk::Rect2D::default().extent(image.extent());
        let viewport = vk::Viewport::default()
            .width(area.extent.width as f32)
            .height(area.extent.height as f32)
            .max_depth(1.0);
        let load_op = if keep {
            vk::AttachmentLoadOp::LOAD
        } else {
            vk::AttachmentLoadOp::CLEAR
        };
        let attachment = vk::RenderingAttachmentInfo::default()
            .image_view(image.view())
            .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
            .load_op(load_op)
            .store_op(vk::AttachmentStoreOp::STORE);
        let attachments = [attachment];
        let rendering = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(1)
            .color_attachments(&attachments);
        let buffers = scene.buffers.each_ref().map(Buffer::handle);
        if !keep {
            let to_attachment = image
                .barrier(
                    vk::ImageLayout::UNDEFINED,
                    vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
                )
                .dst_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE);
            use vk::PipelineStageFlags as Stage;
            self.barrier(
                Stage::TRANSFER,
                Stage::COLOR_ATTACHMENT_OUTPUT,
                to_attachment,
            );
        }
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
            (self.gaussian).cmd_set_gaussian_camera(commands, camera);
            raw.cmd_draw(commands, scene.count, 1, 0, 0);
            raw.cmd_end_rendering(commands);
        }
    }

    /// Stretches an attachment over all of another image, and makes that one an attachment.
    fn stretch(&self, from: &Image, to: &Image) {
        use vk::{AccessFlags as Access, ImageLayout as Layout, PipelineStageFlags as Stage};
        let to_source = from
            .barrier(
                Layout::COLOR_ATTACHMENT_OPTIMAL,
                Layout::TRANSFER_SRC_OPTIMAL,
            )
            .src_access_mask(Access::COLOR_ATTACHMENT_WRITE)
            .dst_access_mask(Access::TRANSFER_READ);
        let to_destination = to
            .barrier(Layout::UNDEFINED, Layout::TRANSFER_DST_OPTIMAL)
            .dst_access_mask(Access::TRANSFER_WRITE);
        let to_attachment = to
            .barrier(
                Layout::TRANSFER_DST_OPTIMAL,
                Layout::COLOR_ATTACHMENT_OPTIMAL,
            )
            .src_access_mask(Access::TRANSFER_WRITE)
            .dst_access_mask(Access::COLOR_ATTACHMENT_READ | Access::COLOR_ATTACHMENT_WRITE);
        self.barrier(Stage::COLOR_ATTACHMENT_OUTPUT, Stage::TRANSFER, to_source);
        self.barrier(Stage::TRANSFER, Stage::TRANSFER, to_destination);
        let layers = vk::ImageSubresourceLayers::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .layer_count(1);
        let corners = |extent: vk::Extent2D| {
            let corner = vk::Offset3D {
                x: extent.width as i32,
                y: extent.height as i32,
                z: 1,
            };
            [vk::Offset3D::default(), corner]
        };
        let region = vk::ImageBlit::default()
            .src_subresource(layers)
            .src_offsets(corners(from.extent()))
            .dst_subresource(layers)
            .dst_offsets(corners(to.extent()));
        // SAFETY: the command buffer is recording; both images are in these layouts, hold the regions, and live until
        // the submission has ended.
        unsafe {
            self.device.raw().cmd_blit_image(
                self.commands,
                from.handle(),
                Layout::TRANSFER_SRC_OPTIMAL,
                to.handle(),
                Layout::TRANSFER_DST_OPTIMAL,
                &[region],
                vk::Filter::LINEAR,
            );
        }
        self.barrier(
            Stage::TRANSFER,
            Stage::COLOR_ATTACHMENT_OUTPUT,
            to_attachment,
        );
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
