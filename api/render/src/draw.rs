//! A frame's draw.

use ash::vk;
use gaurast::gaussian_primitive_topology;

use crate::device::Device;
use crate::device_scene::{DeviceScene, Vertices};
use crate::listed::List;
use crate::mesh;
use crate::modes::Kept;
use crate::resource::Image;
use crate::target::Target;
use gaurast_scene::Camera;
use gaurast_scene::camera::Model;

/// Records draws into a command buffer.
pub(super) struct Recorder<'a> {
    pub(super) device: &'a Device,
    pub(super) gaussian: &'a gaussian_primitive_topology::Device,
    /// A command buffer that is recording.
    pub(super) commands: vk::CommandBuffer,
}

impl Recorder<'_> {
    /// Draws `scene`, its triangles first, into the target's image, which is then in the layout of a colour attachment. Of the
    /// Gaussians, those of `list` are drawn, in its order, or all.
    pub(super) fn record(&self, target: &Target, scene: &DeviceScene, camera: &Camera, list: Option<&List>) {
        let (image, pipeline) = (&target.image, &scene.pipeline);
        let mut distortion = camera.distortion.to_vulkan();
        let mut vulkan = camera.to_vulkan();
        if !camera.distortion.is_none() {
            vulkan = vulkan.push_next(&mut distortion);
        }
        if list.is_some() {
            // What lies beyond the planes is not listed.
            vulkan = vulkan.near_plane(f32::MIN_POSITIVE).far_plane(f32::INFINITY);
        }
        if matches!(target.kept, Some((Kept::Depths, ..))) {
            vulkan = vulkan.depth_coefficients(DepthScale::of(camera).coefficients);
        }
        if scene.mesh.is_some() {
            vulkan = vulkan.depth_coefficients(mesh::depth_coefficients(camera));
        }
        let area = vk::Rect2D::default().extent(image.extent());
        let viewport =
            vk::Viewport::default().width(area.extent.width as f32).height(area.extent.height as f32).max_depth(1.0);
        let attachment = |image: &Image| {
            vk::RenderingAttachmentInfo::default()
                .image_view(image.view())
                .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .store_op(vk::AttachmentStoreOp::STORE)
        };
        let kept = target.kept.as_ref().map(|(_, image, _)| image);
        let attachments: Vec<_> = [image].into_iter().chain(kept).map(attachment).collect();
        let mut rendering =
            vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&attachments);
        // Depth 0, of what is infinitely far, is what attachments are cleared to.
        let tested = target.tested.as_ref().map(|image| {
            attachment(image)
                .image_layout(vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL)
                .store_op(vk::AttachmentStoreOp::DONT_CARE)
        });
        if let Some(tested) = &tested {
            rendering = rendering.depth_attachment(tested);
        }
        let buffers = scene.vertices.buffers();
        use vk::PipelineStageFlags as Stage;
        for image in [image].into_iter().chain(kept) {
            let to_attachment = image
                .barrier(vk::ImageLayout::UNDEFINED, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
                .dst_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE);
            self.barrier(Stage::TRANSFER, Stage::COLOR_ATTACHMENT_OUTPUT, to_attachment);
        }
        if let Some(image) = &target.tested {
            let tests = Stage::EARLY_FRAGMENT_TESTS | Stage::LATE_FRAGMENT_TESTS;
            let (from, to) = (vk::ImageLayout::UNDEFINED, vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL);
            let writes = vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE;
            let to_attachment = image
                .barrier(from, to)
                .src_access_mask(writes)
                .dst_access_mask(writes | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_READ);
            self.barrier(tests, tests, to_attachment);
        }
        let raw = self.device.raw();
        let commands = self.commands;
        // SAFETY: the command buffer is recording; image, pipeline and buffers belong to the same
        // device and live until the submission has ended; the pipeline's dynamic state, vertex
        // buffers, tables and camera are all set before the draw, whose vertices and indices lie within the buffers.
        unsafe {
            raw.cmd_begin_rendering(commands, &rendering);
            raw.cmd_set_viewport(commands, 0, &[viewport]);
            raw.cmd_set_scissor(commands, 0, &[area]);
            if let Some(mesh) = &scene.mesh {
                let (handle, layout) = (mesh.pipeline.handle(), mesh.pipeline.layout());
                let to_clip = mesh::to_clip(camera);
                let constants = bytemuck::bytes_of(&to_clip);
                raw.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, handle);
                raw.cmd_bind_vertex_buffers(commands, 0, &[mesh.buffer.handle()], &[0]);
                raw.cmd_push_constants(commands, layout, vk::ShaderStageFlags::VERTEX, 0, constants);
                raw.cmd_draw(commands, mesh.vertices, 1, 0, 0);
            }
            raw.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, pipeline.handle());
            raw.cmd_bind_vertex_buffers(commands, 0, &buffers, &vec![0; buffers.len()]);
            if let Vertices::Encoded(vertices) = &scene.vertices {
                self.gaussian.cmd_bind_gaussian_decoding_tables(commands, vertices.tables.places());
            }
            (self.gaussian).cmd_set_gaussian_cameras(commands, &[vulkan]);
            match list {
                Some(list) => {
                    raw.cmd_bind_index_buffer(commands, list.indices.handle(), 0, vk::IndexType::UINT32);
                    raw.cmd_draw_indexed(commands, list.count, 1, 0, 0, 0);
                }
                None => raw.cmd_draw(commands, scene.count, 1, 0, 0),
            }
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

/// The mapping of a camera's depths to values from 0 to 1, and back.
pub(super) struct DepthScale {
    /// The value of a depth z is the first coefficient plus the second divided by z; times z if orthographic.
    pub(super) coefficients: [f32; 2],
    parallel: bool,
}

impl DepthScale {
    pub(super) fn of(camera: &Camera) -> Self {
        let (near, far) = (camera.near, camera.far);
        let parallel = camera.model == Model::Orthographic;
        let coefficients = if parallel {
            [-near / (far - near), 1.0 / (far - near)]
        } else {
            // The reciprocal keeps its precision at every distance. The value 0 means that nothing is there.
            [0.0, near]
        };
        Self { coefficients: coefficients.map(|c| c as f32), parallel }
    }

    /// The depth of `value`; infinite for 0, which means that nothing is there.
    pub(super) fn depth(&self, value: f32) -> f32 {
        let [constant, factor] = self.coefficients;
        if value == 0.0 {
            f32::INFINITY
        } else if self.parallel {
            (value - constant) / factor
        } else {
            factor / value
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_come_back() {
        let perspective = Camera::orbit(1, [8, 8]).remove(0);
        let parallel = perspective.orthographic(4.0).with_planes(-2.0, 100.0);
        for (camera, inverse) in [(perspective, true), (parallel, false)] {
            let scale = DepthScale::of(&camera);
            let [constant, factor] = scale.coefficients;
            for depth in [0.3_f32, 1.0, 17.0, 99.0] {
                let term = if inverse { factor / depth } else { factor * depth };
                let back = scale.depth(constant + term);
                assert!((back / depth - 1.0).abs() < 1e-4, "{depth} {back}");
            }
            assert_eq!(scale.depth(0.0), f32::INFINITY);
        }
    }
}
