//! Features of shaders of points, lines and triangles.

use ash::vk;
use gaurast_testkit::canvas::{
    CLEAR, Canvas, DEPTH_FORMAT, GREEN, PIXELS, RED, colored, count, deep_vertex, everything, vertex,
};
use gaurast_testkit::devices::open;
use gaurast_testkit::scene::{HEIGHT, WIDTH, assert_close, at};
use gaurast_testkit::shader::spirv;
use gaurast_testkit::{Graphics, Shader};

#[gaurast_runner::test]
fn fragments_read_clip_and_cull_distances() {
    let canvas = Canvas::new();
    let mut request = colored().with_shader(Shader::fragment(spirv("clip_reader.frag")));
    request.shaders[0] = Shader::vertex(spirv("clip_writer.vert"));
    let vertices = [
        vertex(-1.0, -1.0, [-0.5, 2.0, 0.25, 0.0]),
        vertex(3.0, -1.0, [3.5, 2.0, 0.25, 0.0]),
        vertex(-1.0, 3.0, [-0.5, 4.0, 2.25, 0.0]),
    ];
    let pixels = canvas.draw_vertices(&request, &vertices);
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let (s, t) = ((x as f32 + 0.5) / WIDTH as f32, (y as f32 + 0.5) / HEIGHT as f32);
            let found = at(&pixels, (x, y));
            if 2.0 * s < 0.5 {
                assert_eq!(found, CLEAR, "{x} {y}");
            } else {
                assert_close(found, [2.0 * s - 0.5, 2.0 + t, 0.25 + t, 1.0]);
            }
        }
    }
    // Inputs of the fragment shader that the vertex shader does not write are zero.
    request.shaders[0] = colored().shaders[0].clone();
    let pixels = canvas.draw_vertices(&request, &vertices);
    assert_eq!(count(&pixels, [0.0, 0.0, 0.0, 1.0]), PIXELS);
}

#[gaurast_runner::test]
fn vertices_and_fragments_use_subgroups() {
    let canvas = Canvas::new();
    let mut request = colored().with_shader(Shader::fragment(spirv("subgroups.frag")));
    request.shaders[0] = Shader::vertex(spirv("subgroups.vert"));
    let pixels = canvas.draw_vertices(&request, &everything(RED));
    let mut subgroups = vk::PhysicalDeviceSubgroupProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut subgroups);
    let gpu = &canvas.gpu;
    // SAFETY: see the crate.
    unsafe {
        gpu.instance().get_physical_device_properties2(gpu.physical_device(), &mut properties);
    }
    let draws = vk::ShaderStageFlags::ALL_GRAPHICS & subgroups.supported_stages;
    assert_eq!(draws, vk::ShaderStageFlags::ALL_GRAPHICS);
    let size = subgroups.subgroup_size as f32;
    assert_eq!(count(&pixels, [0.5, 1.0, 1.0, size]), PIXELS);
}

#[gaurast_runner::test]
fn a_depth_that_breaks_its_promise_is_written() {
    let canvas = Canvas::with_depth();
    let request = Graphics {
        depth_format: DEPTH_FORMAT,
        depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(true)
            .depth_write_enable(true)
            .depth_compare_op(vk::CompareOp::GREATER),
        ..colored().with_shader(Shader::fragment(spirv("unchanged_depth.frag")))
    };
    let second = Graphics { shaders: colored().shaders, ..request.clone() }.create(&canvas.gpu).unwrap();
    let at_depth = |depth, color| everything(color).map(|[x, y, ..]| deep_vertex([x, y, depth], color));
    // The second draw is between the depth of the first triangle and the depth that its shader wrote.
    let vertices = [at_depth(0.6, RED), at_depth(0.65, GREEN)].concat();
    let pixels = canvas.draw(&request, &vertices, |device, commands, _| {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_draw(commands, 3, 1, 0, 0);
            device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, second.raw);
            device.cmd_draw(commands, 3, 1, 3, 0);
        }
    });
    assert_eq!(count(&pixels, RED), PIXELS);
}

#[gaurast_runner::test]
fn stages_without_their_feature_are_refused() {
    let gpu = open();
    let mut request = colored();
    request.shaders.push(Shader { stage: vk::ShaderStageFlags::COMPUTE, ..request.shaders[0].clone() });
    let refused = request.create(&gpu).map(drop);
    let message = gpu.message_texts().concat();
    let lacking = vk::Result::ERROR_FEATURE_NOT_PRESENT;
    assert_eq!(refused, Err(lacking), "{message}");
    assert!(message.contains("shader stage"), "{message}");
}
