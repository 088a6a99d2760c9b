//! Every dynamic state has the same effect as the static state, and has an effect.

use ash::vk;
use gaurast_testkit::canvas::{Canvas, DEPTH_FORMAT, GREEN, RED, Vertex, colored, deep_vertex, vertex};
use gaurast_testkit::scene::{HEIGHT, WIDTH, replace};
use gaurast_testkit::{Buffer, Graphics};
use vk::DynamicState as S;

const BOTH: vk::StencilFaceFlags = vk::StencilFaceFlags::FRONT_AND_BACK;

/// A state with two settings, false and true: in a pipeline, and set by a command buffer.
struct Case {
    state: S,
    /// The drawn vertices.
    vertices: Vec<Vertex>,
    /// The options that are the same for both settings.
    base: fn(&mut Graphics<'_>),
    fixed: fn(&mut Graphics<'_>, bool),
    dynamic: fn(&ash::Device, vk::CommandBuffer, bool),
}

/// A small triangle near the upper left corner, and one near the lower right corner that overlaps it and has the
/// opposite winding.
fn two_triangles(depths: [f32; 2]) -> Vec<Vertex> {
    let [a, b] = depths;
    vec![
        deep_vertex([-0.9, -0.9, a], RED),
        deep_vertex([0.9, -0.9, a], RED),
        deep_vertex([-0.9, 0.9, a], RED),
        deep_vertex([0.9, 0.9, b], GREEN),
        deep_vertex([0.9, -0.9, b], GREEN),
        deep_vertex([-0.5, 0.5, b], GREEN),
        deep_vertex([0.5, -0.5, b], GREEN),
        deep_vertex([-0.9, -0.5, b], GREEN),
        deep_vertex([0.5, 0.9, b], GREEN),
    ]
}

fn depth_test(request: &mut Graphics<'_>) {
    request.depth_format = DEPTH_FORMAT;
    request.depth_stencil =
        request.depth_stencil.depth_test_enable(true).depth_write_enable(true).depth_compare_op(vk::CompareOp::LESS);
}

/// Draws where the stencil is 0, and increments it.
fn stencil_test(request: &mut Graphics<'_>) {
    request.depth_format = DEPTH_FORMAT;
    request.depth_stencil = request.depth_stencil.stencil_test_enable(true);
    set_faces(request, |face| {
        *face = vk::StencilOpState {
            fail_op: vk::StencilOp::KEEP,
            pass_op: vk::StencilOp::INCREMENT_AND_CLAMP,
            depth_fail_op: vk::StencilOp::KEEP,
            compare_op: vk::CompareOp::EQUAL,
            compare_mask: 0xFF,
            write_mask: 0xFF,
            reference: 0,
        };
    });
}

fn set_faces(request: &mut Graphics<'_>, set: impl Fn(&mut vk::StencilOpState)) {
    set(&mut request.depth_stencil.front);
    set(&mut request.depth_stencil.back);
}

fn strip(request: &mut Graphics<'_>) {
    request.topology = vk::PrimitiveTopology::TRIANGLE_STRIP;
}

fn lines(request: &mut Graphics<'_>) {
    request.topology = vk::PrimitiveTopology::LINE_LIST;
}

fn cull_back(request: &mut Graphics<'_>) {
    request.raster.cull_mode = vk::CullModeFlags::BACK;
}

/// A bias that moves depths of one half nearer by about a tenth.
fn biased(request: &mut Graphics<'_>) {
    depth_test(request);
    request.raster = request.raster.depth_bias_enable(true);
}

const BIAS: f32 = -1_000_000.0;

fn constant_blend(request: &mut Graphics<'_>) {
    request.blend = vec![
        replace()
            .blend_enable(true)
            .src_color_blend_factor(vk::BlendFactor::CONSTANT_COLOR)
            .dst_color_blend_factor(vk::BlendFactor::ZERO)
            .src_alpha_blend_factor(vk::BlendFactor::ONE),
    ];
}

fn bounds_test(request: &mut Graphics<'_>) {
    request.depth_format = DEPTH_FORMAT;
    request.depth_stencil = request.depth_stencil.depth_bounds_test_enable(true).max_depth_bounds(1.0);
}

/// Records a command that sets state. Its arguments may depend on the setting.
macro_rules! sets {
    ($on:pat => $command:ident($($argument:expr),* $(,)?)) => {
        |device, commands, $on| {
            // SAFETY: see the crate.
            unsafe { device.$command(commands, $($argument),*) }
        }
    };
}

fn cases() -> Vec<Case> {
    let flat = || two_triangles([0.3, 0.3]);
    let steps = || two_triangles([0.2, 0.4]);
    vec![
        Case {
            state: S::CULL_MODE,
            vertices: flat(),
            base: |_| {},
            fixed: |request, on| request.raster.cull_mode = culled(on),
            dynamic: sets!(on => cmd_set_cull_mode(culled(on))),
        },
        Case {
            state: S::FRONT_FACE,
            vertices: flat(),
            base: cull_back,
            fixed: |request, on| request.raster.front_face = face(on),
            dynamic: sets!(on => cmd_set_front_face(face(on))),
        },
        Case {
            state: S::PRIMITIVE_TOPOLOGY,
            vertices: flat(),
            base: |_| {},
            fixed: |request, on| request.topology = topology(on),
            dynamic: sets!(on => cmd_set_primitive_topology(topology(on))),
        },
        Case {
            state: S::PRIMITIVE_RESTART_ENABLE,
            vertices: flat(),
            base: strip,
            fixed: |request, on| request.restart = on,
            dynamic: sets!(on => cmd_set_primitive_restart_enable(on)),
        },
        Case {
            state: S::RASTERIZER_DISCARD_ENABLE,
            vertices: flat(),
            base: |_| {},
            fixed: |request, on| request.raster = request.raster.rasterizer_discard_enable(on),
            dynamic: sets!(on => cmd_set_rasterizer_discard_enable(on)),
        },
        Case {
            state: S::LINE_WIDTH,
            vertices: flat()[..4].to_vec(),
            base: lines,
            fixed: |request, on| request.raster.line_width = if on { 5.0 } else { 1.0 },
            dynamic: sets!(on => cmd_set_line_width(if on { 5.0 } else { 1.0 })),
        },
        Case {
            state: S::DEPTH_TEST_ENABLE,
            vertices: steps(),
            base: depth_test,
            fixed: |request, on| {
                request.depth_stencil = request.depth_stencil.depth_test_enable(on);
            },
            dynamic: sets!(on => cmd_set_depth_test_enable(on)),
        },
        Case {
            state: S::DEPTH_WRITE_ENABLE,
            vertices: steps(),
            base: depth_test,
            fixed: |request, on| {
                request.depth_stencil = request.depth_stencil.depth_write_enable(on);
            },
            dynamic: sets!(on => cmd_set_depth_write_enable(on)),
        },
        Case {
            state: S::DEPTH_COMPARE_OP,
            vertices: two_triangles([0.3, 0.7]),
            base: depth_test,
            fixed: |request, on| {
                request.depth_stencil = request.depth_stencil.depth_compare_op(compare(on));
            },
            dynamic: sets!(on => cmd_set_depth_compare_op(compare(on))),
        },
        Case {
            state: S::DEPTH_BOUNDS,
            vertices: flat(),
            base: bounds_test,
            fixed: |request, on| {
                request.depth_stencil.min_depth_bounds = if on { 0.6 } else { 0.0 };
            },
            dynamic: sets!(on => cmd_set_depth_bounds(if on { 0.6 } else { 0.0 }, 1.0)),
        },
        Case {
            state: S::DEPTH_BOUNDS_TEST_ENABLE,
            vertices: flat(),
            base: |request| {
                bounds_test(request);
                request.depth_stencil.min_depth_bounds = 0.6;
            },
            fixed: |request, on| {
                request.depth_stencil = request.depth_stencil.depth_bounds_test_enable(on);
            },
            dynamic: sets!(on => cmd_set_depth_bounds_test_enable(on)),
        },
        Case {
            state: S::DEPTH_BIAS,
            vertices: two_triangles([0.5, 0.55]),
            base: biased,
            fixed: |request, on| {
                request.raster.depth_bias_constant_factor = if on { BIAS } else { 0.0 };
            },
            dynamic: sets!(on => cmd_set_depth_bias(if on { BIAS } else { 0.0 }, 0.0, 0.0)),
        },
        Case {
            state: S::DEPTH_BIAS_ENABLE,
            vertices: two_triangles([0.5, 0.55]),
            base: |request| {
                biased(request);
                request.raster.depth_bias_constant_factor = BIAS;
            },
            fixed: |request, on| request.raster = request.raster.depth_bias_enable(on),
            dynamic: sets!(on => cmd_set_depth_bias_enable(on)),
        },
        Case {
            state: S::STENCIL_TEST_ENABLE,
            vertices: flat(),
            base: stencil_test,
            fixed: |request, on| {
                request.depth_stencil = request.depth_stencil.stencil_test_enable(on);
            },
            dynamic: sets!(on => cmd_set_stencil_test_enable(on)),
        },
        Case {
            state: S::STENCIL_OP,
            vertices: flat(),
            base: stencil_test,
            fixed: |request, on| set_faces(request, |face| face.pass_op = pass_op(on)),
            dynamic: sets!(on => cmd_set_stencil_op(
                BOTH,
                vk::StencilOp::KEEP,
                pass_op(on),
                vk::StencilOp::KEEP,
                vk::CompareOp::EQUAL,
            )),
        },
        Case {
            state: S::STENCIL_COMPARE_MASK,
            vertices: flat(),
            base: stencil_test,
            fixed: |request, on| set_faces(request, |face| face.compare_mask = mask(on)),
            dynamic: sets!(on => cmd_set_stencil_compare_mask(BOTH, mask(on))),
        },
        Case {
            state: S::STENCIL_WRITE_MASK,
            vertices: flat(),
            base: stencil_test,
            fixed: |request, on| set_faces(request, |face| face.write_mask = mask(on)),
            dynamic: sets!(on => cmd_set_stencil_write_mask(BOTH, mask(on))),
        },
        Case {
            state: S::STENCIL_REFERENCE,
            vertices: flat(),
            base: stencil_test,
            fixed: |request, on| set_faces(request, |face| face.reference = on.into()),
            dynamic: sets!(on => cmd_set_stencil_reference(BOTH, on.into())),
        },
        Case {
            state: S::BLEND_CONSTANTS,
            vertices: flat(),
            base: constant_blend,
            fixed: |request, on| request.blend_constants = constants(on),
            dynamic: sets!(on => cmd_set_blend_constants(&constants(on))),
        },
    ]
}

fn culled(on: bool) -> vk::CullModeFlags {
    if on { vk::CullModeFlags::BACK } else { vk::CullModeFlags::NONE }
}

fn face(on: bool) -> vk::FrontFace {
    if on { vk::FrontFace::CLOCKWISE } else { vk::FrontFace::COUNTER_CLOCKWISE }
}

fn topology(on: bool) -> vk::PrimitiveTopology {
    if on { vk::PrimitiveTopology::TRIANGLE_STRIP } else { vk::PrimitiveTopology::TRIANGLE_LIST }
}

fn compare(on: bool) -> vk::CompareOp {
    if on { vk::CompareOp::LESS } else { vk::CompareOp::GREATER }
}

fn pass_op(on: bool) -> vk::StencilOp {
    if on { vk::StencilOp::INVERT } else { vk::StencilOp::KEEP }
}

fn mask(on: bool) -> u32 {
    if on { 0xFF } else { 0 }
}

fn constants(on: bool) -> [f32; 4] {
    if on { [0.5; 4] } else { [0.25, 1.0, 1.0, 1.0] }
}

/// Draws a case's vertices by indices, with a restart index in the middle.
fn draw(canvas: &Canvas, case: &Case, request: &Graphics<'_>, set: Option<bool>) -> Vec<[f32; 4]> {
    // Where restart is off, the restart index is an ordinary vertex index.
    let mut vertices = case.vertices.clone();
    vertices.resize(256, vertex(0.9, 0.0, [1.0; 4]));
    let mut order: Vec<u8> = (0..case.vertices.len() as u8).collect();
    if case.state == S::PRIMITIVE_RESTART_ENABLE {
        order.insert(3, u8::MAX);
    }
    let indices = Buffer::of(&canvas.gpu, &order);
    canvas.draw(request, &vertices, |device, commands, _| {
        if let Some(on) = set {
            (case.dynamic)(device, commands, on);
        }
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_index_buffer(commands, indices.raw, 0, vk::IndexType::UINT8_KHR);
            device.cmd_draw_indexed(commands, order.len() as u32, 1, 0, 0, 0);
        }
    })
}

#[gaurast_runner::test]
fn dynamic_state_is_what_static_state_is() {
    let canvas = Canvas::with_depth();
    for case in cases() {
        let request = |on| {
            let mut request = Graphics { depth_format: DEPTH_FORMAT, ..colored() };
            (case.base)(&mut request);
            (case.fixed)(&mut request, on);
            request
        };
        let images = [false, true].map(|on| {
            let fixed = draw(&canvas, &case, &request(on), None);
            // The pipeline has the opposite value, which must be ignored.
            let dynamic = request(!on).with_dynamic(case.state);
            let set = draw(&canvas, &case, &dynamic, Some(on));
            assert!(set == fixed, "{:?} {on}", case.state);
            fixed
        });
        assert!(images[0] != images[1], "{:?} has no effect", case.state);
        assert_eq!(canvas.gpu.message_texts(), [""; 0], "{:?}", case.state);
    }
}

#[gaurast_runner::test]
fn viewports_and_scissors_come_with_their_count() {
    let canvas = Canvas::new();
    let request = Graphics { viewports: 0, dynamic: vec![S::VIEWPORT_WITH_COUNT, S::SCISSOR_WITH_COUNT], ..colored() };
    let vertices = [vertex(-1.0, -1.0, RED), vertex(3.0, -1.0, RED), vertex(-1.0, 3.0, RED)];
    let half = vk::Rect2D { offset: vk::Offset2D { x: 0, y: 10 }, extent: vk::Extent2D { width: WIDTH, height: 5 } };
    let viewport = vk::Viewport { x: 8.0, y: 0.0, width: 16.0, height: HEIGHT as f32, min_depth: 0.0, max_depth: 1.0 };
    let pixels = canvas.draw(&request, &vertices, |device, commands, _| {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_set_viewport_with_count(commands, &[viewport]);
            device.cmd_set_scissor_with_count(commands, &[half]);
            device.cmd_draw(commands, 3, 1, 0, 0);
        }
    });
    assert_eq!(gaurast_testkit::canvas::count(&pixels, RED), 16 * 5);
    assert_eq!(gaurast_testkit::scene::at(&pixels, (9, 12)), RED);
    assert_ne!(gaurast_testkit::scene::at(&pixels, (9, 9)), RED);
    assert_ne!(gaurast_testkit::scene::at(&pixels, (9, 15)), RED);
    assert_ne!(gaurast_testkit::scene::at(&pixels, (7, 12)), RED);
}

#[gaurast_runner::test]
fn strides_come_with_vertex_buffers() {
    let canvas = Canvas::new();
    let mut request = colored().with_dynamic(S::VERTEX_INPUT_BINDING_STRIDE);
    request.bindings[0].stride = 4;
    let triangle = gaurast_testkit::canvas::everything(GREEN);
    let spread: Vec<Vertex> = triangle.iter().flat_map(|it| [*it, [0.0; 8]]).collect();
    let buffer = Buffer::of(&canvas.gpu, spread.as_flattened());
    let pixels = canvas.draw(&request, &triangle, |device, commands, _| {
        let stride = [2 * size_of::<Vertex>() as u64];
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_vertex_buffers2(commands, 0, &[buffer.raw], &[0], None, Some(&stride));
            device.cmd_draw(commands, 3, 1, 0, 0);
        }
    });
    assert_eq!(gaurast_testkit::canvas::count(&pixels, GREEN), pixels.len());
}
