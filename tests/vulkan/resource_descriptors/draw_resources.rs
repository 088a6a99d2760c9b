//! Resources that draws of points, lines and triangles use, and queries of them.

use ash::vk;
use gaurast_testkit::canvas::{BLUE, CLEAR, Canvas, GREEN, PIXELS, RED, colored, count, everything, vertex};
use gaurast_testkit::devices::image;
use gaurast_testkit::scene::{FORMAT, HEIGHT, WIDTH, assert_close, at, set_viewport};
use gaurast_testkit::shader::spirv;
use gaurast_testkit::{Bindings, Buffer, Graphics, Resource, Shader};

#[gaurast_runner::test]
fn push_constants_move_vertices() {
    let canvas = Canvas::new();
    let vertices = everything(RED);
    let pixels = canvas.draw(&colored(), &vertices, |device, commands, made| {
        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        let offset = [1.0f32, 0.0, 0.0, 0.0];
        // SAFETY: see the crate.
        unsafe {
            device.cmd_push_constants(commands, made.layout, stages, 0, bytemuck::cast_slice(&offset));
            device.cmd_draw(commands, 3, 1, 0, 0);
        }
    });
    assert_eq!(at(&pixels, (WIDTH / 2 - 1, 20)), CLEAR);
    assert_eq!(at(&pixels, (WIDTH / 2, 20)), RED);
}

#[gaurast_runner::test]
fn textures_uniforms_and_specialization_constants_reach_the_fragment_stage() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let texture = image(gpu, vk::Format::R8G8B8A8_UNORM, [2, 1]);
    let texels = [[255u8, 0, 0, 255], [0, 255, 51, 255]];
    let tint = Buffer::of(gpu, &[0.5f32, 0.25, 1.0, 1.0]);
    let sampler = canvas.nearest_sampler();
    let set = Bindings::new(gpu, &[Resource::Uniform(tint.raw), Resource::Texture(texture.view, sampler.raw)]);
    texture.upload(vk::ImageAspectFlags::COLOR, texels.as_flattened());
    let mut request = colored().with_shader(Shader::fragment(spirv("tinted.frag")));
    request.shaders[1].constants = vec![(3, 2.0f32.to_bits())];
    request.set_layouts = vec![set.layout];
    let vertices = [
        vertex(-1.0, -1.0, [0.0; 4]),
        vertex(3.0, -1.0, [2.0, 0.0, 0.0, 0.0]),
        vertex(-1.0, 3.0, [0.0, 2.0, 0.0, 0.0]),
    ];
    let pixels = canvas.draw(&request, &vertices, |device, commands, made| {
        let bind_point = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_descriptor_sets(commands, bind_point, made.layout, 0, &[set.set], &[]);
            device.cmd_draw(commands, 3, 1, 0, 0);
        }
    });
    assert_close(at(&pixels, (3, 3)), [1.0, 0.0, 0.0, 2.0]);
    assert_close(at(&pixels, (60, 3)), [0.0, 0.5, 0.4, 2.0]);
    let told = gpu.message_texts().concat();
    assert!(told.contains("location 7"), "{told}");
}

#[gaurast_runner::test]
fn both_stages_store() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let counts = Buffer::of(gpu, &[0u32; 5]);
    let set = canvas.storage_set(&counts);
    let request = Graphics {
        shaders: vec![Shader::vertex(spirv("stores.vert")), Shader::fragment(spirv("stores.frag"))],
        set_layouts: vec![set.layout],
        ..colored()
    };
    let pixels = canvas.draw(&request, &everything(RED), |device, commands, made| {
        let bind_point = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_descriptor_sets(commands, bind_point, made.layout, 0, &[set.set], &[]);
            device.cmd_draw(commands, 3, 1, 0, 0);
        }
    });
    assert_eq!(count(&pixels, RED), PIXELS - 8 * HEIGHT as usize);
    assert_eq!(at(&pixels, (7, 9)), CLEAR);
    let counted: Vec<u32> = counts.values();
    assert_eq!(counted, [3, PIXELS as u32, 7, 8, 9]);
}

#[gaurast_runner::test]
fn queries_count_samples_and_invocations() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let device = gpu.device();
    let statistics = vk::QueryPipelineStatisticFlags::INPUT_ASSEMBLY_VERTICES
        | vk::QueryPipelineStatisticFlags::INPUT_ASSEMBLY_PRIMITIVES
        | vk::QueryPipelineStatisticFlags::VERTEX_SHADER_INVOCATIONS
        | vk::QueryPipelineStatisticFlags::CLIPPING_INVOCATIONS
        | vk::QueryPipelineStatisticFlags::FRAGMENT_SHADER_INVOCATIONS
        | vk::QueryPipelineStatisticFlags::COMPUTE_SHADER_INVOCATIONS;
    let pool = |info: vk::QueryPoolCreateInfo| {
        // SAFETY: see the crate.
        unsafe { device.create_query_pool(&info.query_count(1), None).unwrap() }
    };
    let occlusion = pool(vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::OCCLUSION));
    let counted = pool(
        vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::PIPELINE_STATISTICS)
            .pipeline_statistics(statistics),
    );
    // SAFETY: see the crate.
    unsafe {
        device.reset_query_pool(occlusion, 0, 1);
        device.reset_query_pool(counted, 0, 1);
    }
    // The second triangle hides the first, whose fragments count all the same.
    let mut vertices = [everything(RED), everything(BLUE)].concat();
    // The third is behind the eye.
    vertices.extend(everything(GREEN).map(|[x, y, z, _, r, g, b, a]| [x, y, z, -1.0, r, g, b, a]));
    canvas.draw(&colored(), &vertices, |device, commands, _| {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_begin_query(commands, occlusion, 0, vk::QueryControlFlags::PRECISE);
            device.cmd_begin_query(commands, counted, 0, vk::QueryControlFlags::empty());
            device.cmd_draw(commands, 9, 1, 0, 0);
            device.cmd_end_query(commands, counted, 0);
            device.cmd_end_query(commands, occlusion, 0);
            device.cmd_draw(commands, 3, 1, 0, 0);
        }
    });
    let (mut samples, mut statistics) = ([0u32; 1], [[0u64; 6]; 1]);
    let flags = vk::QueryResultFlags::WAIT;
    // SAFETY: see the crate.
    unsafe {
        device.get_query_pool_results(occlusion, 0, &mut samples, flags).unwrap();
        let flags = flags | vk::QueryResultFlags::TYPE_64;
        device.get_query_pool_results(counted, 0, &mut statistics, flags).unwrap();
        device.destroy_query_pool(occlusion, None);
        device.destroy_query_pool(counted, None);
    }
    assert_eq!(samples, [2 * PIXELS as u32]);
    assert_eq!(statistics, [[9, 3, 9, 3, 2 * PIXELS as u64, 0]]);
}

#[gaurast_runner::test]
fn a_secondary_command_buffer_draws_in_its_primarys_pass() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let made = colored().create(gpu).unwrap();
    let vertices = Buffer::of(gpu, everything(BLUE).as_flattened());
    let formats = [FORMAT];
    let mut rendering = vk::CommandBufferInheritanceRenderingInfo::default()
        .color_attachment_formats(&formats)
        .rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let inheritance = vk::CommandBufferInheritanceInfo::default().push_next(&mut rendering);
    let secondary = gpu.record_secondary(&inheritance, |recording| {
        let (device, commands) = recording.raw();
        set_viewport(device, commands, &canvas.image);
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, made.raw);
            device.cmd_bind_vertex_buffers(commands, 0, &[vertices.raw], &[0]);
            device.cmd_draw(commands, 3, 1, 0, 0);
        }
    });
    canvas.pass(&[&canvas.image], |device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_execute_commands(commands, &[secondary.raw]) };
    });
    assert_eq!(count(&canvas.pixels(), BLUE), PIXELS);
}
