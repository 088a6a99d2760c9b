//! Triangles among the Gaussians: their buffer, their pipeline, and their light.

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};
use gaurast_scene::camera::Model;
use gaurast_scene::{Camera, ColorSpace, MeshVertex, Scene};

use crate::device::Device;
use crate::error::{During, RenderError};
use crate::pipeline::{ShaderModule, shader_words};
use crate::resource::Buffer;
use crate::target::{COLOR_FORMAT, DEPTH_FORMAT};

/// The direction to the light, in the scene's frame (y down): from above, the front and somewhat the right.
const LIGHT: [f32; 3] = [0.348_155_3, -0.870_388_3, -0.348_155_3];

/// The light on a surface that faces away from it, as a part of that on one that faces it.
const SHADOW: f32 = 0.35;

/// A vertex in device memory.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct LitVertex {
    position: [f32; 3],
    color: [f32; 3],
}

/// The vertices of the triangles of `scene`, lit, with colours in the space of the Gaussians' ones.
pub(crate) fn lit(scene: &Scene) -> Vec<LitVertex> {
    let is_linear = scene.metadata().color_space == Some(ColorSpace::LinearRec709Display);
    let vertex = |vertex: &MeshVertex| {
        let facing: f32 = (0..3).map(|axis| vertex.normal[axis] * LIGHT[axis]).sum();
        let light = SHADOW + (1.0 - SHADOW) * (0.5 + 0.5 * facing);
        let color = vertex.color.map(|c| c * light);
        LitVertex { position: vertex.position, color: if is_linear { color.map(linear) } else { color } }
    };
    scene.mesh().vertices().iter().map(vertex).collect()
}

/// The linear light of an sRGB value, both from 0 to 1.
fn linear(srgb: f32) -> f32 {
    if srgb <= 0.040_45 { srgb / 12.92 } else { libm::powf((srgb + 0.055) / 1.055, 2.4) }
}

/// The matrix, column by column, from the scene to clip coordinates of a pinhole or orthographic camera. Depths are 1
/// at the near plane and 0 at the far plane, and [`depth_coefficients`] of a camera agree with them.
pub(crate) fn to_clip(camera: &Camera) -> [f32; 16] {
    let [width, height] = [camera.width, camera.height].map(f64::from);
    let [constant, factor] = depth_terms(camera);
    let parallel = camera.model == Model::Orthographic;
    // Rows of the projection of a point (x, y, z, 1) of the camera's frame.
    let across = |focal: f64, middle: f64, size: f64| (2.0 * focal / size, 2.0 * middle / size - 1.0);
    let (fx, cx) = across(camera.focal[0], camera.principal[0], width);
    let (fy, cy) = across(camera.focal[1], camera.principal[1], height);
    let projection = if parallel {
        [[fx, 0., 0., cx], [0., fy, 0., cy], [0., 0., factor, constant], [0., 0., 0., 1.]]
    } else {
        [[fx, 0., cx, 0.], [0., fy, cy, 0.], [0., 0., constant, factor], [0., 0., 1., 0.]]
    };
    let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| a[i] * b[i]).sum::<f64>();
    let row = |axis: [f64; 3]| [axis[0], axis[1], axis[2], -dot(axis, camera.eye)];
    let [right, down, forward] = camera.rotation.map(row);
    let view = [right, down, forward, [0., 0., 0., 1.]];
    let entry = |row: usize, column: usize| (0..4).map(|k| projection[row][k] * view[k][column]).sum::<f64>() as f32;
    std::array::from_fn(|i| entry(i % 4, i / 4))
}

/// The camera's depth coefficients with which Gaussians have the depths of triangles.
pub(crate) fn depth_coefficients(camera: &Camera) -> [f32; 2] {
    depth_terms(camera).map(|term| term as f32)
}

/// The constant, and the factor of 1 / z (of z if orthographic), of depths that are 1 at the near plane and 0 at the
/// far plane.
fn depth_terms(camera: &Camera) -> [f64; 2] {
    let (near, far) = (camera.near, camera.far);
    if camera.model == Model::Orthographic {
        return [far / (far - near), -1.0 / (far - near)];
    }
    // 0 without a far plane.
    let ratio = near / far;
    [-ratio / (1.0 - ratio), near / (1.0 - ratio)]
}

/// Triangles in device memory.
pub(crate) struct DeviceMesh {
    pub(crate) vertices: u32,
    pub(crate) buffer: Buffer,
    pub(crate) pipeline: MeshPipeline,
}

/// A pipeline that draws triangles with a depth test, and its layout.
pub(crate) struct MeshPipeline {
    handle: vk::Pipeline,
    layout: vk::PipelineLayout,
    device: Arc<Device>,
}

impl MeshPipeline {
    pub(crate) fn new(device: &Arc<Device>) -> Result<Self, RenderError> {
        let raw = device.raw();
        let constants = [vk::PushConstantRange::default()
            .stage_flags(vk::ShaderStageFlags::VERTEX)
            .size(size_of::<[f32; 16]>() as u32)];
        let create_info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&constants);
        // SAFETY: the structure is valid.
        let layout = unsafe { raw.create_pipeline_layout(&create_info, None) }.during("vkCreatePipelineLayout")?;
        let mut pipeline = Self { handle: vk::Pipeline::null(), layout, device: device.clone() };
        let bindings = [vk::VertexInputBindingDescription::default().stride(size_of::<LitVertex>() as u32)];
        let attribute = |location: u32, offset: usize| {
            vk::VertexInputAttributeDescription::default()
                .location(location)
                .format(vk::Format::R32G32B32_SFLOAT)
                .offset(offset as u32)
        };
        let attributes = [attribute(0, 0), attribute(1, std::mem::offset_of!(LitVertex, color))];
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(&attributes);
        let input_assembly =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let rasterization = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let multisample =
            vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(true)
            .depth_write_enable(true)
            .depth_compare_op(vk::CompareOp::GREATER);
        let attachments =
            [vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
        let vertex = ShaderModule::new(device, &shader_words(include_bytes!("shaders/mesh.vert.spv")))?;
        let fragment = ShaderModule::new(device, &shader_words(include_bytes!("shaders/mesh.frag.spv")))?;
        let stages = [vertex.stage(vk::ShaderStageFlags::VERTEX), fragment.stage(vk::ShaderStageFlags::FRAGMENT)];
        let dynamic_states = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic_states);
        let formats = [COLOR_FORMAT];
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(&formats)
            .depth_attachment_format(DEPTH_FORMAT);
        let create_info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&input_assembly)
            .viewport_state(&viewport)
            .rasterization_state(&rasterization)
            .multisample_state(&multisample)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(layout)
            .push_next(&mut rendering);
        // SAFETY: the structures are valid and live until the call returns.
        let created = unsafe { raw.create_graphics_pipelines(vk::PipelineCache::null(), &[create_info], None) };
        let handles = created.map_err(|(_, result)| result).during("vkCreateGraphicsPipelines")?;
        pipeline.handle = handles[0];
        Ok(pipeline)
    }

    pub(crate) fn handle(&self) -> vk::Pipeline {
        self.handle
    }

    pub(crate) fn layout(&self) -> vk::PipelineLayout {
        self.layout
    }
}

impl Drop for MeshPipeline {
    fn drop(&mut self) {
        let raw = self.device.raw();
        // SAFETY: every submission has been waited for, so the device doesn't use the pipeline, which may be null.
        unsafe {
            raw.destroy_pipeline(self.handle, None);
            raw.destroy_pipeline_layout(self.layout, None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Clip coordinates of `point` are its pixel and the depth that a Gaussian there has.
    #[test]
    fn triangles_are_where_gaussians_are() {
        let camera = Camera::look_at([1., -2., -4.], [0.; 3], [0., -1., 0.], 60.0, [64, 48]).expect("a camera");
        let (point, ahead) = ([0.5, 0.25, 1.0], 5.0);
        for camera in [
            camera.with_planes(0.2, f64::INFINITY),
            camera.with_planes(0.5, 9.0),
            camera.orthographic(ahead).with_planes(0.5, 9.0),
        ] {
            let matrix = to_clip(&camera);
            let row = |row: usize| {
                let sum: f64 = (0..3).map(|c| f64::from(matrix[4 * c + row]) * point[c]).sum();
                sum + f64::from(matrix[12 + row])
            };
            let [x, y, z, w] = [0, 1, 2, 3].map(row);
            let difference: [f64; 3] = std::array::from_fn(|i| point[i] - camera.eye[i]);
            let t = camera.rotation.map(|axis| (0..3).map(|i| axis[i] * difference[i]).sum::<f64>());
            let [constant, factor] = depth_coefficients(&camera).map(f64::from);
            let (scale, depth) = if camera.model == Model::Orthographic {
                (1.0, constant + factor * t[2])
            } else {
                (1.0 / t[2], constant + factor / t[2])
            };
            let pixel = |axis: usize| camera.focal[axis] * t[axis] * scale + camera.principal[axis];
            assert!(((x / w + 1.0) * 32.0 - pixel(0)).abs() < 1e-4, "{x} {w}");
            assert!(((y / w + 1.0) * 24.0 - pixel(1)).abs() < 1e-4, "{y} {w}");
            assert!((z / w - depth).abs() < 1e-6 && depth > 0.0 && depth < 1.0, "{z} {w} {depth}");
        }
    }

    #[test]
    fn what_faces_the_light_is_as_bright_as_its_colour() {
        let mut scene = Scene::default();
        let facing = |normal: [f32; 3]| MeshVertex { normal, color: [0.8, 0.4, 0.2], ..MeshVertex::default() };
        let away = LIGHT.map(|c| -c);
        *scene.mesh_mut() = gaurast_scene::Mesh::new([LIGHT, away, [0.0; 3]].map(facing).to_vec());
        let red: Vec<f32> = lit(&scene).iter().map(|vertex| vertex.color[0]).collect();
        assert!((red[0] - 0.8).abs() < 1e-5 && (red[1] - 0.28).abs() < 1e-5, "{red:?}");
        scene.metadata_mut().color_space = Some(ColorSpace::LinearRec709Display);
        assert!((lit(&scene)[0].color[0] - 0.603_827).abs() < 1e-4);
    }
}
