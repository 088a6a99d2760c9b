//! Tests of clipping against an oracle that does not clip: it intersects a pixel's ray with the triangle in clip space.

use super::scene::*;
use crate::program::interface::VertexOutput;
use crate::state::Topology;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The weights of a triangle's corners whose sum is a point in pixels with w = 1. Any may be negative.
fn amounts(triangle: &[[f32; 4]], at: [f64; 2]) -> Option<[f64; 3]> {
    let column = |corner: usize| {
        let [x, y, _, w] = triangle[corner].map(f64::from);
        [x, y, w]
    };
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (a, b, c) = (column(0), column(1), column(2));
    let determinant = dot(a, cross(b, c));
    let ray = [at[0] / f64::from(WIDTH) * 2.0 - 1.0, at[1] / f64::from(HEIGHT) * 2.0 - 1.0, 1.0];
    let amount = |u, v| dot(ray, cross(u, v)) / determinant;
    (determinant.abs() > 1e-9).then(|| [amount(b, c), amount(c, a), amount(a, b)])
}

/// Returns true if a triangle, its depth and its clip distances are visible at a point in pixels; `near` is the depth of
/// the near plane, if there is one.
fn visible(triangle: &[[f32; 4]], distances: &[[f32; 4]], near: Option<f64>, at: [f64; 2]) -> bool {
    let Some(amounts) = amounts(triangle, at) else {
        return false;
    };
    let sum = |values: [f32; 3]| {
        let parts = amounts.iter().zip(values).map(|(amount, value)| amount * f64::from(value));
        parts.sum::<f64>()
    };
    let z = sum([0, 1, 2].map(|corner: usize| triangle[corner][2]));
    amounts.iter().all(|&amount| amount >= 0.0)
        && near.is_none_or(|near| (near..=1.0).contains(&z))
        && (0..2).all(|index| sum([0, 1, 2].map(|corner: usize| distances[corner][index])) >= 0.0)
}

/// The number of primitives that cover a pixel's centre.
fn coverage(draw: &Found, id: Option<u32>, pixel: [i64; 2]) -> usize {
    let at = pixel.map(|pixel| 256 * pixel + 128);
    let covers = |corners: [[i32; 2]; 3]| {
        let corners = corners.map(|corner| corner.map(i64::from));
        (0..3).all(|edge| {
            let (from, to) = (corners[edge], corners[(edge + 1) % 3]);
            let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
            let value = dx * (at[1] - from[1]) - dy * (at[0] - from[0]);
            value > 0 || (value == 0 && (dy < 0 || (dy == 0 && dx > 0)))
        })
    };
    let all = draw.primitives.iter().filter(|primitive| id.is_none_or(|id| primitive.id == id));
    all.filter(|primitive| covers(primitive.corners)).count()
}

fn random_position(rng: &mut ChaCha8Rng, reach: f32) -> [f32; 4] {
    let w = rng.random_range(-1.5..3.0f32);
    let scale = if rng.random_bool(0.2) { reach } else { 1.5 };
    let mut side = || rng.random_range(-scale..scale);
    let (x, y) = (side(), side());
    [x, y, rng.random_range(-0.5..1.5) * w.abs(), w]
}

#[gaurast_runner::test]
fn what_is_left_is_what_is_visible() {
    let device = device(1);
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    let (mut inside, mut checked, mut cut) = (0, 0, 0);
    for near in [Some(0.0), None, Some(-1.0)] {
        let mut positions: Vec<_> = (0..3 * 400).map(|_| random_position(&mut rng, 3000.0)).collect();
        if near == Some(-1.0) {
            positions.iter_mut().for_each(|[_, _, z, w]| *z = 2.0 * *z - *w);
        }
        let distances: Vec<[f32; 4]> =
            positions.iter().map(|_| [rng.random_range(-0.3..1.0), rng.random_range(-0.3..1.0), 0.0, 0.0]).collect();
        let programs = programs(&[VertexOutput::ClipDistance(0), VertexOutput::ClipDistance(1)]);
        let mut draw_state = state(Topology::TriangleList);
        draw_state.depth_clamp = near.is_none();
        draw_state.negative_one_to_one = near == Some(-1.0);
        let mut draw = draw_with(&device, programs, draw_state, &positions);
        draw.attributes.push(stream(&distances, crate::Format::R32G32B32A32Sfloat));
        let found = run(&device, &draw);
        for (id, (triangle, distances)) in (0..).zip(positions.chunks(3).zip(distances.chunks(3))) {
            for _ in 0..200 {
                let pixel = [rng.random_range(0..i64::from(WIDTH)), rng.random_range(0..i64::from(HEIGHT))];
                // Within 1/64 pixel of an edge, snapping may decide either way.
                let around = [[0.0, 0.0], [1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
                let seen = around.map(|[x, y]| {
                    let at = [pixel[0] as f64 + 0.5 + x / 64.0, pixel[1] as f64 + 0.5 + y / 64.0];
                    visible(triangle, distances, near, at)
                });
                if seen.iter().all(|&other| other == seen[0]) {
                    let expected = usize::from(seen[0]);
                    assert_eq!(coverage(&found, Some(id), pixel), expected, "{triangle:?} {pixel:?}");
                    inside += expected;
                    checked += 1;
                }
            }
        }
        cut += found.primitives.len();
    }
    // Otherwise the test would check too little.
    assert!(inside > 5_000 && checked > 100_000, "{inside} of {checked}");
    assert!(cut > 200, "{cut}");
}

#[gaurast_runner::test]
fn meshes_stay_watertight_where_they_are_clipped() {
    const SIDE: usize = 24;
    let device = device(1);
    let mut rng = ChaCha8Rng::seed_from_u64(33);
    for _ in 0..6 {
        // A plane that extends from behind the eye to beyond the far plane, rotated at random.
        let turn: f32 = rng.random_range(0.0..6.3);
        let (sin, cos) = turn.sin_cos();
        let height = rng.random_range(0.2..1.0);
        let mut positions = Vec::new();
        for row in 0..=SIDE {
            for column in 0..=SIDE {
                let jitter = [0, 1].map(|_| rng.random_range(-0.3..0.3f32));
                let along = [column, row].map(|n| n as f32 - SIDE as f32 / 2.0);
                let [u, v] = [0, 1].map(|i: usize| (along[i] + jitter[i]) * 1.5);
                let (x, y) = (u, height);
                let w = v;
                let (near, far) = (0.5, 12.0);
                let z = (w - near) * far / (far - near);
                positions.push([x * cos - y * sin, x * sin + y * cos, z, w]);
            }
        }
        let mut list = Vec::new();
        for row in 0..SIDE {
            for column in 0..SIDE {
                let a = (row * (SIDE + 1) + column) as u32;
                let (b, c, d) = (a + 1, a + 1 + SIDE as u32, a + 2 + SIDE as u32);
                // Edges occur in both directions, and begin at either end.
                list.extend([a, b, c, d, c, b]);
            }
        }
        let mut draw = draw(&device, Topology::TriangleList, &positions);
        draw.count = list.len() as u32;
        draw.indices = Some(indices(&list));
        let found = run(&device, &draw);
        let triangles: Vec<Vec<[f32; 4]>> =
            list.chunks(3).map(|three| three.iter().map(|&i| positions[i as usize]).collect()).collect();
        let mut covered = 0;
        for y in (0..i64::from(HEIGHT)).step_by(3) {
            for x in 0..i64::from(WIDTH) {
                let count = coverage(&found, None, [x, y]);
                assert!(count <= 1, "{x} {y}");
                covered += count;
                if count == 0 {
                    // A pixel that the mesh surrounds must be covered.
                    let at = [x as f64 + 0.5, y as f64 + 0.5];
                    let seen = |[dx, dy]: [f64; 2]| {
                        let at = [at[0] + dx, at[1] + dy];
                        triangles.iter().any(|triangle| visible(triangle, &[[0.0; 4]; 3], Some(0.0), at))
                    };
                    let around = [[0.0, 0.0], [0.1, 0.1], [-0.1, 0.1], [0.1, -0.1], [-0.1, -0.1]];
                    assert!(!around.into_iter().all(seen), "a hole at {x} {y}");
                }
            }
        }
        assert!(covered > 500, "{covered}");
    }
}

#[gaurast_runner::test]
fn new_vertices_have_the_varyings_of_their_place() {
    let device = device(1);
    let mut rng = ChaCha8Rng::seed_from_u64(41);
    let mut made = 0;
    for _ in 0..300 {
        let positions: Vec<_> = (0..3)
            .map(|_| {
                let mut position = random_position(&mut rng, 3000.0);
                position[3] = position[3].abs() + 0.2;
                position
            })
            .collect();
        let half = WIDTH as f32 / 2.0;
        let window = |position: &[f32; 4]| half + half * position[0] / position[3];
        for number in [VALUE, LINEAR] {
            let values: Vec<f32> =
                positions.iter().map(|position| if number == VALUE { position[0] } else { window(position) }).collect();
            let mut draw = draw(&device, Topology::TriangleList, &positions);
            draw.attributes[1] = stream(&values, crate::Format::R32Sfloat);
            let found = run(&device, &draw);
            for primitive in &found.primitives {
                for corner in 0..3 {
                    let vertex = primitive.vertices[corner];
                    let value = varying(&found, vertex, number);
                    let x = if number == VALUE { half + half * value * primitive.inverse_w[corner] } else { value };
                    let off = (x * 256.0 - primitive.corners[corner][0] as f32).abs();
                    // Snapping moves it by half a unit, and binary32 has only 24 bits for distant ones.
                    assert!(off < 1.0 + x.abs() / 1000.0, "{x} {:?}", primitive.corners[corner]);
                    made += usize::from(vertex > 0);
                }
                assert_eq!(varying_bits(&found, primitive.provoking, INDEX), 0);
            }
        }
    }
    assert!(made > 500);
}

#[gaurast_runner::test]
fn far_triangles_inside_the_guard_band_are_not_cut() {
    let device = device(1);
    let positions = [at_pixel(-30_000.0, -30_000.0, 0.5), at_pixel(30_000.0, 0.0, 0.5), at_pixel(0.0, 30_000.0, 0.5)];
    let found = run(&device, &draw(&device, Topology::TriangleList, &positions));
    assert_eq!(found.primitives.len(), 1);
    let positions = positions.map(|[x, y, z, w]| [x * 1.5, y * 1.5, z, w]);
    let found = run(&device, &draw(&device, Topology::TriangleList, &positions));
    assert!(found.primitives.len() > 1);
    for primitive in &found.primitives {
        assert!(primitive.corners.iter().flatten().all(|c| c.abs() <= (32_768 + 1) * 256));
    }
}

#[gaurast_runner::test]
fn lines_are_cut_by_the_depth_range() {
    let device = device(1);
    let positions = [at_pixel(10.0, 20.0, -1.0), at_pixel(110.0, 20.0, 1.0)];
    let found = run(&device, &draw(&device, Topology::LineList, &positions));
    let [primitive] = &found.primitives[..] else {
        panic!("one line");
    };
    assert_eq!(primitive.depth, [0.0, 0.0, 1.0]);
    assert!((primitive.corners[0][0] - 60 * 256).abs() <= 1);
    assert_eq!(varying(&found, primitive.vertices[0], VALUE), 0.5);
    assert_eq!(varying_bits(&found, primitive.provoking, INDEX), 0);
}
