//! Pipelines, passes and scenes for Gaussian draws.

use crate::gpu::{Buffer, Gpu, Image};
use ash::vk;
use gaurast::vk::{
    GaussianAttributeLocationsGAURAST, GaussianCameraGAURAST,
    PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST, PipelineGaussianApproximationStateCreateInfoGAURAST,
    PipelineGaussianStateCreateInfoGAURAST,
};

pub const WIDTH: u32 = 64;
pub const HEIGHT: u32 = 48;
pub const FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;

/// The pixel of the point straight ahead of [`camera`].
pub const CENTER: (u32, u32) = (32, 24);

/// A Gaussian as the tests store it: position, scale, rotation, opacity, degree-0 colour.
pub type Splat = [f32; 14];

/// A round Gaussian of one colour.
pub fn splat(position: [f32; 3], scale: f32, opacity: f32, color: [f32; 3]) -> Splat {
    // The degree-0 basis function is 1 / (2 sqrt(pi)).
    let basis = 0.282_094_8;
    let [r, g, b] = color.map(|c| (c - 0.5) / basis);
    let [x, y, z] = position;
    [
        x, y, z, scale, scale, scale, 1.0, 0.0, 0.0, 0.0, opacity, r, g, b,
    ]
}

pub fn replace() -> vk::PipelineColorBlendAttachmentState {
    vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)
}

pub fn over() -> vk::PipelineColorBlendAttachmentState {
    replace()
        .blend_enable(true)
        .src_color_blend_factor(vk::BlendFactor::ONE)
        .dst_color_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
        .color_blend_op(vk::BlendOp::ADD)
        .src_alpha_blend_factor(vk::BlendFactor::ONE)
        .dst_alpha_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
        .alpha_blend_op(vk::BlendOp::ADD)
}

/// A pipeline for [`Splat`]s over one colour attachment, to be changed before it is created.
pub struct PipelineRequest<'a> {
    pub topology: vk::PrimitiveTopology,
    pub attributes: Vec<vk::VertexInputAttributeDescription>,
    pub bindings: Vec<vk::VertexInputBindingDescription>,
    pub stages: Vec<vk::PipelineShaderStageCreateInfo<'a>>,
    pub blend: Vec<vk::PipelineColorBlendAttachmentState>,
    pub blend_constants: [f32; 4],
    pub logic_op: bool,
    pub depth_test: bool,
    pub samples: vk::SampleCountFlags,
    /// Alpha makes coverage, and is one then.
    pub alpha_to_coverage: bool,
    pub dynamic: Vec<vk::DynamicState>,
    pub formats: Vec<vk::Format>,
    pub render_pass: vk::RenderPass,
    pub view_mask: u32,
    /// Without sets or push constants if it is null.
    pub layout: vk::PipelineLayout,
    pub primitive_restart: bool,
    pub gaussian: Option<PipelineGaussianStateCreateInfoGAURAST<'static>>,
    pub approximation: Option<PipelineGaussianApproximationStateCreateInfoGAURAST<'static>>,
}

impl Default for PipelineRequest<'_> {
    fn default() -> Self {
        let attribute =
            |location: u32, format: vk::Format, floats: u32| vk::VertexInputAttributeDescription {
                location,
                binding: 0,
                format,
                offset: floats * 4,
            };
        let locations = GaussianAttributeLocationsGAURAST::default()
            .position(0)
            .scale(1)
            .rotation(2)
            .opacity(3)
            .first_spherical_harmonics(4);
        Self {
            topology: PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST,
            attributes: vec![
                attribute(0, vk::Format::R32G32B32_SFLOAT, 0),
                attribute(1, vk::Format::R32G32B32_SFLOAT, 3),
                attribute(2, vk::Format::R32G32B32A32_SFLOAT, 6),
                attribute(3, vk::Format::R32_SFLOAT, 10),
                attribute(4, vk::Format::R32G32B32_SFLOAT, 11),
            ],
            bindings: vec![vk::VertexInputBindingDescription {
                binding: 0,
                stride: size_of::<Splat>() as u32,
                input_rate: vk::VertexInputRate::VERTEX,
            }],
            stages: Vec::new(),
            blend: vec![replace()],
            blend_constants: [0.0; 4],
            logic_op: false,
            depth_test: false,
            samples: vk::SampleCountFlags::TYPE_1,
            alpha_to_coverage: false,
            dynamic: vec![vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR],
            formats: vec![FORMAT],
            render_pass: vk::RenderPass::null(),
            view_mask: 0,
            layout: vk::PipelineLayout::null(),
            primitive_restart: false,
            gaussian: Some(
                PipelineGaussianStateCreateInfoGAURAST::default().attribute_locations(locations),
            ),
            approximation: None,
        }
    }
}

impl PipelineRequest<'_> {
    /// Creates it. A layout of its own is destroyed at once, as Vulkan allows.
    pub fn create(&self, gpu: &Gpu) -> Result<vk::Pipeline, vk::Result> {
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&self.bindings)
            .vertex_attribute_descriptions(&self.attributes);
        let input_assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(self.topology)
            .primitive_restart_enable(self.primitive_restart);
        let viewport = vk::PipelineViewportStateCreateInfo::default()
            .viewport_count(1)
            .scissor_count(1);
        let rasterization = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let multisample = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(self.samples)
            .alpha_to_coverage_enable(self.alpha_to_coverage)
            .alpha_to_one_enable(self.alpha_to_coverage);
        let depth_stencil =
            vk::PipelineDepthStencilStateCreateInfo::default().depth_test_enable(self.depth_test);
        let blend = vk::PipelineColorBlendStateCreateInfo::default()
            .attachments(&self.blend)
            .logic_op_enable(self.logic_op)
            .blend_constants(self.blend_constants);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&self.dynamic);
        // Without a depth attachment the depth test is ignored.
        let depth_format = if self.depth_test {
            vk::Format::D32_SFLOAT
        } else {
            vk::Format::UNDEFINED
        };
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .view_mask(self.view_mask)
            .color_attachment_formats(&self.formats)
            .depth_attachment_format(depth_format);
        let mut gaussian = self.gaussian.unwrap_or_default();
        let mut approximation = self.approximation.unwrap_or_default();
        // SAFETY: see the crate.
        unsafe {
            let layout_info = vk::PipelineLayoutCreateInfo::default();
            let empty = gpu
                .device
                .create_pipeline_layout(&layout_info, None)
                .unwrap();
            let layout = match self.layout {
                layout if layout == vk::PipelineLayout::null() => empty,
                layout => layout,
            };
            let mut info = vk::GraphicsPipelineCreateInfo::default()
                .stages(&self.stages)
                .vertex_input_state(&vertex_input)
                .input_assembly_state(&input_assembly)
                .viewport_state(&viewport)
                .rasterization_state(&rasterization)
                .multisample_state(&multisample)
                .depth_stencil_state(&depth_stencil)
                .color_blend_state(&blend)
                .dynamic_state(&dynamic)
                .layout(layout)
                .render_pass(self.render_pass)
                .push_next(&mut rendering);
            if self.gaussian.is_some() {
                info = info.push_next(&mut gaussian);
            }
            if self.approximation.is_some() {
                info = info.push_next(&mut approximation);
            }
            let created =
                gpu.device
                    .create_graphics_pipelines(vk::PipelineCache::null(), &[info], None);
            gpu.device.destroy_pipeline_layout(empty, None);
            match created {
                Ok(pipelines) => Ok(pipelines[0]),
                Err((pipelines, error)) => {
                    assert_eq!(pipelines, [vk::Pipeline::null()]);
                    Err(error)
                }
            }
        }
    }
}

/// Looks along +z from the origin, with the principal point on the centre of pixel [`CENTER`].
pub fn camera() -> GaussianCameraGAURAST<'static> {
    GaussianCameraGAURAST::default()
        .focal_length([100.0, 100.0])
        .principal_point([32.5, 24.5])
}

/// All of an image.
pub fn area(image: Image) -> vk::Rect2D {
    vk::Rect2D {
        offset: vk::Offset2D::default(),
        extent: image.extent,
    }
}

/// Sets viewport and scissor to all of an image.
pub fn set_viewport(device: &ash::Device, commands: vk::CommandBuffer, image: Image) {
    let viewports = [vk::Viewport {
        x: 0.0,
        y: 0.0,
        width: image.extent.width as f32,
        height: image.extent.height as f32,
        min_depth: 0.0,
        max_depth: 1.0,
    }];
    // SAFETY: see the crate.
    unsafe {
        device.cmd_set_viewport(commands, 0, &viewports);
        device.cmd_set_scissor(commands, 0, &[area(image)]);
    }
}

/// Records a pass that clears `image`, with viewport and scissor set, and what `record` records in it.
pub fn pass(
    device: &ash::Device,
    commands: vk::CommandBuffer,
    image: Image,
    clear: [f32; 4],
    record: impl FnOnce(),
) {
    let flags = vk::RenderingFlags::empty();
    pass_with(flags, device, commands, image, clear, || {
        set_viewport(device, commands, image);
        record();
    });
}

/// Records a pass that clears `image`, and what `record` records in it.
pub fn pass_with(
    flags: vk::RenderingFlags,
    device: &ash::Device,
    commands: vk::CommandBuffer,
    image: Image,
    clear: [f32; 4],
    record: impl FnOnce(),
) {
    let attachments = [vk::RenderingAttachmentInfo::default()
        .image_view(image.view)
        .image_layout(vk::ImageLayout::GENERAL)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)
        .clear_value(vk::ClearValue {
            color: vk::ClearColorValue { float32: clear },
        })];
    let rendering = vk::RenderingInfo::default()
        .flags(flags)
        .render_area(area(image))
        .layer_count(1)
        .color_attachments(&attachments);
    // SAFETY: see the crate.
    unsafe { device.cmd_begin_rendering(commands, &rendering) };
    record();
    // SAFETY: see the crate.
    unsafe { device.cmd_end_rendering(commands) };
}

/// Gaussians, a pipeline that draws them and an image that they are drawn to.
pub struct Scene {
    pub gpu: Gpu,
    pub pipeline: vk::Pipeline,
    pub image: Image,
    pub splats: Buffer,
}

impl Scene {
    pub fn new(splats: &[Splat], request: &PipelineRequest) -> Self {
        Self::on(Gpu::new(), splats, request)
    }

    /// The scene on a device that was opened before.
    pub fn on(gpu: Gpu, splats: &[Splat], request: &PipelineRequest) -> Self {
        Self {
            pipeline: request.create(&gpu).unwrap(),
            image: gpu.image(FORMAT, WIDTH, HEIGHT),
            splats: gpu.buffer_of(splats.as_flattened()),
            gpu,
        }
    }

    /// Draws in a pass of its own that clears to `clear`; `draw` records the draw.
    pub fn draw(
        &self,
        clear: [f32; 4],
        draw: impl FnOnce(&ash::Device, vk::CommandBuffer),
    ) -> Vec<[f32; 4]> {
        self.gpu.run(|device, commands| {
            pass(device, commands, self.image, clear, || {
                self.bind(device, commands);
                draw(device, commands);
            });
        });
        self.pixels()
    }

    /// The image.
    pub fn pixels(&self) -> Vec<[f32; 4]> {
        self.gpu.read_image(self.image, 16)
    }

    /// Binds the pipeline, the Gaussians and the camera.
    pub fn bind(&self, device: &ash::Device, commands: vk::CommandBuffer) {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, self.pipeline);
            device.cmd_bind_vertex_buffers(commands, 0, &[self.splats.buffer], &[0]);
            self.gpu
                .gaussian
                .cmd_set_gaussian_cameras(commands, &[camera()]);
        }
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: see the crate.
        unsafe { self.gpu.device.destroy_pipeline(self.pipeline, None) };
        self.gpu.free_image(self.image);
        self.gpu.free_buffer(self.splats);
    }
}

/// The pixel at (x, y).
pub fn at(pixels: &[[f32; 4]], (x, y): (u32, u32)) -> [f32; 4] {
    pixels[(y * WIDTH + x) as usize]
}

/// Premultiplied colour with alpha.
pub fn premultiplied(color: [f32; 3], alpha: f32) -> [f32; 4] {
    let [r, g, b] = color.map(|c| c * alpha);
    [r, g, b, alpha]
}

pub fn assert_close(actual: [f32; 4], expected: [f32; 4]) {
    let close = actual
        .iter()
        .zip(expected)
        .all(|(a, e)| (a - e).abs() <= 5e-6);
    assert!(close, "{actual:?} is not {expected:?}");
}
