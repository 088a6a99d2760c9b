//! The processing of fragments: attachments, blending, depth and samples.

use ash::vk;
use gaurast_testkit::canvas::{
    BLUE, CLEAR, Canvas, DEPTH_FORMAT, GREEN, PIXELS, RED, colored, count, deep_vertex, everything, sampled_image,
    vertex,
};
use gaurast_testkit::devices::image;
use gaurast_testkit::scene::{FORMAT, HEIGHT, WIDTH, assert_close, at, replace};
use gaurast_testkit::shader::spirv;
use gaurast_testkit::{Buffer, Graphics, Shader};

#[gaurast_runner::test]
fn two_attachments_are_written_and_masked() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let other = image(gpu, FORMAT, [WIDTH, HEIGHT]);
    let mut request = colored().with_shader(Shader::fragment(spirv("two_targets.frag")));
    request.formats = vec![FORMAT; 2];
    request.blend = vec![replace(), replace().color_write_mask(vk::ColorComponentFlags::G)];
    let made = request.create(gpu).unwrap();
    let vertices = Buffer::of(gpu, everything(RED).as_flattened());
    canvas.pass(&[&canvas.image, &other], |device, commands| {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, made.raw);
            device.cmd_bind_vertex_buffers(commands, 0, &[vertices.raw], &[0]);
            device.cmd_draw(commands, 3, 1, 0, 0);
        }
    });
    assert_eq!(count(&canvas.pixels(), RED), PIXELS);
    let masked = [CLEAR[0], 1.0, CLEAR[2], CLEAR[3]];
    assert_eq!(count(&other.colors(), masked), PIXELS);
}

#[gaurast_runner::test]
fn two_sources_are_blended() {
    let canvas = Canvas::new();
    let mut request = colored().with_shader(Shader::fragment(spirv("two_sources.frag")));
    request.blend = vec![
        replace()
            .blend_enable(true)
            .src_color_blend_factor(vk::BlendFactor::SRC1_COLOR)
            .dst_color_blend_factor(vk::BlendFactor::ONE_MINUS_SRC1_COLOR)
            .src_alpha_blend_factor(vk::BlendFactor::SRC1_ALPHA)
            .dst_alpha_blend_factor(vk::BlendFactor::ONE_MINUS_SRC1_ALPHA),
    ];
    let pixels = canvas.draw_vertices(&request, &everything([1.0, 1.0, 1.0, 0.5]));
    let blend = |factor: f32| factor + 0.25 * (1.0 - factor);
    assert_close(at(&pixels, (5, 5)), [blend(0.5), blend(0.25), blend(0.125), 0.5]);
}

#[gaurast_runner::test]
fn a_logic_operation_works_on_bits() {
    let canvas = Canvas::of(vk::Format::R8G8B8A8_UNORM);
    let request = Graphics { logic_op: Some(vk::LogicOp::XOR), formats: vec![vk::Format::R8G8B8A8_UNORM], ..colored() };
    let made = request.create(&canvas.gpu).unwrap();
    let color = [15.0 / 255.0, 1.0, 0.0, 51.0 / 255.0];
    let vertices = Buffer::of(&canvas.gpu, everything(color).as_flattened());
    canvas.pass(&[&canvas.image], |device, commands| {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, made.raw);
            device.cmd_bind_vertex_buffers(commands, 0, &[vertices.raw], &[0]);
            device.cmd_draw(commands, 3, 1, 0, 0);
        }
    });
    let clear = 64u8;
    let expected = [clear ^ 15, clear ^ 255, clear, 51];
    let texels: Vec<[u8; 4]> = canvas.image.colors();
    assert!(texels.iter().all(|texel| *texel == expected), "{:?}", texels[0]);
}

#[gaurast_runner::test]
fn depth_decides_what_is_seen() {
    let canvas = Canvas::with_depth();
    let request = Graphics {
        depth_format: DEPTH_FORMAT,
        depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(true)
            .depth_write_enable(true)
            .depth_compare_op(vk::CompareOp::LESS),
        ..colored()
    };
    let near = everything(RED).map(|[x, y, ..]| deep_vertex([x, y, 0.25], RED));
    let far = [
        deep_vertex([-1.0, -1.0, 0.4], GREEN),
        deep_vertex([3.0, -1.0, 0.4], GREEN),
        deep_vertex([-1.0, 3.0, 0.0], GREEN),
    ];
    let pixels = canvas.draw_vertices(&request, &[near, far].concat());
    // The second triangle's depth falls to 0.2 at the lower edge.
    assert_eq!(at(&pixels, (30, 2)), RED);
    assert_eq!(at(&pixels, (30, 46)), GREEN);
}

#[gaurast_runner::test]
fn several_samples_make_smooth_edges() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let samples = sampled_image(gpu, vk::SampleCountFlags::TYPE_4);
    let request = Graphics {
        multisample: vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_4),
        ..colored()
    };
    let made = request.create(gpu).unwrap();
    let vertices = [vertex(-1.0, -1.0, RED), vertex(1.0, -1.0, RED), vertex(-1.0, 1.0, RED)];
    let vertices = Buffer::of(gpu, vertices.as_flattened());
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        canvas.record_resolving_pass(device, commands, &samples, || {
            // SAFETY: see the crate.
            unsafe {
                device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, made.raw);
                device.cmd_bind_vertex_buffers(commands, 0, &[vertices.raw], &[0]);
                device.cmd_draw(commands, 3, 1, 0, 0);
            }
        });
    });
    let pixels = canvas.pixels();
    let (inside, outside) = (count(&pixels, RED), count(&pixels, CLEAR));
    assert_eq!(at(&pixels, (0, 0)), RED);
    let edge = PIXELS - inside - outside;
    assert!((HEIGHT as usize..3 * WIDTH as usize).contains(&edge), "{edge}");
    for pixel in &pixels {
        let covered = (pixel[0] - CLEAR[0]) / (RED[0] - CLEAR[0]) * 4.0;
        assert!((covered - covered.round()).abs() < 1e-5, "{pixel:?}");
    }
}

#[gaurast_runner::test]
fn demoted_invocations_write_nothing_and_help() {
    let canvas = Canvas::new();
    let request = colored().with_shader(Shader::fragment(spirv("demoted.frag")));
    let pixels = canvas.draw_vertices(&request, &everything(BLUE));
    let expected = [1.0, 0.0, 1.0, 0.25];
    assert_eq!(count(&pixels, expected), PIXELS / 2);
    assert_eq!(at(&pixels, (6, 5)), expected);
    assert_eq!(at(&pixels, (7, 5)), CLEAR);
}

/// Draws a triangle that covers everything on four samples, and resolves them.
fn resolved(canvas: &Canvas, request: &Graphics<'_>, color: [f32; 4]) -> [f32; 4] {
    let gpu = &canvas.gpu;
    let samples = sampled_image(gpu, vk::SampleCountFlags::TYPE_4);
    let made = request.create(gpu).unwrap();
    let vertices = Buffer::of(gpu, everything(color).as_flattened());
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        canvas.record_resolving_pass(device, commands, &samples, || {
            // SAFETY: see the crate.
            unsafe {
                device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, made.raw);
                device.cmd_bind_vertex_buffers(commands, 0, &[vertices.raw], &[0]);
                device.cmd_draw(commands, 3, 1, 0, 0);
            }
        });
    });
    let pixels = canvas.pixels();
    assert_eq!(count(&pixels, pixels[0]), PIXELS);
    pixels[0]
}

#[gaurast_runner::test]
fn samples_are_shaded_masked_and_covered() {
    let canvas = Canvas::new();
    let four = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_4);
    let request = Graphics { multisample: four, ..colored() };
    assert_close(resolved(&canvas, &request, RED), RED);
    let each = request.clone().with_shader(Shader::fragment(spirv("per_sample.frag")));
    assert_close(resolved(&canvas, &each, RED), [15.0 / 4.0, 0.0, 0.0, 1.0]);
    let mask = [0b0101u32];
    let masked = Graphics {
        multisample: vk::PipelineMultisampleStateCreateInfo { p_sample_mask: mask.as_ptr(), ..four },
        ..each
    };
    let clear = CLEAR[0] * 0.5;
    assert_close(resolved(&canvas, &masked, RED), [5.0 / 4.0 + clear, clear, clear, 0.5]);
    // An alpha of one half covers two samples, and is replaced by one there.
    let covering = Graphics { multisample: four.alpha_to_coverage_enable(true).alpha_to_one_enable(true), ..colored() };
    let expected = [clear, 0.5 + clear, clear, 0.5];
    assert_close(resolved(&canvas, &covering, GREEN), expected);
}
