//! Gaussian draws, from pipeline and camera to pixels.

use crate::gpu::{Buffer, Gpu, Image};
use ash::vk;
use gaurast::vk::{
    GaussianAttributeLocationsGAURAST, GaussianCameraGAURAST,
    PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST, PipelineGaussianStateCreateInfoGAURAST,
};

const WIDTH: u32 = 64;
const HEIGHT: u32 = 48;
const FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;

/// A Gaussian as the tests store it: position, scale, rotation, opacity, degree-0 colour.
type Splat = [f32; 14];

/// A round Gaussian of one colour.
fn splat(position: [f32; 3], scale: f32, opacity: f32, color: [f32; 3]) -> Splat {
    // The degree-0 basis function is 1 / (2 sqrt(pi)).
    let basis = 0.282_094_8;
    let [r, g, b] = color.map(|c| (c - 0.5) / basis);
    let [x, y, z] = position;
    [
        x, y, z, scale, scale, scale, 1.0, 0.0, 0.0, 0.0, opacity, r, g, b,
    ]
}

/// A pipeline for [`Splat`]s over one colour attachment, with dynamic viewport and scissor.
fn pipeline(gpu: &Gpu, blend: vk::PipelineColorBlendAttachmentState) -> vk::Pipeline {
    let attribute =
        |location: u32, format: vk::Format, floats: u32| vk::VertexInputAttributeDescription {
            location,
            binding: 0,
            format,
            offset: floats * 4,
        };
    let attributes = [
        attribute(0, vk::Format::R32G32B32_SFLOAT, 0),
        attribute(1, vk::Format::R32G32B32_SFLOAT, 3),
        attribute(2, vk::Format::R32G32B32A32_SFLOAT, 6),
        attribute(3, vk::Format::R32_SFLOAT, 10),
        attribute(4, vk::Format::R32G32B32_SFLOAT, 11),
    ];
    let bindings = [vk::VertexInputBindingDescription {
        binding: 0,
        stride: size_of::<Splat>() as u32,
        input_rate: vk::VertexInputRate::VERTEX,
    }];
    let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
        .vertex_binding_descriptions(&bindings)
        .vertex_attribute_descriptions(&attributes);
    let input_assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
        .topology(PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST);
    let viewport = vk::PipelineViewportStateCreateInfo::default()
        .viewport_count(1)
        .scissor_count(1);
    let rasterization = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let multisample = vk::PipelineMultisampleStateCreateInfo::default()
        .rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let attachments = [blend];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
    let dynamic_states = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic_states);
    let formats = [FORMAT];
    let mut rendering =
        vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
    let mut gaussian = PipelineGaussianStateCreateInfoGAURAST::default().attribute_locations(
        GaussianAttributeLocationsGAURAST::default()
            .position(0)
            .scale(1)
            .rotation(2)
            .opacity(3)
            .first_spherical_harmonics(4),
    );
    // SAFETY: see the crate.
    unsafe {
        let layout_info = vk::PipelineLayoutCreateInfo::default();
        let layout = gpu
            .device
            .create_pipeline_layout(&layout_info, None)
            .unwrap();
        let info = [vk::GraphicsPipelineCreateInfo::default()
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&input_assembly)
            .viewport_state(&viewport)
            .rasterization_state(&rasterization)
            .multisample_state(&multisample)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(layout)
            .push_next(&mut rendering)
            .push_next(&mut gaussian)];
        let pipelines = gpu
            .device
            .create_graphics_pipelines(vk::PipelineCache::null(), &info, None)
            .unwrap();
        // A pipeline outlives its layout.
        gpu.device.destroy_pipeline_layout(layout, None);
        pipelines[0]
    }
}

fn replace() -> vk::PipelineColorBlendAttachmentState {
    vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)
}

fn over() -> vk::PipelineColorBlendAttachmentState {
    replace()
        .blend_enable(true)
        .src_color_blend_factor(vk::BlendFactor::ONE)
        .dst_color_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
        .color_blend_op(vk::BlendOp::ADD)
        .src_alpha_blend_factor(vk::BlendFactor::ONE)
        .dst_alpha_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
        .alpha_blend_op(vk::BlendOp::ADD)
}

/// Looks along +z from the origin, with the principal point on the centre of pixel (32, 24).
fn camera() -> GaussianCameraGAURAST<'static> {
    GaussianCameraGAURAST::default()
        .focal_length([100.0, 100.0])
        .principal_point([32.5, 24.5])
}

/// Records a pass that clears `image` and whose contents `record` records, with viewport and scissor set.
fn pass(
    device: &ash::Device,
    commands: vk::CommandBuffer,
    image: Image,
    clear: [f32; 4],
    record: impl FnOnce(),
) {
    let attachments = [vk::RenderingAttachmentInfo::default()
        .image_view(image.view)
        .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)
        .clear_value(vk::ClearValue {
            color: vk::ClearColorValue { float32: clear },
        })];
    let area = vk::Rect2D {
        offset: vk::Offset2D::default(),
        extent: image.extent,
    };
    let rendering = vk::RenderingInfo::default()
        .render_area(area)
        .layer_count(1)
        .color_attachments(&attachments);
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
        device.cmd_begin_rendering(commands, &rendering);
        device.cmd_set_viewport(commands, 0, &viewports);
        device.cmd_set_scissor(commands, 0, &[area]);
        record();
        device.cmd_end_rendering(commands);
    }
}

struct Scene {
    gpu: Gpu,
    pipeline: vk::Pipeline,
    image: Image,
    splats: Buffer,
}

impl Scene {
    fn new(splats: &[Splat], blend: vk::PipelineColorBlendAttachmentState) -> Self {
        let gpu = Gpu::new();
        Self {
            pipeline: pipeline(&gpu, blend),
            image: gpu.image(FORMAT, WIDTH, HEIGHT),
            splats: gpu.buffer_of(splats.as_flattened()),
            gpu,
        }
    }

    /// Draws in a pass of its own that clears to `clear`; `draw` records the draw.
    fn draw(
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
        self.gpu.read_image(self.image, 16)
    }

    fn bind(&self, device: &ash::Device, commands: vk::CommandBuffer) {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, self.pipeline);
            device.cmd_bind_vertex_buffers(commands, 0, &[self.splats.buffer], &[0]);
            self.gpu
                .gaussian
                .cmd_set_gaussian_camera(commands, &camera());
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

fn at(pixels: &[[f32; 4]], x: u32, y: u32) -> [f32; 4] {
    pixels[(y * WIDTH + x) as usize]
}

fn assert_close(actual: [f32; 4], expected: [f32; 4]) {
    let close = actual
        .iter()
        .zip(expected)
        .all(|(a, e)| (a - e).abs() <= 5e-6);
    assert!(close, "{actual:?} is not {expected:?}");
}

const CENTER: (u32, u32) = (32, 24);
const RED: [f32; 3] = [0.9, 0.2, 0.1];
const BLUE: [f32; 3] = [0.1, 0.3, 0.8];

#[test]
fn a_gaussian_is_brightest_at_its_mean() {
    let scene = Scene::new(&[splat([0.0, 0.0, 5.0], 0.1, 0.8, RED)], replace());
    let pixels = scene.draw([0.0; 4], |device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 1, 1, 0, 0) };
    });
    let [r, g, b] = RED.map(|c| c * 0.8);
    assert_close(at(&pixels, CENTER.0, CENTER.1), [r, g, b, 0.8]);
    // One pixel away the variance is (100 * 0.1 / 5)^2 + 0.3.
    let alpha = 0.8 * (-0.5f32 / 4.3).exp();
    let [r, g, b] = RED.map(|c| c * alpha);
    assert_close(at(&pixels, CENTER.0 + 1, CENTER.1), [r, g, b, alpha]);
    assert_close(at(&pixels, CENTER.0, CENTER.1 - 1), [r, g, b, alpha]);
    assert_eq!(at(&pixels, 0, 0), [0.0; 4]);
    assert_eq!(scene.gpu.take_messages(), Vec::<String>::new());
}

#[test]
fn gaussians_are_sorted_and_blended_over_the_background() {
    let splats = [
        splat([0.0, 0.0, 9.0], 0.1, 0.6, BLUE),
        splat([0.0, 0.0, 5.0], 0.1, 0.5, RED),
    ];
    let scene = Scene::new(&splats, over());
    let clear = [0.2, 0.4, 0.6, 1.0];
    let pixels = scene.draw(clear, |device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 2, 1, 0, 0) };
    });
    let color: [f32; 3] =
        std::array::from_fn(|i| 0.5 * RED[i] + 0.5 * 0.6 * BLUE[i] + 0.5 * 0.4 * clear[i]);
    let [r, g, b] = color;
    assert_close(at(&pixels, CENTER.0, CENTER.1), [r, g, b, 1.0]);
    assert_eq!(at(&pixels, 0, 0), clear);
}

#[test]
fn an_index_buffer_picks_gaussians() {
    let splats = [
        splat([0.0, 0.0, 5.0], 0.1, 0.5, RED),
        splat([0.0, 0.0, 5.0], 0.1, 0.7, BLUE),
    ];
    let scene = Scene::new(&splats, replace());
    let indices = scene.gpu.buffer_of(&[9u16, 0, 0, 7]);
    let pixels = scene.draw([0.0; 4], |device, commands| {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_index_buffer(commands, indices.buffer, 2, vk::IndexType::UINT16);
            device.cmd_draw_indexed(commands, 1, 1, 1, 1, 0);
        }
    });
    let [r, g, b] = BLUE.map(|c| c * 0.7);
    assert_close(at(&pixels, CENTER.0, CENTER.1), [r, g, b, 0.7]);
    scene.gpu.free_buffer(indices);
}

#[test]
fn indirect_draws_read_their_numbers_when_they_execute() {
    let splats = [
        splat([0.0, 0.0, 5.0], 0.1, 0.5, RED),
        splat([0.0, 0.0, 5.0], 0.1, 0.7, BLUE),
    ];
    let scene = Scene::new(&splats, replace());
    let numbers = scene.gpu.buffer_of(&[0u32; 5]);
    let indices = scene.gpu.buffer_of(&[1u32, 0]);
    let commands = scene
        .gpu
        .record(|device, commands| {
            pass(device, commands, scene.image, [0.0; 4], || {
                scene.bind(device, commands);
                // SAFETY: see the crate.
                unsafe {
                    device.cmd_bind_index_buffer(
                        commands,
                        indices.buffer,
                        0,
                        vk::IndexType::UINT32,
                    );
                    device.cmd_draw_indexed_indirect(commands, numbers.buffer, 0, 1, 20);
                }
            });
        })
        .unwrap();
    for (numbers_now, expected) in [
        ([0u32, 0, 0, 0, 0], [0.0; 4]),
        (
            [1, 1, 0, 0, 0],
            [BLUE[0] * 0.7, BLUE[1] * 0.7, BLUE[2] * 0.7, 0.7],
        ),
        (
            [1, 1, 1, 0, 0],
            [RED[0] * 0.5, RED[1] * 0.5, RED[2] * 0.5, 0.5],
        ),
    ] {
        scene.gpu.write(numbers, bytemuck::cast_slice(&numbers_now));
        scene.gpu.submit(commands);
        let pixels = scene.gpu.read_image(scene.image, 16);
        assert_close(at(&pixels, CENTER.0, CENTER.1), expected);
    }
    scene.gpu.free_buffer(numbers);
    scene.gpu.free_buffer(indices);
}

#[test]
fn a_draw_without_a_camera_draws_nothing_and_says_so() {
    let scene = Scene::new(&[splat([0.0, 0.0, 5.0], 0.1, 0.8, RED)], replace());
    scene.gpu.run(|device, commands| {
        pass(device, commands, scene.image, [0.25; 4], || {
            // SAFETY: see the crate.
            unsafe {
                device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, scene.pipeline);
                device.cmd_bind_vertex_buffers(commands, 0, &[scene.splats.buffer], &[0]);
                device.cmd_draw(commands, 1, 1, 0, 0);
            }
        });
    });
    let pixels: Vec<[f32; 4]> = scene.gpu.read_image(scene.image, 16);
    assert!(pixels.iter().all(|pixel| *pixel == [0.25; 4]));
    let messages = scene.gpu.take_messages();
    assert!(
        messages
            .iter()
            .any(|m| m.contains("vkCmdSetGaussianCameraGAURAST")),
        "{messages:?}"
    );
}
