//! Draws of points, lines and triangles.

use ash::vk;
use gaurast_testkit::canvas::{
    BLUE, CLEAR, Canvas, DEPTH_FORMAT, GREEN, PIXELS, RED, Vertex, colored, count, deep_vertex, everything,
    layered_image, read_layer, vertex,
};
use gaurast_testkit::scene::{HEIGHT, WIDTH, assert_close, at, extent};
use gaurast_testkit::shader::spirv;
use gaurast_testkit::{Buffer, Graphics, Pipeline, Shader};

#[gaurast_runner::test]
fn a_triangle_covers_what_it_covers() {
    let canvas = Canvas::new();
    let vertices = [vertex(-1.0, -1.0, RED), vertex(1.0, -1.0, RED), vertex(-1.0, 1.0, RED)];
    let pixels = canvas.draw_vertices(&colored(), &vertices);
    assert_eq!(at(&pixels, (0, 0)), RED);
    assert_eq!(at(&pixels, (WIDTH - 1, HEIGHT - 1)), CLEAR);
    // The diagonal passes only through the pixel centres at which the ratio of the sides is exact.
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

#[gaurast_runner::test]
fn colours_are_interpolated() {
    let canvas = Canvas::new();
    let color = |x: f32, y: f32| [x, y, 0.5, 1.0];
    let vertices =
        [vertex(-1.0, -1.0, color(0.0, 0.0)), vertex(3.0, -1.0, color(2.0, 0.0)), vertex(-1.0, 3.0, color(0.0, 2.0))];
    let pixels = canvas.draw_vertices(&colored(), &vertices);
    for (x, y) in [(0, 0), (17, 31), (63, 47), (40, 3)] {
        let (s, t) = (x as f32 + 0.5, y as f32 + 0.5);
        let expected = [s / WIDTH as f32, t / HEIGHT as f32, 0.5, 1.0];
        assert_close(at(&pixels, (x, y)), expected);
    }
}

#[gaurast_runner::test]
fn indices_choose_vertices() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let mut vertices = vec![vertex(0.0, 0.0, BLUE); 2];
    vertices.extend(everything(GREEN));
    let words = Buffer::of(gpu, &[77u32, 0, 1, 2]);
    let halves = Buffer::of(gpu, &[77u16, 0, 1, 2]);
    let bytes = Buffer::of(gpu, &[77u8, 0, 1, 2]);
    for (buffer, ty) in
        [(words, vk::IndexType::UINT32), (halves, vk::IndexType::UINT16), (bytes, vk::IndexType::UINT8_KHR)]
    {
        let pixels = canvas.draw(&colored(), &vertices, |device, commands, _| {
            // SAFETY: see the crate.
            unsafe {
                device.cmd_bind_index_buffer(commands, buffer.raw, 0, ty);
                device.cmd_draw_indexed(commands, 3, 1, 1, 2, 0);
            }
        });
        assert_eq!(count(&pixels, GREEN), PIXELS, "{ty:?}");
    }
}

/// A pipeline that draws a quad per instance, each in a cell, with `numbered.vert`.
fn cells(divisor: Option<u32>) -> Graphics<'static> {
    Graphics {
        shaders: vec![Shader::vertex(spirv("numbered.vert")), colored().shaders[1].clone()],
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
            .map(|divisor| vk::VertexInputBindingDivisorDescriptionKHR { binding: 0, divisor })
            .into_iter()
            .collect(),
        topology: vk::PrimitiveTopology::TRIANGLE_STRIP,
        ..colored()
    }
}

/// The pixel in the middle of a cell of four by four.
fn cell(pixels: &[[f32; 4]], x: u32, y: u32) -> [f32; 4] {
    at(pixels, (x * WIDTH / 4 + 8, y * HEIGHT / 4 + 6))
}

#[gaurast_runner::test]
fn instances_are_numbered_and_have_attributes() {
    let canvas = Canvas::new();
    let places = [[0u8, 0], [1, 0], [2, 1], [3, 3]];
    let draw = |device: &ash::Device, commands, _: &Pipeline| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 4, 3, 0, 1) };
    };
    let pixels = canvas.draw_of(&cells(None), places.as_flattened(), draw);
    assert_eq!(cell(&pixels, 0, 0), CLEAR);
    assert_eq!(cell(&pixels, 1, 0), [1.0, 1.0, 0.0, 1.0]);
    assert_eq!(cell(&pixels, 2, 1), [2.0, 1.0, 0.0, 1.0]);
    assert_eq!(cell(&pixels, 3, 3), [3.0, 1.0, 0.0, 1.0]);
    // The attribute advances every second instance; the first instance's index does not change that.
    let pixels = canvas.draw_of(&cells(Some(2)), places.as_flattened(), draw);
    assert_eq!(cell(&pixels, 1, 0), [2.0, 1.0, 0.0, 1.0]);
    assert_eq!(cell(&pixels, 2, 1), [3.0, 1.0, 0.0, 1.0]);
    assert_eq!(cell(&pixels, 3, 3), CLEAR);
    let pixels = canvas.draw_of(&cells(Some(0)), places.as_flattened(), draw);
    assert_eq!(cell(&pixels, 1, 0), [3.0, 1.0, 0.0, 1.0]);
    assert_eq!(cell(&pixels, 2, 1), CLEAR);
}

#[gaurast_runner::test]
fn indirect_draws_are_numbered() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let places = [[0u8, 0], [1, 0], [2, 1], [3, 3]];
    // Vertices, instances, first vertex, first instance, and a word that no draw reads.
    let draws = [[4u32, 1, 0, 0, 9], [4, 2, 8, 2, 9]];
    let draws = Buffer::of(gpu, draws.as_flattened());
    let one = Buffer::of(gpu, &[1u32]);
    let indices = Buffer::of(gpu, &[0u16, 1, 2, 3]);
    let indexed = Buffer::of(gpu, &[4u32, 1, 0, 5, 3]);
    let pixels = canvas.draw_of(&cells(None), places.as_flattened(), |device, commands, _| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw_indirect(commands, draws.raw, 0, 2, 20) };
    });
    assert_eq!(cell(&pixels, 0, 0), [0.0, 0.0, 0.0, 1.0]);
    assert_eq!(cell(&pixels, 2, 1), [2.0, 2.0, 1.0, 1.0]);
    assert_eq!(cell(&pixels, 3, 3), [3.0, 2.0, 1.0, 1.0]);
    let pixels = canvas.draw_of(&cells(None), places.as_flattened(), |device, commands, _| {
        let (draws, one) = (draws.raw, one.raw);
        // SAFETY: see the crate.
        unsafe { device.cmd_draw_indirect_count(commands, draws, 0, one, 0, 2, 20) };
    });
    assert_eq!(cell(&pixels, 0, 0), [0.0, 0.0, 0.0, 1.0]);
    assert_eq!(cell(&pixels, 2, 1), CLEAR);
    let pixels = canvas.draw_of(&cells(None), places.as_flattened(), |device, commands, _| {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_index_buffer(commands, indices.raw, 0, vk::IndexType::UINT16);
            device.cmd_draw_indexed_indirect(commands, indexed.raw, 0, 1, 20);
        }
    });
    assert_eq!(cell(&pixels, 3, 3), [3.0, 3.0, 0.0, 1.0]);
}

#[gaurast_runner::test]
fn the_provoking_vertex_is_chosen() {
    let canvas = Canvas::new();
    let mut vertices = everything(RED);
    vertices[2] = vertex(-1.0, 3.0, BLUE);
    let mut request = colored().with_shader(Shader::fragment(spirv("flat.frag")));
    assert_eq!(count(&canvas.draw_vertices(&request, &vertices), RED), PIXELS);
    request.provoking_last = true;
    assert_eq!(count(&canvas.draw_vertices(&request, &vertices), BLUE), PIXELS);
}

/// The provoking vertices of each topology's primitives, as in "Primitive Topologies" of the specification: one vertex
/// for each primitive, with the first-vertex and the last-vertex convention.
const PROVOKING: [(vk::PrimitiveTopology, &[usize], &[usize]); 6] = [
    (vk::PrimitiveTopology::POINT_LIST, &[0, 1, 2, 3, 4, 5], &[0, 1, 2, 3, 4, 5]),
    (vk::PrimitiveTopology::LINE_LIST, &[0, 2, 4], &[1, 3, 5]),
    (vk::PrimitiveTopology::LINE_STRIP, &[0, 1, 2, 3, 4], &[1, 2, 3, 4, 5]),
    (vk::PrimitiveTopology::TRIANGLE_LIST, &[0, 3], &[2, 5]),
    (vk::PrimitiveTopology::TRIANGLE_STRIP, &[0, 1, 2, 3], &[2, 3, 4, 5]),
    (vk::PrimitiveTopology::TRIANGLE_FAN, &[1, 2, 3, 4], &[2, 3, 4, 5]),
];

/// The corners of a hexagon, which make visible primitives in every topology.
fn hexagon() -> [Vertex; 6] {
    std::array::from_fn(|number| {
        let (sine, cosine) = (number as f32 * std::f32::consts::FRAC_PI_3).sin_cos();
        let color = [number as f32 + 1.0, 0.0, 0.0, 1.0];
        vertex(0.9 * cosine, 0.9 * sine, color)
    })
}

#[gaurast_runner::test]
fn each_primitive_has_its_provoking_vertex() {
    let canvas = Canvas::new();
    let vertices = hexagon();
    for (topology, first, last) in PROVOKING {
        for (provoking_last, expected) in [(false, first), (true, last)] {
            let request =
                Graphics { topology, provoking_last, ..colored() }.with_shader(Shader::fragment(spirv("flat.frag")));
            // Later primitives hide earlier ones, so each one is read before the next is drawn.
            let seen: Vec<usize> = (0..expected.len())
                .map(|primitive| {
                    let pixels = canvas.draw(&request, &vertices, |device, commands, _| {
                        // SAFETY: see the crate.
                        unsafe {
                            device.cmd_draw(commands, vertices_to(topology, primitive), 1, 0, 0);
                        };
                    });
                    let before: Vec<f32> = expected[..primitive].iter().map(|&vertex| vertex as f32 + 1.0).collect();
                    let new = pixels
                        .iter()
                        .find(|pixel| **pixel != CLEAR && !before.contains(&pixel[0]))
                        .unwrap_or_else(|| panic!("{topology:?}: primitive {primitive}"));
                    new[0] as usize - 1
                })
                .collect();
            assert_eq!(seen, expected, "{topology:?}, last: {provoking_last}");
        }
    }
}

/// The number of vertices up to the end of a primitive.
fn vertices_to(topology: vk::PrimitiveTopology, primitive: usize) -> u32 {
    let count = match topology {
        vk::PrimitiveTopology::POINT_LIST => primitive + 1,
        vk::PrimitiveTopology::LINE_LIST => 2 * primitive + 2,
        vk::PrimitiveTopology::LINE_STRIP => primitive + 2,
        vk::PrimitiveTopology::TRIANGLE_LIST => 3 * primitive + 3,
        _ => primitive + 3,
    };
    count as u32
}

#[gaurast_runner::test]
fn points_have_the_size_that_the_shader_says() {
    let canvas = Canvas::new();
    let request = Graphics { topology: vk::PrimitiveTopology::POINT_LIST, ..colored() };
    // The common corner of the four pixels in the middle.
    let pixels = canvas.draw_vertices(&request, &[vertex(0.0, 0.0, RED)]);
    assert_eq!(count(&pixels, RED), 16);
    assert_eq!(at(&pixels, (WIDTH / 2 - 2, HEIGHT / 2 - 2)), RED);
    assert_eq!(at(&pixels, (WIDTH / 2 + 1, HEIGHT / 2 + 1)), RED);
}

#[gaurast_runner::test]
fn primitives_go_to_their_viewport_and_layer() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let layers = layered_image(gpu, 2);
    let request = Graphics {
        shaders: vec![Shader::vertex(spirv("placed.vert")), colored().shaders[1].clone()],
        bindings: vec![],
        attributes: vec![],
        viewports: 2,
        ..colored()
    };
    let made = request.create(gpu).unwrap();
    let half = WIDTH / 2;
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        canvas.record_pass(device, commands, &[&layers], 2, || {
            let viewport = |x: u32| vk::Viewport {
                x: x as f32,
                y: 0.0,
                width: half as f32,
                height: HEIGHT as f32,
                min_depth: 0.0,
                max_depth: 1.0,
            };
            let whole = vk::Rect2D { offset: vk::Offset2D::default(), extent: extent(&layers) };
            // SAFETY: see the crate.
            unsafe {
                device.cmd_set_viewport(commands, 0, &[viewport(0), viewport(half)]);
                device.cmd_set_scissor(commands, 0, &[whole, whole]);
                device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, made.raw);
                device.cmd_draw(commands, 3, 4, 0, 0);
            }
        });
    });
    for layer in 0..2 {
        let pixels = read_layer(&layers, layer);
        for side in 0..2 {
            let expected = [(layer * 2 + side + 1) as f32; 4];
            assert_eq!(at(&pixels, (side * half + 3, 7)), expected, "{layer} {side}");
        }
    }
}

#[gaurast_runner::test]
fn a_dynamic_state_that_was_not_set_has_a_default() {
    let canvas = Canvas::new();
    let request = colored().with_dynamic(vk::DynamicState::CULL_MODE);
    let pixels = canvas.draw_vertices(&request, &everything(RED));
    assert_eq!(count(&pixels, RED), PIXELS);
    let told = canvas.gpu.message_texts().concat();
    assert!(told.contains("CULL_MODE is dynamic and was not set"), "{told}");
}

#[gaurast_runner::test]
fn a_draw_without_what_its_pipeline_needs_draws_nothing_and_says_so() {
    let canvas = Canvas::new();
    let mut request = colored();
    request.attributes[1].binding = 3;
    request.bindings.push(vk::VertexInputBindingDescription { binding: 3, ..request.bindings[0] });
    let pixels = canvas.draw_vertices(&request, &everything(RED));
    assert_eq!(count(&pixels, CLEAR), PIXELS);
    let told = canvas.gpu.message_texts().concat();
    assert!(told.contains("binding 3"), "{told}");
}

#[gaurast_runner::test]
fn polygons_may_be_drawn_as_lines_or_points() {
    let canvas = Canvas::new();
    let drawn = |mode| {
        let mut request = colored();
        request.raster.polygon_mode = mode;
        let vertices = [vertex(-0.5, -0.5, RED), vertex(0.5, -0.5, RED), vertex(-0.5, 0.5, RED)];
        count(&canvas.draw_vertices(&request, &vertices), RED)
    };
    let fill = drawn(vk::PolygonMode::FILL);
    let line = drawn(vk::PolygonMode::LINE);
    // Three points of four by four pixels.
    assert_eq!(drawn(vk::PolygonMode::POINT), 3 * 16);
    assert!(fill > 300 && (60..120).contains(&line), "{fill} {line}");
}

#[gaurast_runner::test]
fn depth_is_clipped_or_clamped() {
    let canvas = Canvas::with_depth();
    let mut request = Graphics {
        depth_format: DEPTH_FORMAT,
        depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(true)
            .depth_compare_op(vk::CompareOp::GREATER),
        ..colored()
    };
    let deep = everything(RED).map(|[x, y, ..]| deep_vertex([x, y, 1.5], RED));
    assert_eq!(count(&canvas.draw_vertices(&request, &deep), CLEAR), PIXELS);
    request.raster = request.raster.depth_clamp_enable(true);
    assert_eq!(count(&canvas.draw_vertices(&request, &deep), RED), PIXELS);
}

#[gaurast_runner::test]
fn shaders_clip_and_cull() {
    let canvas = Canvas::new();
    let mut request = colored();
    request.shaders[0] = Shader::vertex(spirv("clipped.vert"));
    let pixels = canvas.draw_vertices(&request, &everything(RED));
    assert_eq!(count(&pixels, RED), PIXELS / 2);
    assert_eq!(at(&pixels, (WIDTH / 2 - 1, 9)), CLEAR);
    assert_eq!(at(&pixels, (WIDTH / 2, 9)), RED);
    // One vertex inside is enough to keep the primitive.
    let mut vertices = everything(BLUE);
    assert_eq!(count(&canvas.draw_vertices(&request, &vertices), CLEAR), PIXELS);
    vertices[1] = vertex(3.0, -1.0, RED);
    assert_eq!(count(&canvas.draw_vertices(&request, &vertices), CLEAR), PIXELS / 2);
}
