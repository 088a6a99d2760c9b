//! Tests of points, lines, polygon modes and depth bias.

use super::super::PrimitiveKind;
use crate::program::interface::VertexOutput;
use crate::state::{DepthBias, DepthBiasUnit, PolygonMode, Topology};

use super::scene::*;

/// The four corners of a parallelogram.
fn corners(draw: &Found, number: usize) -> Vec<[i32; 2]> {
    let [a, b, c] = draw.primitives[number].corners;
    vec![a, b, c, [a[0] + c[0] - b[0], a[1] + c[1] - b[1]]]
}

#[gaurast_runner::test]
fn points_are_squares_of_their_size() {
    let device = device(1);
    let positions = [at_pixel(50.5, 40.5, 0.5); 7];
    // A point without a size, or a negative one, covers nothing.
    let sizes = [0.0f32, 4.0, 0.25, 1000.0, -1.0, f32::NAN, 2.5].map(|size| [size, 0.0, 0.0, 0.0]);
    let programs = programs(&[VertexOutput::PointSize]);
    let mut draw = draw_with(&device, programs, state(Topology::PointList), &positions);
    draw.attributes.push(stream(&sizes, crate::Format::R32G32B32A32Sfloat));
    let found = run(&device, &draw);
    let sides = [1024, 64, 255 * 256, 256, 640];
    assert_eq!(found.primitives.len(), sides.len());
    for (number, side) in sides.into_iter().enumerate() {
        let primitive = &found.primitives[number];
        assert_eq!(primitive.kind, PrimitiveKind::Point);
        let (x, y) = (50 * 256 + 128 - side / 2, 40 * 256 + 128 - side / 2);
        assert_eq!(primitive.corners, [[x, y], [x + side, y], [x + side, y + side]]);
        assert_eq!(primitive.vertices, [primitive.provoking; 3]);
    }
}

/// The near and the far plane clip points by their centre. Points whose centre is beside the view volume are drawn where they extend
/// into it.
#[gaurast_runner::test]
fn points_are_clipped_by_depth_alone() {
    let device = device(1);
    let positions = [
        at_pixel(199.5, 149.5, 0.5),
        at_pixel(201.5, 50.0, 0.5),
        at_pixel(50.0, -1.25, 0.5),
        at_pixel(203.0, 50.0, 0.5),
        at_pixel(50.0, 50.0, 1.5),
        at_pixel(50.0, 50.0, -0.5),
    ];
    let mut draw = draw_with(&device, programs(&[VertexOutput::PointSize]), state(Topology::PointList), &positions);
    let sizes = [[4.0f32, 0.0, 0.0, 0.0]; 6];
    draw.attributes.push(stream(&sizes, crate::Format::R32G32B32A32Sfloat));
    let found = run(&device, &draw);
    assert_eq!(found.primitives.iter().map(|primitive| primitive.id).collect::<Vec<_>>(), [0, 1, 2]);
}

#[gaurast_runner::test]
fn lines_are_rectangles_around_their_segment() {
    let device = device(1);
    let ends = [[20.0, 30.0], [120.0, 30.0], [60.0, 20.0], [60.0, 100.0], [30.0, 30.0], [60.0, 70.0]];
    let positions = ends.map(|[x, y]| at_pixel(x, y, 0.5));
    for width in [1.0, 5.0] {
        let mut draw_state = state(Topology::LineList);
        draw_state.line_width = width;
        let found = run(&device, &draw_with(&device, programs(&[]), draw_state, &positions));
        assert_eq!(found.primitives.len(), 3);
        for (number, ends) in ends.chunks(2).enumerate() {
            let corners = corners(&found, number);
            let primitive = &found.primitives[number];
            assert_eq!(primitive.kind, PrimitiveKind::Line);
            assert!(area(primitive.corners) > 0);
            let (dx, dy) = (ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]);
            let scale = width / 2.0 / f32::hypot(dx, dy);
            let side = [-dy * scale, dx * scale];
            // Corners 0 and 1 are at the first end, one on either side; corners 2 and 3 at the other.
            let expected = [(0, 1.0), (0, -1.0), (1, -1.0), (1, 1.0)];
            for (corner, (end, sign)) in corners.iter().zip(expected) {
                for axis in 0..2 {
                    let expected = 256.0 * (ends[end][axis] + sign * side[axis]);
                    assert!((corner[axis] as f32 - expected).abs() <= 1.5, "{corners:?}");
                }
            }
            let index = |vertex| varying_bits(&found, vertex, INDEX) as usize;
            assert_eq!(primitive.vertices.map(index), [2 * number, 2 * number, 2 * number + 1]);
        }
    }
}

#[gaurast_runner::test]
fn a_line_without_length_is_not_drawn() {
    let device = device(1);
    let positions = [at_pixel(50.0, 40.0, 0.5); 2];
    let found = run(&device, &draw(&device, Topology::LineList, &positions));
    assert!(found.primitives.is_empty());
}

#[gaurast_runner::test]
fn polygons_may_be_drawn_as_their_edges_or_vertices() {
    let device = device(1);
    // The near plane cuts off the third vertex. The cut is not part of the outline.
    let whole = [at_pixel(20.0, 20.0, 0.5), at_pixel(120.0, 20.0, 0.5), at_pixel(20.0, 120.0, 0.5)];
    let mut cut = whole;
    cut[2][2] = -0.5;
    for (positions, mode, count) in [
        (whole, PolygonMode::Line, 3),
        (whole, PolygonMode::Point, 3),
        (cut, PolygonMode::Line, 3),
        (cut, PolygonMode::Point, 3),
    ] {
        for cull in [false, true] {
            let mut draw_state = state(Topology::TriangleList);
            draw_state.polygon_mode = mode;
            draw_state.cull_front = cull;
            let found = run(&device, &draw_with(&device, programs(&[]), draw_state, &positions));
            assert_eq!(found.primitives.len(), if cull { 0 } else { count });
            for primitive in &found.primitives {
                assert_eq!(primitive.id, 0);
                assert_eq!(varying_bits(&found, primitive.provoking, INDEX), 0);
                let y = primitive.corners.map(|corner| corner[1]).into_iter().max().unwrap();
                assert!(positions == whole || y < 72 * 256);
            }
        }
    }
}

#[gaurast_runner::test]
fn depth_bias_follows_the_specification() {
    let device = device(1);
    // Depth falls by 0.25 over 100 pixels of x, and by 0.125 over 100 of y.
    let positions = [at_pixel(20.0, 20.0, 0.75), at_pixel(120.0, 20.0, 0.5), at_pixel(20.0, 120.0, 0.625)];
    let depth_of = |bias: DepthBias, positions: &[[f32; 4]]| {
        let mut draw_state = state(Topology::TriangleList);
        draw_state.depth_bias = Some(bias);
        let found = run(&device, &draw_with(&device, programs(&[]), draw_state, positions));
        found.primitives[0].depth[0]
    };
    let bias = |constant, slope, clamp| DepthBias { constant, clamp, slope, unit: DepthBiasUnit::DEFAULT };
    // The greatest depth has exponent -1: a unit is 2^-24.
    assert_eq!(depth_of(bias(1000.0, 0.0, 0.0), &positions), 0.75 + 1000.0 / 16_777_216.0);
    assert!((depth_of(bias(0.0, 2.0, 0.0), &positions) - 0.755).abs() < 1e-6);
    assert!((depth_of(bias(0.0, 2.0, 0.001), &positions) - 0.751).abs() < 1e-6);
    assert!((depth_of(bias(0.0, -2.0, -0.001), &positions) - 0.749).abs() < 1e-6);
    assert!((depth_of(bias(0.0, -2.0, 0.001), &positions) - 0.745).abs() < 1e-6);
    // Units that don't depend on the depth: those of 24 bits, and 1.
    let far = positions.map(|[x, y, z, w]| [x, y, z / 16.0, w]);
    let of_unit = |constant, unit| depth_of(DepthBias { unit, ..bias(constant, 0.0, 0.0) }, &far) - 0.75 / 16.0;
    let exactly = |unit: fn(bool) -> DepthBiasUnit| [unit(false), unit(true)];
    let of_format = exactly(|is_exact| DepthBiasUnit::Format { is_exact });
    assert_eq!(of_format.map(|unit| of_unit(1024.0, unit)), [2f32.powi(-18); 2]);
    let of_fixed_point = exactly(|is_exact| DepthBiasUnit::FixedPoint { is_exact });
    assert_eq!(of_fixed_point.map(|unit| of_unit(1024.0, unit)), [2f32.powi(-13), 2f32.powi(-14)]);
    assert_eq!(of_unit(0.25, DepthBiasUnit::One), 0.25);
}
