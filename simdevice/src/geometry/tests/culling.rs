//! Tests of facing and culling, and of dropping primitives that cover nothing.

use super::scene::*;
use crate::program::interface::VertexOutput;
use crate::state::{Rect, Topology, Viewport};
use crate::stats::counters::Counter;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[gaurast_runner::test]
fn facing_is_the_sign_of_the_area_in_the_framebuffer() {
    let device = device(1);
    // Clockwise in a framebuffer whose y points down.
    let clockwise = [at_pixel(10.0, 10.0, 0.0), at_pixel(90.0, 10.0, 0.0), at_pixel(90.0, 90.0, 0.0)];
    let mut counter_clockwise = clockwise;
    counter_clockwise.swap(1, 2);
    for (positions, is_clockwise) in [(clockwise, true), (counter_clockwise, false)] {
        for front_clockwise in [false, true] {
            for upside_down in [false, true] {
                for cull in 0..4 {
                    let mut draw = draw(&device, Topology::TriangleList, &positions);
                    let mut state = state(Topology::TriangleList);
                    state.front_clockwise = front_clockwise;
                    (state.cull_front, state.cull_back) = (cull & 1 != 0, cull & 2 != 0);
                    if upside_down {
                        let viewport = &mut state.viewports[0];
                        viewport.y = viewport.height;
                        viewport.height = -viewport.height;
                    }
                    draw.state = state.into();
                    let found = run(&device, &draw);
                    let front = (is_clockwise != upside_down) == front_clockwise;
                    let culled = cull & if front { 1 } else { 2 } != 0;
                    assert_eq!(found.primitives.len(), usize::from(!culled));
                    for primitive in &found.primitives {
                        assert_eq!(primitive.front, front);
                        assert!(area(primitive.corners) > 0);
                    }
                }
            }
        }
    }
}

/// True if any pixel centre of the framebuffer lies in a triangle, by the top-left rule.
fn covers(corners: [[i32; 2]; 3]) -> bool {
    let [a, b, c] = corners.map(|corner| corner.map(i64::from));
    let edge = |from: [i64; 2], to: [i64; 2], at: [i64; 2]| {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let value = dx * (at[1] - from[1]) - dy * (at[0] - from[0]);
        value > 0 || (value == 0 && (dy < 0 || (dy == 0 && dx > 0)))
    };
    (0..i64::from(HEIGHT)).any(|y| {
        (0..i64::from(WIDTH)).any(|x| {
            let at = [256 * x + 128, 256 * y + 128];
            edge(a, b, at) && edge(b, c, at) && edge(c, a, at)
        })
    })
}

#[gaurast_runner::test]
fn only_what_covers_nothing_is_dropped() {
    let device = device(1);
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut positions = Vec::new();
    for number in 0..800 {
        // Every second triangle spans at most two pixels.
        let reach = if number % 2 == 0 { 0.9 } else { 2.5 };
        // Many lie on pixel centres and edges.
        let grid = [0.5, 0.25, 1.0 / 256.0][rng.random_range(0..3)];
        let mut at = |least: f32, greatest: f32| (rng.random_range(least..greatest) / grid).round() * grid;
        let center = [at(-2.0, WIDTH as f32 + 2.0), at(-2.0, HEIGHT as f32 + 2.0)];
        for _ in 0..3 {
            positions.push(at_pixel(center[0] + at(-reach, reach), center[1] + at(-reach, reach), 0.5));
        }
    }
    let found = run(&device, &draw(&device, Topology::TriangleList, &positions));
    let kept: Vec<u32> = found.primitives.iter().map(|primitive| primitive.id).collect();
    let transform = super::super::viewport::Transform::new(&state(Topology::TriangleList).viewports[0], false, false);
    for (id, triangle) in (0..).zip(positions.chunks(3)) {
        let mut corners = [0, 1, 2].map(|i: usize| transform.project(triangle[i]).snapped);
        if area(corners) < 0 {
            corners.swap(1, 2);
        }
        if area(corners) > 0 && covers(corners) {
            assert!(kept.contains(&id), "{corners:?}");
        }
    }
    // Small triangles are tested exactly.
    for primitive in found.primitives.iter().filter(|primitive| primitive.id % 2 == 0) {
        assert!(covers(primitive.corners), "{:?}", primitive.corners);
    }
}

#[gaurast_runner::test]
fn a_primitive_goes_to_the_provoking_vertexs_layer_and_viewport() {
    let device = device(1);
    let positions = [[-0.5, -0.5, 0.5, 1.0], [0.5, -0.5, 0.5, 1.0], [0.5, 0.5, 0.5, 1.0]];
    let programs = programs(&[VertexOutput::Layer, VertexOutput::ViewportIndex]);
    let mut draw_state = state(Topology::TriangleList);
    draw_state.viewports.push(Viewport { x: 100.0, ..draw_state.viewports[0] });
    draw_state.scissors.push(Rect { width: 170, ..EVERYTHING });
    let mut draw = draw_with(&device, programs, draw_state, &positions);
    let targets: [[u32; 4]; 3] = [[2, 1, 0, 0], [0, 0, 0, 0], [9, 77, 0, 0]];
    draw.attributes.push(stream(&targets, crate::Format::R32G32B32A32Uint));
    let first = run(&device, &draw);
    let mut last_state = (*draw.state).clone();
    last_state.provoking_last = true;
    draw.state = last_state.into();
    let last = run(&device, &draw);
    let (a, b) = (&first.primitives[0], &last.primitives[0]);
    assert_eq!((a.layer, a.viewport), (2, 1));
    // A layer that does not exist becomes the last one, and a viewport the first.
    assert_eq!((b.layer, b.viewport), (3, 0));
    assert_eq!(a.corners, b.corners.map(|[x, y]| [x + 25_600, y]));
    assert_eq!(first.regions[1].width, 70);
    assert_eq!(first.binned([2, 1], 2), [0]);
    assert_eq!(first.binned([2, 1], 3), [0; 0]);
}

#[gaurast_runner::test]
fn distances_cull_what_is_negative_everywhere() {
    let device = device(1);
    let positions = [[-0.5, -0.5, 0.5, 1.0], [0.5, -0.5, 0.5, 1.0], [0.5, 0.5, 0.5, 1.0]];
    for (distances, drawn) in [
        ([[-1.0, 1.0, 0.0, 0.0], [-1.0, 1.0, 0.0, 0.0], [-0.1, 1.0, 0.0, 0.0]], 0),
        ([[-1.0, 1.0, 0.0, 0.0], [-1.0, 1.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]], 1),
        ([[-1.0, 1.0, 0.0, 0.0], [1.0, -1.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0]], 1),
    ] {
        let programs = programs(&[VertexOutput::CullDistance(0), VertexOutput::CullDistance(1)]);
        let mut draw = draw_with(&device, programs, state(Topology::TriangleList), &positions);
        draw.attributes.push(stream(&distances, crate::Format::R32G32B32A32Sfloat));
        assert_eq!(run(&device, &draw).primitives.len(), drawn);
    }
}

#[gaurast_runner::test]
fn statistics_count_every_stage() {
    let device = device(1);
    let mut positions = vec![at_pixel(0.0, 0.0, 0.5), at_pixel(90.0, 0.0, 0.5), at_pixel(90.0, 90.0, 0.5)];
    // One triangle is cut in two by the near plane, and one is beyond it.
    positions.extend([at_pixel(0.0, 0.0, 0.5), at_pixel(90.0, 0.0, 0.5), at_pixel(90.0, 90.0, -0.5)]);
    positions.extend([at_pixel(0.0, 0.0, -0.5), at_pixel(90.0, 0.0, -0.5), at_pixel(90.0, 90.0, -0.5)]);
    let mut draw = draw(&device, Topology::TriangleList, &positions);
    draw.indices = Some(indices(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 0, 1, 2, 0]));
    draw.count = 13;
    draw.instance_count = 2;
    let (_, counters) = parts(&device, &draw);
    assert_eq!(counters.get(Counter::InputVertices), 26);
    assert_eq!(counters.get(Counter::InputPrimitives), 8);
    assert_eq!(counters.get(Counter::VertexInvocations), 18);
    assert_eq!(counters.get(Counter::ClippingInvocations), 8);
    assert_eq!(counters.get(Counter::ClippingPrimitives), 8);
    assert_eq!(counters.get(Counter::PrimitivesDrawn), 8);
}
