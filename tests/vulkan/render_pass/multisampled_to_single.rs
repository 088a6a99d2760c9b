//! Rendering with several samples to attachments of one (`VK_EXT_multisampled_render_to_single_sampled`). What it leaves is
//! what attachments of several samples are resolved to. Each test runs on this driver and on lavapipe.

use ash::vk;
use gaurast_runner::Case;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::stage_program::drivers;
use gaurast_testkit::{
    Attachments, Buffer, Driver, Formats, Gpu, Image, ImageOptions, Opening, Pass, Pipeline, PipelineOptions, Target,
    TargetOptions, Vertex, depth_test, fetch_sample, shapes,
};

const SIZE: [u32; 2] = [75, 50];
const COLOR: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
const FOUR: vk::SampleCountFlags = vk::SampleCountFlags::TYPE_4;

fn device(case: &Case) -> Gpu {
    let opening = Opening {
        extensions: &[ash::ext::multisampled_render_to_single_sampled::NAME],
        ..Opening::of(match case.variant() {
            "lavapipe" => Driver::Lavapipe,
            _ => Driver::Embedded,
        })
    };
    let mut features = vk::PhysicalDeviceMultisampledRenderToSingleSampledFeaturesEXT::default()
        .multisampled_render_to_single_sampled(true);
    Gpu::open_with(&opening, &mut features).expect("a device")
}

/// Attachments of one sample that are rendered to with four, by dynamic rendering.
struct Single {
    color: Image,
    depth: Image,
}

impl Single {
    fn new(gpu: &Gpu) -> Self {
        let image = |format, usage| {
            let options = ImageOptions {
                flags: vk::ImageCreateFlags::MULTISAMPLED_RENDER_TO_SINGLE_SAMPLED_EXT,
                ..ImageOptions::new(format, SIZE, usage | vk::ImageUsageFlags::SAMPLED)
            };
            Image::new(gpu, &options)
        };
        Self {
            color: image(COLOR, vk::ImageUsageFlags::COLOR_ATTACHMENT),
            depth: image(DEPTH, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT),
        }
    }

    fn colors(&self) -> Vec<[f32; 4]> {
        self.color.colors()
    }

    fn depths(&self) -> Vec<f32> {
        bytemuck::pod_collect_to_vec(&self.depth.read(vk::ImageAspectFlags::DEPTH, 4))
    }
}

impl Attachments for Single {
    fn size(&self) -> [u32; 2] {
        SIZE
    }

    fn attachment_formats(&self) -> Formats {
        Formats { colors: vec![COLOR], depth: DEPTH, samples: 4 }
    }

    fn begin(&self, device: &ash::Device, commands: vk::CommandBuffer, pass: &Pass) {
        let attachment = |view, mode| {
            vk::RenderingAttachmentInfo::default()
                .image_view(view)
                .image_layout(vk::ImageLayout::GENERAL)
                .resolve_mode(mode)
                .load_op(pass.load)
                .store_op(pass.store)
        };
        let clear = vk::ClearValue { color: pass.color };
        let color = [attachment(self.color.view, vk::ResolveModeFlags::AVERAGE).clear_value(clear)];
        let clear = vk::ClearValue { depth_stencil: pass.depth };
        let depth = attachment(self.depth.view, vk::ResolveModeFlags::SAMPLE_ZERO).clear_value(clear);
        let mut samples = vk::MultisampledRenderToSingleSampledInfoEXT::default()
            .multisampled_render_to_single_sampled_enable(true)
            .rasterization_samples(FOUR);
        let [width, height] = SIZE;
        let info = vk::RenderingInfo::default()
            .render_area(vk::Rect2D::default().extent(vk::Extent2D { width, height }))
            .layer_count(1)
            .color_attachments(&color)
            .depth_attachment(&depth)
            .push_next(&mut samples);
        // SAFETY: see the crate.
        unsafe { device.cmd_begin_rendering(commands, &info) };
    }
}

/// The same attachments in a render pass object of one subpass, which resolves depth to that of the first sample.
struct Object<'a> {
    single: &'a Single,
    gpu: &'a Gpu,
    pass: vk::RenderPass,
    framebuffer: vk::Framebuffer,
}

impl<'a> Object<'a> {
    fn new(gpu: &'a Gpu, single: &'a Single, load: vk::AttachmentLoadOp) -> Self {
        let general = vk::ImageLayout::GENERAL;
        let attachments = [COLOR, DEPTH].map(|format| {
            vk::AttachmentDescription2::default()
                .format(format)
                .samples(vk::SampleCountFlags::TYPE_1)
                .load_op(load)
                .store_op(vk::AttachmentStoreOp::STORE)
                .initial_layout(general)
                .final_layout(general)
        });
        let reference = |attachment, aspect| {
            vk::AttachmentReference2::default().attachment(attachment).layout(general).aspect_mask(aspect)
        };
        let colors = [reference(0, vk::ImageAspectFlags::COLOR)];
        let depth = reference(1, vk::ImageAspectFlags::DEPTH);
        let mut modes = vk::SubpassDescriptionDepthStencilResolve::default()
            .depth_resolve_mode(vk::ResolveModeFlags::SAMPLE_ZERO)
            .stencil_resolve_mode(vk::ResolveModeFlags::NONE);
        let mut samples = vk::MultisampledRenderToSingleSampledInfoEXT::default()
            .multisampled_render_to_single_sampled_enable(true)
            .rasterization_samples(FOUR);
        let subpasses = [vk::SubpassDescription2::default()
            .color_attachments(&colors)
            .depth_stencil_attachment(&depth)
            .push_next(&mut modes)
            .push_next(&mut samples)];
        let info = vk::RenderPassCreateInfo2::default().attachments(&attachments).subpasses(&subpasses);
        let views = [single.color.view, single.depth.view];
        // SAFETY: see the crate.
        unsafe {
            let pass = gpu.device().create_render_pass2(&info, None).expect("a render pass");
            let info = vk::FramebufferCreateInfo::default()
                .render_pass(pass)
                .attachments(&views)
                .width(SIZE[0])
                .height(SIZE[1])
                .layers(1);
            let framebuffer = gpu.device().create_framebuffer(&info, None).expect("a framebuffer");
            Self { single, gpu, pass, framebuffer }
        }
    }
}

impl Attachments for Object<'_> {
    fn size(&self) -> [u32; 2] {
        SIZE
    }

    fn attachment_formats(&self) -> Formats {
        self.single.attachment_formats()
    }

    fn begin(&self, device: &ash::Device, commands: vk::CommandBuffer, pass: &Pass) {
        let clears = [vk::ClearValue { color: pass.color }, vk::ClearValue { depth_stencil: pass.depth }];
        let [width, height] = SIZE;
        let info = vk::RenderPassBeginInfo::default()
            .render_pass(self.pass)
            .framebuffer(self.framebuffer)
            .render_area(vk::Rect2D::default().extent(vk::Extent2D { width, height }))
            .clear_values(&clears);
        // SAFETY: see the crate.
        unsafe { device.cmd_begin_render_pass(commands, &info, vk::SubpassContents::INLINE) };
    }

    fn end(&self, device: &ash::Device, commands: vk::CommandBuffer) {
        // SAFETY: see the crate.
        unsafe { device.cmd_end_render_pass(commands) };
    }
}

impl Drop for Object<'_> {
    fn drop(&mut self) {
        // SAFETY: see the crate.
        unsafe {
            self.gpu.device().destroy_framebuffer(self.framebuffer, None);
            self.gpu.device().destroy_render_pass(self.pass, None);
        }
    }
}

fn options(subpass: Option<vk::RenderPass>) -> PipelineOptions<'static> {
    PipelineOptions {
        depth_stencil: depth_test(vk::CompareOp::LESS),
        subpass: subpass.map(|pass| (pass, 0)),
        ..PipelineOptions::default()
    }
}

/// Draws half of the triangles before the other half.
fn draw(gpu: &Gpu, target: &impl Attachments, pipeline: &Pipeline, pass: &Pass) {
    let vertices = Buffer::of(gpu, &shapes::flat_soup(5, 40));
    gpu.run(|commands| {
        commands.pass(target, pass, || {
            commands.bind(pipeline);
            commands.vertices(&vertices);
            commands.draw(0..60);
            commands.draw(60..120);
        });
    });
}

/// Draws a triangle of ones at depth 0.25.
fn draw_triangle(gpu: &Gpu, target: &impl Attachments, pipeline: &Pipeline, pass: &Pass) {
    let triangle =
        [[-0.9, -0.8], [0.8, -0.5], [-0.3, 0.9]].map(|[x, y]| Vertex { position: [x, y, 0.25, 1.0], color: [1.0; 4] });
    let vertices = Buffer::of(gpu, &triangle);
    gpu.run(|commands| {
        commands.pass(target, pass, || {
            commands.bind(pipeline);
            commands.vertices(&vertices);
            commands.draw(0..3);
        });
    });
}

/// The colours that four samples are resolved to, and the depths of the first sample.
fn expected(gpu: &Gpu) -> (Vec<[f32; 4]>, Vec<f32>) {
    let options = TargetOptions { size: SIZE, depth: Some(DEPTH), samples: 4, ..TargetOptions::of(COLOR) };
    let target = Target::new(gpu, &options);
    let pipeline = Pipeline::new(gpu, &target, &self::options(None));
    draw(gpu, &target, &pipeline, &Pass::default());
    let depth = target.depth.as_ref().expect("a depth attachment");
    (target.resolved[0].colors(), fetch_sample(gpu, depth, 0).texels())
}

#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn samples_are_resolved_to_the_attachments(case: &Case) {
    let gpu = &device(case);
    let (colors, depths) = expected(gpu);
    let single = Single::new(gpu);
    let pipeline = Pipeline::new(gpu, &single, &options(None));
    draw(gpu, &single, &pipeline, &Pass::default());
    assert!(single.colors() == colors && single.depths() == depths, "dynamic rendering");
    let single = Single::new(gpu);
    let object = Object::new(gpu, &single, vk::AttachmentLoadOp::CLEAR);
    let pipeline = Pipeline::new(gpu, &object, &options(Some(object.pass)));
    draw(gpu, &object, &pipeline, &Pass::default());
    assert!(single.colors() == colors && single.depths() == depths, "a render pass");
}

/// Every sample begins as the attachment's texel: what is drawn to some of them leaves a share of it.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn samples_begin_as_the_attachments(case: &Case) {
    let gpu = &device(case);
    let target_options = TargetOptions { size: SIZE, samples: 4, ..TargetOptions::of(vk::Format::R32_SFLOAT) };
    let reference = Target::new(gpu, &target_options);
    let pipeline = Pipeline::new(gpu, &reference, &PipelineOptions::default());
    draw_triangle(gpu, &reference, &pipeline, &Pass::zeros());
    let shares: Vec<f32> = reference.resolved[0].colors();
    let first: Vec<f32> = fetch_sample(gpu, &reference.colors[0], 0).texels();
    let before: Vec<f32> = (0..SIZE[0] * SIZE[1]).map(|texel| (texel % 64) as f32).collect();
    let colors: Vec<[f32; 4]> = before.iter().map(|&value| [value, 2.0 * value, 0.0, 4.0]).collect();
    for is_object in [false, true] {
        let single = Single::new(gpu);
        single.color.upload(vk::ImageAspectFlags::COLOR, bytemuck::cast_slice(&colors));
        single.depth.upload(vk::ImageAspectFlags::DEPTH, bytemuck::cast_slice(&vec![0.5f32; before.len()]));
        if is_object {
            let object = Object::new(gpu, &single, vk::AttachmentLoadOp::LOAD);
            let pipeline = Pipeline::new(gpu, &object, &options(Some(object.pass)));
            draw_triangle(gpu, &object, &pipeline, &Pass::load());
        } else {
            let pipeline = Pipeline::new(gpu, &single, &options(None));
            draw_triangle(gpu, &single, &pipeline, &Pass::load());
        }
        let (found, depths) = (single.colors(), single.depths());
        for (place, (share, before)) in shares.iter().zip(&colors).enumerate() {
            let expected = before.map(|channel| share + (1.0 - share) * channel);
            assert_eq!(found[place], expected, "texel {place}, of which {share} is drawn");
            assert_eq!(depths[place], if first[place] == 1.0 { 0.25 } else { 0.5 }, "texel {place}");
        }
        let edges = shares.iter().filter(|share| **share > 0.0 && **share < 1.0).count();
        assert!(edges > 20, "{edges}");
    }
}
