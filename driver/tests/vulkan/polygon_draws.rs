//! Points, lines and triangles as they are drawn.

use crate::canvas::{
    CLEAR, Canvas, DEPTH_FORMAT, count, everything, layered_image, read_layer, sampled_image,
    write_image,
};
use crate::polygons::{Request, deep_vertex, fragment_shader, vertex, vertex_shader};
use crate::scene::{FORMAT, HEIGHT, WIDTH, assert_close, at, replace};
use crate::spirv;
use ash::vk;

const RED: [f32; 4] = [1.0, 0.0, 0.0, 1.0];
const GREEN: [f32; 4] = [0.0, 1.0, 0.0, 0.5];
const BLUE: [f32; 4] = [0.0, 0.0, 1.0, 0.25];

const PIXELS: usize = (WIDTH * HEIGHT) as usize;

#[test]
fn a_triangle_covers_what_it_covers() {
    let canvas = Canvas::new();
    let vertices = [
        vertex(-1.0, -1.0, RED),
        vertex(1.0, -1.0, RED),
        vertex(-1.0, 1.0, RED),
    ];
    let pixels = canvas.draw_vertices(&Request::default(), &vertices);
    assert_eq!(at(&pixels, (0, 0)), RED);
    assert_eq!(at(&pixels, (WIDTH - 1, HEIGHT - 1)), CLEAR);
    // The diagonal passes through no pixel's centre but where the sides' ratio has it.
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let along = (x as f32 + 0.5) / WIDTH as f32 + (y as f32 + 0.5) / HEIGHT as f32;
            if (along - 1.0).abs() > 1e-3 {
                let expected = if along < 1.0 { RED } else { CLEAR };
                assert_eq!(at(&pixels, (x, y)), expected, "{x} {y}");
            }
        }
    }
}

#[test]
fn colours_are_interpolated() {
    let canvas = Canvas::new();
    let color = |x: f32, y: f32| [x, y, 0.5, 1.0];
    let vertices = [
        vertex(-1.0, -1.0, color(0.0, 0.0)),
        vertex(3.0, -1.0, color(2.0, 0.0)),
        vertex(-1.0, 3.0, color(0.0, 2.0)),
    ];
    let pixels = canvas.draw_vertices(&Request::default(), &vertices);
    for (x, y) in [(0, 0), (17, 31), (63, 47), (40, 3)] {
        let (s, t) = (x as f32 + 0.5, y as f32 + 0.5);
        let expected = [s / WIDTH as f32, t / HEIGHT as f32, 0.5, 1.0];
        assert_close(at(&pixels, (x, y)), expected);
    }
}

#[test]
fn push_constants_move_vertices() {
    let canvas = Canvas::new();
    let vertices = everything(RED);
    let pixels = canvas.draw(&Request::default(), &vertices, |device, commands, made| {
        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        let offset = [1.0f32, 0.0, 0.0, 0.0];
        // SAFETY: see the crate.
        unsafe {
            device.cmd_push_constants(
                commands,
                made.layout,
                stages,
                0,
                bytemuck::cast_slice(&offset),
            );
            device.cmd_draw(commands, 3, 1, 0, 0);
        }
    });
    assert_eq!(at(&pixels, (WIDTH / 2 - 1, 20)), CLEAR);
    assert_eq!(at(&pixels, (WIDTH / 2, 20)), RED);
}

#[test]
fn indices_choose_vertices() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let mut vertices = vec![vertex(0.0, 0.0, BLUE); 2];
    vertices.extend(everything(GREEN));
    let words = gpu.buffer_of(&[77u32, 0, 1, 2]);
    let halves = gpu.buffer_of(&[77u16, 0, 1, 2]);
    let bytes = gpu.buffer_of(&[77u8, 0, 1, 2]);
    for (buffer, ty) in [
        (words, vk::IndexType::UINT32),
        (halves, vk::IndexType::UINT16),
        (bytes, vk::IndexType::UINT8_KHR),
    ] {
        let pixels = canvas.draw(&Request::default(), &vertices, |device, commands, _| {
            // SAFETY: see the crate.
            unsafe {
                device.cmd_bind_index_buffer(commands, buffer.buffer, 0, ty);
                device.cmd_draw_indexed(commands, 3, 1, 1, 2, 0);
            }
        });
        assert_eq!(count(&pixels, GREEN), PIXELS, "{ty:?}");
        gpu.free_buffer(buffer);
    }
}

/// A pipeline that draws quads in cells, an instance each, over `numbered.vert`.
fn cells(divisor: Option<u32>) -> Request {
    Request {
        shaders: vec![
            vertex_shader(spirv!("numbered.vert")),
            Request::default().shaders[1].clone(),
        ],
        bindings: vec![vk::VertexInputBindingDescription {
            binding: 0,
            stride: 2,
            input_rate: vk::VertexInputRate::INSTANCE,
        }],
        attributes: vec![vk::VertexInputAttributeDescription {
            location: 0,
            binding: 0,
            format: vk::Format::R8G8_UINT,
            offset: 0,
        }],
        divisors: divisor
            .map(|divisor| vk::VertexInputBindingDivisorDescriptionKHR {
                binding: 0,
                divisor,
            })
            .into_iter()
            .collect(),
        topology: vk::PrimitiveTopology::TRIANGLE_STRIP,
        ..Request::default()
    }
}

/// The pixel in the middle of a cell of four by four.
fn cell(pixels: &[[f32; 4]], x: u32, y: u32) -> [f32; 4] {
    at(pixels, (x * WIDTH / 4 + 8, y * HEIGHT / 4 + 6))
}

#[test]
fn instances_are_numbered_and_have_attributes() {
    let canvas = Canvas::new();
    let places = [[0u8, 0], [1, 0], [2, 1], [3, 3]];
    let draw = |device: &ash::Device, commands, _| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 4, 3, 0, 1) };
    };
    let pixels = canvas.draw_of(&cells(None), places.as_flattened(), draw);
    assert_eq!(cell(&pixels, 0, 0), CLEAR);
    assert_eq!(cell(&pixels, 1, 0), [1.0, 1.0, 0.0, 1.0]);
    assert_eq!(cell(&pixels, 2, 1), [2.0, 1.0, 0.0, 1.0]);
    assert_eq!(cell(&pixels, 3, 3), [3.0, 1.0, 0.0, 1.0]);
    // Every second instance; the first one's index doesn't count.
    let pixels = canvas.draw_of(&cells(Some(2)), places.as_flattened(), draw);
    assert_eq!(cell(&pixels, 1, 0), [2.0, 1.0, 0.0, 1.0]);
    assert_eq!(cell(&pixels, 2, 1), [3.0, 1.0, 0.0, 1.0]);
    assert_eq!(cell(&pixels, 3, 3), CLEAR);
    let pixels = canvas.draw_of(&cells(Some(0)), places.as_flattened(), draw);
    assert_eq!(cell(&pixels, 1, 0), [3.0, 1.0, 0.0, 1.0]);
    assert_eq!(cell(&pixels, 2, 1), CLEAR);
}

#[test]
fn indirect_draws_are_numbered() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let places = [[0u8, 0], [1, 0], [2, 1], [3, 3]];
    // Vertices, instances, first vertex, first instance, and a word that no draw reads.
    let draws = [[4u32, 1, 0, 0, 9], [4, 2, 8, 2, 9]];
    let draws = gpu.buffer_of(draws.as_flattened());
    let one = gpu.buffer_of(&[1u32]);
    let indices = gpu.buffer_of(&[0u16, 1, 2, 3]);
    let indexed = gpu.buffer_of(&[4u32, 1, 0, 5, 3]);
    let pixels = canvas.draw_of(
        &cells(None),
        places.as_flattened(),
        |device, commands, _| {
            // SAFETY: see the crate.
            unsafe { device.cmd_draw_indirect(commands, draws.buffer, 0, 2, 20) };
        },
    );
    assert_eq!(cell(&pixels, 0, 0), [0.0, 0.0, 0.0, 1.0]);
    assert_eq!(cell(&pixels, 2, 1), [2.0, 2.0, 1.0, 1.0]);
    assert_eq!(cell(&pixels, 3, 3), [3.0, 2.0, 1.0, 1.0]);
    let pixels = canvas.draw_of(
        &cells(None),
        places.as_flattened(),
        |device, commands, _| {
            let (draws, one) = (draws.buffer, one.buffer);
            // SAFETY: see the crate.
            unsafe { device.cmd_draw_indirect_count(commands, draws, 0, one, 0, 2, 20) };
        },
    );
    assert_eq!(cell(&pixels, 0, 0), [0.0, 0.0, 0.0, 1.0]);
    assert_eq!(cell(&pixels, 2, 1), CLEAR);
    let pixels = canvas.draw_of(
        &cells(None),
        places.as_flattened(),
        |device, commands, _| {
            // SAFETY: see the crate.
            unsafe {
                device.cmd_bind_index_buffer(commands, indices.buffer, 0, vk::IndexType::UINT16);
                device.cmd_draw_indexed_indirect(commands, indexed.buffer, 0, 1, 20);
            }
        },
    );
    assert_eq!(cell(&pixels, 3, 3), [3.0, 3.0, 0.0, 1.0]);
    for buffer in [draws, one, indices, indexed] {
        gpu.free_buffer(buffer);
    }
}

#[test]
fn two_attachments_are_written_and_masked() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let other = gpu.image(FORMAT, WIDTH, HEIGHT);
    let mut request = Request::default().with_fragment(spirv!("two_targets.frag"));
    request.formats = vec![FORMAT; 2];
    request.blend = vec![
        replace(),
        replace().color_write_mask(vk::ColorComponentFlags::G),
    ];
    let made = request.create(gpu).unwrap();
    let vertices = gpu.buffer_of(everything(RED).as_flattened());
    canvas.pass(&[canvas.image, other], |device, commands| {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, made.pipeline);
            device.cmd_bind_vertex_buffers(commands, 0, &[vertices.buffer], &[0]);
            device.cmd_draw(commands, 3, 1, 0, 0);
        }
    });
    assert_eq!(count(&canvas.pixels(), RED), PIXELS);
    let masked = [CLEAR[0], 1.0, CLEAR[2], CLEAR[3]];
    assert_eq!(count(&gpu.read_image(other, 16), masked), PIXELS);
    gpu.free_image(other);
    gpu.free_buffer(vertices);
    made.destroy(gpu);
}

#[test]
fn two_sources_are_blended() {
    let canvas = Canvas::new();
    let mut request = Request::default().with_fragment(spirv!("two_sources.frag"));
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
    assert_close(
        at(&pixels, (5, 5)),
        [blend(0.5), blend(0.25), blend(0.125), 0.5],
    );
}

#[test]
fn a_logic_operation_works_on_bits() {
    let canvas = Canvas::of(vk::Format::R8G8B8A8_UNORM);
    let request = Request {
        logic_op: Some(vk::LogicOp::XOR),
        formats: vec![vk::Format::R8G8B8A8_UNORM],
        ..Request::default()
    };
    let made = request.create(&canvas.gpu).unwrap();
    let color = [15.0 / 255.0, 1.0, 0.0, 51.0 / 255.0];
    let vertices = canvas.gpu.buffer_of(everything(color).as_flattened());
    canvas.pass(&[canvas.image], |device, commands| {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, made.pipeline);
            device.cmd_bind_vertex_buffers(commands, 0, &[vertices.buffer], &[0]);
            device.cmd_draw(commands, 3, 1, 0, 0);
        }
    });
    let clear = 64u8;
    let expected = [clear ^ 15, clear ^ 255, clear, 51];
    let texels: Vec<[u8; 4]> = canvas.gpu.read_image(canvas.image, 4);
    assert!(
        texels.iter().all(|texel| *texel == expected),
        "{:?}",
        texels[0]
    );
    canvas.gpu.free_buffer(vertices);
    made.destroy(&canvas.gpu);
}

#[test]
fn the_provoking_vertex_is_chosen() {
    let canvas = Canvas::new();
    let mut vertices = everything(RED);
    vertices[2] = vertex(-1.0, 3.0, BLUE);
    let mut request = Request::default().with_fragment(spirv!("flat.frag"));
    assert_eq!(
        count(&canvas.draw_vertices(&request, &vertices), RED),
        PIXELS
    );
    request.provoking_last = true;
    assert_eq!(
        count(&canvas.draw_vertices(&request, &vertices), BLUE),
        PIXELS
    );
}

#[test]
fn points_have_the_size_that_the_shader_says() {
    let canvas = Canvas::new();
    let request = Request {
        topology: vk::PrimitiveTopology::POINT_LIST,
        ..Request::default()
    };
    // The corner of four pixels in the middle.
    let pixels = canvas.draw_vertices(&request, &[vertex(0.0, 0.0, RED)]);
    assert_eq!(count(&pixels, RED), 16);
    assert_eq!(at(&pixels, (WIDTH / 2 - 2, HEIGHT / 2 - 2)), RED);
    assert_eq!(at(&pixels, (WIDTH / 2 + 1, HEIGHT / 2 + 1)), RED);
}

#[test]
fn primitives_go_to_their_viewport_and_layer() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let layers = layered_image(gpu, 2);
    let request = Request {
        shaders: vec![
            vertex_shader(spirv!("placed.vert")),
            Request::default().shaders[1].clone(),
        ],
        bindings: vec![],
        attributes: vec![],
        viewports: 2,
        ..Request::default()
    };
    let made = request.create(gpu).unwrap();
    let half = WIDTH / 2;
    gpu.run(|device, commands| {
        canvas.record_pass(device, commands, &[layers], 2, || {
            let viewport = |x: u32| vk::Viewport {
                x: x as f32,
                y: 0.0,
                width: half as f32,
                height: HEIGHT as f32,
                min_depth: 0.0,
                max_depth: 1.0,
            };
            let whole = vk::Rect2D {
                offset: vk::Offset2D::default(),
                extent: layers.extent,
            };
            // SAFETY: see the crate.
            unsafe {
                device.cmd_set_viewport(commands, 0, &[viewport(0), viewport(half)]);
                device.cmd_set_scissor(commands, 0, &[whole, whole]);
                device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, made.pipeline);
                device.cmd_draw(commands, 3, 4, 0, 0);
            }
        });
    });
    for layer in 0..2 {
        let pixels = read_layer(gpu, layers, layer);
        for side in 0..2 {
            let expected = [(layer * 2 + side + 1) as f32; 4];
            assert_eq!(
                at(&pixels, (side * half + 3, 7)),
                expected,
                "{layer} {side}"
            );
        }
    }
    gpu.free_image(layers);
    made.destroy(gpu);
}

#[test]
fn textures_uniforms_and_specialization_constants_reach_the_fragment_stage() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let texture = gpu.image(vk::Format::R8G8B8A8_UNORM, 2, 1);
    let texels = gpu.buffer_of(&[[255u8, 0, 0, 255], [0, 255, 51, 255]]);
    let tint = gpu.buffer_of(&[0.5f32, 0.25, 1.0, 1.0]);
    let sampler = canvas.nearest_sampler();
    let set = canvas.tint_set(texture, sampler, tint);
    write_image(gpu, texture, texels);
    let mut request = Request::default().with_fragment(spirv!("tinted.frag"));
    request.shaders[1].constants = vec![(3, 2.0)];
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
    set.destroy(gpu);
    // SAFETY: see the crate.
    unsafe { gpu.device.destroy_sampler(sampler, None) };
    gpu.free_image(texture);
    gpu.free_buffer(texels);
    gpu.free_buffer(tint);
    let told = gpu.take_messages().concat();
    assert!(told.contains("location 7"), "{told}");
}

#[test]
fn both_stages_store() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let counts = gpu.buffer_of(&[0u32; 5]);
    let set = canvas.storage_set(counts);
    let request = Request {
        shaders: vec![
            vertex_shader(spirv!("stores.vert")),
            fragment_shader(spirv!("stores.frag")),
        ],
        set_layouts: vec![set.layout],
        ..Request::default()
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
    let counted: Vec<u32> = gpu.read(counts);
    assert_eq!(counted, [3, PIXELS as u32, 7, 8, 9]);
    set.destroy(gpu);
    gpu.free_buffer(counts);
}

#[test]
fn queries_count_samples_and_invocations() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let device = &gpu.device;
    let statistics = vk::QueryPipelineStatisticFlags::INPUT_ASSEMBLY_VERTICES
        | vk::QueryPipelineStatisticFlags::INPUT_ASSEMBLY_PRIMITIVES
        | vk::QueryPipelineStatisticFlags::VERTEX_SHADER_INVOCATIONS
        | vk::QueryPipelineStatisticFlags::CLIPPING_INVOCATIONS
        | vk::QueryPipelineStatisticFlags::FRAGMENT_SHADER_INVOCATIONS
        | vk::QueryPipelineStatisticFlags::COMPUTE_SHADER_INVOCATIONS;
    let pool = |info: vk::QueryPoolCreateInfo| {
        // SAFETY: see the crate.
        unsafe {
            device
                .create_query_pool(&info.query_count(1), None)
                .unwrap()
        }
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
    let mut vertices = everything(RED).to_vec();
    // Behind the eye.
    vertices.extend(everything(GREEN).map(|[x, y, z, _, r, g, b, a]| [x, y, z, -1.0, r, g, b, a]));
    canvas.draw(&Request::default(), &vertices, |device, commands, _| {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_begin_query(commands, occlusion, 0, vk::QueryControlFlags::PRECISE);
            device.cmd_begin_query(commands, counted, 0, vk::QueryControlFlags::empty());
            device.cmd_draw(commands, 6, 1, 0, 0);
            device.cmd_end_query(commands, counted, 0);
            device.cmd_end_query(commands, occlusion, 0);
            device.cmd_draw(commands, 3, 1, 0, 0);
        }
    });
    let (mut samples, mut statistics) = ([0u32; 1], [[0u64; 6]; 1]);
    let flags = vk::QueryResultFlags::WAIT;
    // SAFETY: see the crate.
    unsafe {
        device
            .get_query_pool_results(occlusion, 0, &mut samples, flags)
            .unwrap();
        let flags = flags | vk::QueryResultFlags::TYPE_64;
        device
            .get_query_pool_results(counted, 0, &mut statistics, flags)
            .unwrap();
        device.destroy_query_pool(occlusion, None);
        device.destroy_query_pool(counted, None);
    }
    assert_eq!(samples, [PIXELS as u32]);
    assert_eq!(statistics, [[6, 2, 6, 2, PIXELS as u64, 0]]);
}

#[test]
fn a_secondary_command_buffer_draws_in_its_primarys_pass() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let made = Request::default().create(gpu).unwrap();
    let vertices = gpu.buffer_of(everything(BLUE).as_flattened());
    let secondary = gpu.command_buffer_of(vk::CommandBufferLevel::SECONDARY);
    let formats = [FORMAT];
    let mut rendering = vk::CommandBufferInheritanceRenderingInfo::default()
        .color_attachment_formats(&formats)
        .rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let inheritance = vk::CommandBufferInheritanceInfo::default().push_next(&mut rendering);
    let begin = vk::CommandBufferBeginInfo::default()
        .flags(vk::CommandBufferUsageFlags::RENDER_PASS_CONTINUE)
        .inheritance_info(&inheritance);
    let device = &gpu.device;
    // SAFETY: see the crate.
    unsafe {
        device.begin_command_buffer(secondary, &begin).unwrap();
        crate::scene::set_viewport(device, secondary, canvas.image);
        device.cmd_bind_pipeline(secondary, vk::PipelineBindPoint::GRAPHICS, made.pipeline);
        device.cmd_bind_vertex_buffers(secondary, 0, &[vertices.buffer], &[0]);
        device.cmd_draw(secondary, 3, 1, 0, 0);
        device.end_command_buffer(secondary).unwrap();
    }
    canvas.pass(&[canvas.image], |device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_execute_commands(commands, &[secondary]) };
    });
    assert_eq!(count(&canvas.pixels(), BLUE), PIXELS);
    gpu.free_buffer(vertices);
    made.destroy(gpu);
}

#[test]
fn a_draw_without_what_its_pipeline_needs_draws_nothing_and_says_so() {
    let canvas = Canvas::new();
    let request = Request::default().with_dynamic(vk::DynamicState::CULL_MODE);
    let pixels = canvas.draw_vertices(&request, &everything(RED));
    assert_eq!(count(&pixels, CLEAR), PIXELS);
    let told = canvas.gpu.take_messages().concat();
    assert!(told.contains("CULL_MODE"), "{told}");
    let mut request = Request::default();
    request.attributes[1].binding = 3;
    request.bindings.push(vk::VertexInputBindingDescription {
        binding: 3,
        ..request.bindings[0]
    });
    let pixels = canvas.draw_vertices(&request, &everything(RED));
    assert_eq!(count(&pixels, CLEAR), PIXELS);
    let told = canvas.gpu.take_messages().concat();
    assert!(told.contains("binding 3"), "{told}");
}

#[test]
fn depth_decides_what_is_seen() {
    let canvas = Canvas::with_depth();
    let request = Request {
        depth_format: DEPTH_FORMAT,
        depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(true)
            .depth_write_enable(true)
            .depth_compare_op(vk::CompareOp::LESS),
        ..Request::default()
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

#[test]
fn several_samples_make_smooth_edges() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let samples = sampled_image(gpu, vk::SampleCountFlags::TYPE_4);
    let request = Request {
        multisample: vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_4),
        ..Request::default()
    };
    let made = request.create(gpu).unwrap();
    let vertices = [
        vertex(-1.0, -1.0, RED),
        vertex(1.0, -1.0, RED),
        vertex(-1.0, 1.0, RED),
    ];
    let vertices = gpu.buffer_of(vertices.as_flattened());
    gpu.run(|device, commands| {
        canvas.record_resolving_pass(device, commands, samples, || {
            // SAFETY: see the crate.
            unsafe {
                device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, made.pipeline);
                device.cmd_bind_vertex_buffers(commands, 0, &[vertices.buffer], &[0]);
                device.cmd_draw(commands, 3, 1, 0, 0);
            }
        });
    });
    let pixels = canvas.pixels();
    let (inside, outside) = (count(&pixels, RED), count(&pixels, CLEAR));
    assert_eq!(at(&pixels, (0, 0)), RED);
    let edge = PIXELS - inside - outside;
    assert!(
        (HEIGHT as usize..3 * WIDTH as usize).contains(&edge),
        "{edge}"
    );
    for pixel in &pixels {
        let covered = (pixel[0] - CLEAR[0]) / (RED[0] - CLEAR[0]) * 4.0;
        assert!((covered - covered.round()).abs() < 1e-5, "{pixel:?}");
    }
    gpu.free_buffer(vertices);
    gpu.free_image(samples);
    made.destroy(gpu);
}

#[test]
fn polygons_may_be_drawn_as_lines_or_points() {
    let canvas = Canvas::new();
    let drawn = |mode| {
        let mut request = Request::default();
        request.raster.polygon_mode = mode;
        let vertices = [
            vertex(-0.5, -0.5, RED),
            vertex(0.5, -0.5, RED),
            vertex(-0.5, 0.5, RED),
        ];
        count(&canvas.draw_vertices(&request, &vertices), RED)
    };
    let fill = drawn(vk::PolygonMode::FILL);
    let line = drawn(vk::PolygonMode::LINE);
    // Three points of four by four pixels.
    assert_eq!(drawn(vk::PolygonMode::POINT), 3 * 16);
    assert!(fill > 300 && (60..120).contains(&line), "{fill} {line}");
}

#[test]
fn depth_is_clipped_or_clamped() {
    let canvas = Canvas::with_depth();
    let mut request = Request {
        depth_format: DEPTH_FORMAT,
        depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(true)
            .depth_compare_op(vk::CompareOp::GREATER),
        ..Request::default()
    };
    let deep = everything(RED).map(|[x, y, ..]| deep_vertex([x, y, 1.5], RED));
    assert_eq!(count(&canvas.draw_vertices(&request, &deep), CLEAR), PIXELS);
    request.raster = request.raster.depth_clamp_enable(true);
    assert_eq!(count(&canvas.draw_vertices(&request, &deep), RED), PIXELS);
}

#[test]
fn shaders_clip_and_cull() {
    let canvas = Canvas::new();
    let mut request = Request::default();
    request.shaders[0] = vertex_shader(spirv!("clipped.vert"));
    let pixels = canvas.draw_vertices(&request, &everything(RED));
    assert_eq!(count(&pixels, RED), PIXELS / 2);
    assert_eq!(at(&pixels, (WIDTH / 2 - 1, 9)), CLEAR);
    assert_eq!(at(&pixels, (WIDTH / 2, 9)), RED);
    // One vertex inside keeps the primitive.
    let mut vertices = everything(BLUE);
    assert_eq!(
        count(&canvas.draw_vertices(&request, &vertices), CLEAR),
        PIXELS
    );
    vertices[1] = vertex(3.0, -1.0, RED);
    assert_eq!(
        count(&canvas.draw_vertices(&request, &vertices), CLEAR),
        PIXELS / 2
    );
}

#[test]
fn demoted_invocations_write_nothing_and_help() {
    let canvas = Canvas::new();
    let request = Request::default().with_fragment(spirv!("demoted.frag"));
    let pixels = canvas.draw_vertices(&request, &everything(BLUE));
    let expected = [1.0, 0.0, 1.0, 0.25];
    assert_eq!(count(&pixels, expected), PIXELS / 2);
    assert_eq!(at(&pixels, (6, 5)), expected);
    assert_eq!(at(&pixels, (7, 5)), CLEAR);
}

/// Draws everything on four samples and resolves them.
fn resolved(canvas: &Canvas, request: &Request, color: [f32; 4]) -> [f32; 4] {
    let gpu = &canvas.gpu;
    let samples = sampled_image(gpu, vk::SampleCountFlags::TYPE_4);
    let made = request.create(gpu).unwrap();
    let vertices = gpu.buffer_of(everything(color).as_flattened());
    gpu.run(|device, commands| {
        canvas.record_resolving_pass(device, commands, samples, || {
            // SAFETY: see the crate.
            unsafe {
                device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, made.pipeline);
                device.cmd_bind_vertex_buffers(commands, 0, &[vertices.buffer], &[0]);
                device.cmd_draw(commands, 3, 1, 0, 0);
            }
        });
    });
    gpu.free_buffer(vertices);
    gpu.free_image(samples);
    made.destroy(gpu);
    let pixels = canvas.pixels();
    assert_eq!(count(&pixels, pixels[0]), PIXELS);
    pixels[0]
}

#[test]
fn samples_are_shaded_masked_and_covered() {
    let canvas = Canvas::new();
    let four = vk::PipelineMultisampleStateCreateInfo::default()
        .rasterization_samples(vk::SampleCountFlags::TYPE_4);
    let request = Request {
        multisample: four,
        ..Request::default()
    };
    assert_close(resolved(&canvas, &request, RED), RED);
    let each = request.clone().with_fragment(spirv!("per_sample.frag"));
    assert_close(resolved(&canvas, &each, RED), [15.0 / 4.0, 0.0, 0.0, 1.0]);
    let mask = [0b0101u32];
    let masked = Request {
        multisample: vk::PipelineMultisampleStateCreateInfo {
            p_sample_mask: mask.as_ptr(),
            ..four
        },
        ..each
    };
    let clear = CLEAR[0] * 0.5;
    assert_close(
        resolved(&canvas, &masked, RED),
        [5.0 / 4.0 + clear, clear, clear, 0.5],
    );
    // Alpha of one half covers two samples, and becomes one there.
    let covering = Request {
        multisample: four
            .alpha_to_coverage_enable(true)
            .alpha_to_one_enable(true),
        ..Request::default()
    };
    let expected = [clear, 0.5 + clear, clear, 0.5];
    assert_close(resolved(&canvas, &covering, GREEN), expected);
}
