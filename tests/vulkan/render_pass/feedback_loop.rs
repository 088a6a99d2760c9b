//! Feedback loops: shaders that read an image to which they draw. Each test runs on this driver and on lavapipe.

use ash::vk;
use gaurast_runner::Case;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::stage_program::{drivers, options};
use gaurast_testkit::{
    Attachments, Bindings, Commands, Driver, Formats, Gpu, Image, ImageOptions, Opening, Pass, Pipeline,
    PipelineOptions, Resource, Sampler,
};

/// An image that draws write and read.
struct Loop(Image);

impl Attachments for Loop {
    fn size(&self) -> [u32; 2] {
        [SIDE; 2]
    }

    fn attachment_formats(&self) -> Formats {
        Formats::of(self.0.options.format)
    }

    fn begin(&self, device: &ash::Device, commands: vk::CommandBuffer, pass: &Pass) {
        let attachment = [vk::RenderingAttachmentInfo::default()
            .image_view(self.0.view)
            .image_layout(vk::ImageLayout::GENERAL)
            .load_op(pass.load)
            .store_op(pass.store)
            .clear_value(vk::ClearValue { color: pass.color })];
        let extent = vk::Extent2D { width: SIDE, height: SIDE };
        let info = vk::RenderingInfo::default()
            .render_area(vk::Rect2D::default().extent(extent))
            .layer_count(1)
            .color_attachments(&attachment);
        // SAFETY: see the crate.
        unsafe { device.cmd_begin_rendering(commands, &info) };
    }
}

const SIDE: u32 = 40;

/// A device with feedback loops.
fn device(case: &Case) -> Gpu {
    let opening = Opening {
        extensions: &[ash::ext::attachment_feedback_loop_layout::NAME],
        ..Opening::of(match case.variant() {
            "lavapipe" => Driver::Lavapipe,
            _ => Driver::Embedded,
        })
    };
    let mut features =
        vk::PhysicalDeviceAttachmentFeedbackLoopLayoutFeaturesEXT::default().attachment_feedback_loop_layout(true);
    Gpu::open_with(&opening, &mut features).expect("a device")
}

/// Lets the next draw read what the pass has written to its pixels.
fn feedback_barrier(commands: &Commands) {
    let (device, raw) = commands.raw();
    let written = vk::AccessFlags::COLOR_ATTACHMENT_WRITE;
    let barrier =
        vk::MemoryBarrier::default().src_access_mask(written).dst_access_mask(vk::AccessFlags::SHADER_READ | written);
    // SAFETY: see the crate.
    unsafe {
        device.cmd_pipeline_barrier(
            raw,
            vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT,
            vk::PipelineStageFlags::FRAGMENT_SHADER | vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT,
            vk::DependencyFlags::BY_REGION | vk::DependencyFlags::FEEDBACK_LOOP_EXT,
            &[barrier],
            &[],
            &[],
        );
    }
}

/// Each draw doubles what the draws before it have left, and adds its pixel's column; barriers are between the draws.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn a_draw_reads_what_it_replaces(case: &Case) {
    const DRAWS: u32 = 4;
    let gpu = &device(case);
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT
        | vk::ImageUsageFlags::SAMPLED
        | vk::ImageUsageFlags::ATTACHMENT_FEEDBACK_LOOP_EXT;
    let format = vk::Format::R32G32B32A32_SFLOAT;
    let image = Image::new(gpu, &ImageOptions::new(format, [SIDE; 2], usage));
    let sampler = Sampler::new(gpu, &vk::SamplerCreateInfo::default());
    let texture = Resource::Texture(image.view, sampler.raw);
    let bindings = Bindings::new(gpu, &[texture]);
    let target = Loop(image);
    let pipeline = Pipeline::new(
        gpu,
        &target,
        &PipelineOptions {
            vertex: "void main() {
                gl_Position = vec4(4.0 * (gl_VertexIndex & 1) - 1.0, 4.0 * (gl_VertexIndex >> 1) - 1.0, 0.0, 1.0);
            }",
            fragment: Some(
                "layout(binding = 0) uniform sampler2D before;
                 layout(location = 0) out vec4 color;
                 void main() {
                     ivec2 pixel = ivec2(gl_FragCoord.xy);
                     color = 2.0 * texelFetch(before, pixel, 0) + vec4(float(pixel.x));
                 }",
            ),
            bindings: Some(&bindings),
            flags: vk::PipelineCreateFlags::COLOR_ATTACHMENT_FEEDBACK_LOOP_EXT,
            ..options()
        },
    );
    gpu.run(|commands| {
        commands.pass(&target, &Pass::clear([3.0; 4]), || {
            commands.bind(&pipeline);
            commands.bind_set(&bindings, &[]);
            for _ in 0..DRAWS {
                feedback_barrier(commands);
                commands.draw(0..3);
            }
        });
    });
    let pixels: Vec<[f32; 4]> = target.0.colors();
    for (place, pixel) in (0..).zip(&pixels) {
        let column = (place % SIDE) as f32;
        let expected = (0..DRAWS).fold(3.0, |before, _| 2.0 * before + column);
        assert_eq!(*pixel, [expected; 4], "pixel {place}");
    }
}

/// The reading of attachments may be a dynamic state; it is possible in any case.
#[gaurast_runner::test(needs = [GLSLANG])]
fn feedback_may_be_dynamic() {
    let mut layout =
        vk::PhysicalDeviceAttachmentFeedbackLoopLayoutFeaturesEXT::default().attachment_feedback_loop_layout(true);
    let mut features = vk::PhysicalDeviceAttachmentFeedbackLoopDynamicStateFeaturesEXT::default()
        .attachment_feedback_loop_dynamic_state(true);
    features.p_next = (&raw mut layout).cast();
    let names =
        [ash::ext::attachment_feedback_loop_layout::NAME, ash::ext::attachment_feedback_loop_dynamic_state::NAME];
    let gpu = Gpu::extended(&names, &mut features).expect("a device");
    let dynamic = ash::ext::attachment_feedback_loop_dynamic_state::Device::new(gpu.instance(), gpu.device());
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT
        | vk::ImageUsageFlags::SAMPLED
        | vk::ImageUsageFlags::ATTACHMENT_FEEDBACK_LOOP_EXT;
    let format = vk::Format::R32G32B32A32_SFLOAT;
    let image = Image::new(&gpu, &ImageOptions::new(format, [SIDE; 2], usage));
    let sampler = Sampler::new(&gpu, &vk::SamplerCreateInfo::default());
    let bindings = Bindings::new(&gpu, &[Resource::Texture(image.view, sampler.raw)]);
    let target = Loop(image);
    let options = PipelineOptions {
        vertex: "void main() {
            gl_Position = vec4(4.0 * (gl_VertexIndex & 1) - 1.0, 4.0 * (gl_VertexIndex >> 1) - 1.0, 0.0, 1.0);
        }",
        fragment: Some(
            "layout(binding = 0) uniform sampler2D before;
             layout(location = 0) out vec4 color;
             void main() { color = 2.0 * texelFetch(before, ivec2(gl_FragCoord.xy), 0); }",
        ),
        bindings: Some(&bindings),
        dynamic: vec![vk::DynamicState::ATTACHMENT_FEEDBACK_LOOP_ENABLE_EXT],
        ..options()
    };
    let pipeline = Pipeline::new(&gpu, &target, &options);
    gpu.run(|commands| {
        commands.pass(&target, &Pass::clear([3.0; 4]), || {
            commands.bind(&pipeline);
            commands.bind_set(&bindings, &[]);
            let (_, raw) = commands.raw();
            // SAFETY: see the crate.
            unsafe {
                (dynamic.fp().cmd_set_attachment_feedback_loop_enable_ext)(raw, vk::ImageAspectFlags::COLOR);
            }
            feedback_barrier(commands);
            commands.draw(0..3);
        });
    });
    assert_eq!(gpu.message_texts(), [""; 0]);
    let pixels: Vec<[f32; 4]> = target.0.colors();
    assert!(pixels.iter().all(|pixel| *pixel == [6.0; 4]));
}
