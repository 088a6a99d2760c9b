//! Tests of the viewport transform and snapping against exact values.

use super::super::viewport::{Transform, pixels, snap, snap_away};
use super::scene::*;
use crate::state::{Rect, Topology, Viewport};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[gaurast_runner::test]
fn coordinates_round_to_the_nearest_sub_pixel() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let check = |x: f32| {
        let scaled = (x - 0.5) * 256.0;
        assert_eq!(snap(x), scaled.round_ties_even() as i32 + 128, "{x}");
        assert_eq!(snap_away(x), scaled.round() as i32 + 128, "{x}");
    };
    for _ in 0..20_000 {
        check(rng.random_range(-30_000.0..30_000.0));
        check(rng.random_range(-3.0..3.0));
    }
    for step in -2000..2000 {
        // Every second value is a tie.
        check(step as f32 / 512.0);
    }
    for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e30] {
        assert!(snap(x).abs() < 1 << 25 && snap_away(x).abs() < 1 << 25);
    }
}

#[gaurast_runner::test]
fn the_viewport_maps_with_one_rounding_after_the_division() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    for _ in 0..5000 {
        let viewport = Viewport {
            x: rng.random_range(-50.0..50.0),
            y: rng.random_range(-50.0..50.0),
            width: rng.random_range(1.0..5000.0),
            height: rng.random_range(-5000.0..5000.0),
            min_depth: rng.random_range(0.0..1.0),
            max_depth: rng.random_range(0.0..1.0),
        };
        let position: [f32; 4] = std::array::from_fn(|_| rng.random_range(0.1..3.0));
        let projected = Transform::new(&viewport, false, false).project(position);
        let inverse = 1.0 / position[3];
        let half = [0.5 * viewport.width, 0.5 * viewport.height];
        let x = (position[0] * inverse).mul_add(half[0], half[0] + viewport.x);
        let y = (position[1] * inverse).mul_add(half[1], half[1] + viewport.y);
        let depth = viewport.max_depth - viewport.min_depth;
        let z = (position[2] * inverse).mul_add(depth, viewport.min_depth);
        assert_eq!(projected.window, [x, y]);
        assert_eq!((projected.depth, projected.inverse_w), (z, inverse));
        assert_eq!(projected.snapped, [snap(x), snap(y)]);
    }
}

#[gaurast_runner::test]
fn corners_lie_where_positions_say() {
    let device = device(1);
    let pixel = |x, y| at_pixel(x, y, 0.25);
    let positions = [pixel(10.0, 20.0), pixel(60.5, 20.25), pixel(10.0, 90.0)];
    let drawn = run(&device, &draw(&device, Topology::TriangleList, &positions));
    let [primitive] = &drawn.primitives[..] else {
        panic!("one triangle");
    };
    for (corner, expected) in primitive.corners.iter().zip([[2560, 5120], [15488, 5184], [2560, 23040]]) {
        let off = [0, 1].map(|axis: usize| (corner[axis] - expected[axis]).abs());
        assert!(off[0] <= 1 && off[1] <= 1, "{corner:?} {expected:?}");
    }
    assert_eq!(primitive.depth, [0.25; 3]);
    assert_eq!(primitive.inverse_w, [1.0; 3]);
}

#[gaurast_runner::test]
fn a_viewport_has_the_pixels_whose_centres_lie_in_it() {
    let viewport = |x, width| Viewport { x, y: 7.0, width, height: -5.0, min_depth: 0.0, max_depth: 1.0 };
    for (x, width, first, count) in [(0.0, 10.0, 0, 10), (0.5, 10.0, 0, 10), (0.51, 10.0, 1, 10), (2.25, 0.5, 2, 1)] {
        let expected = Rect { x: first, y: 2, width: count, height: 5 };
        assert_eq!(pixels(&viewport(x, width)), expected);
    }
}

#[gaurast_runner::test]
fn snapping_does_not_move_the_plane_of_depth() {
    let device = device(1);
    let mut rng = ChaCha8Rng::seed_from_u64(15);
    let positions: Vec<[f32; 4]> = (0..3 * 200)
        .map(|_| {
            let [x, y] = [0, 1].map(|_| rng.random_range(5.0..145.0));
            at_pixel(x, y, rng.random_range(0.0..1.0))
        })
        .collect();
    let drawn = run(&device, &draw(&device, Topology::TriangleList, &positions));
    let transform = Transform::new(&state(Topology::TriangleList).viewports[0], false, false);
    // The depth at a place, of a plane given at three others.
    let plane = |corners: [[f64; 2]; 3], depth: [f64; 3], at: [f64; 2]| {
        let area =
            |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let [a, b, c] = corners;
        let weights = [area(at, b, c), area(a, at, c), area(a, b, at)];
        let sum: f64 = weights.iter().zip(depth).map(|(weight, depth)| weight * depth).sum();
        sum / area(a, b, c)
    };
    let mut checked = 0;
    for primitive in &drawn.primitives {
        if area(primitive.corners) < 400 * 65_536 {
            continue;
        }
        let first = 3 * primitive.id as usize;
        let exact = [0, 1, 2].map(|corner: usize| transform.project(positions[first + corner]));
        let window = exact.map(|vertex| vertex.window.map(f64::from));
        let center = [0, 1].map(|axis: usize| window.iter().map(|at| at[axis]).sum::<f64>() / 3.0);
        let expected = plane(window, exact.map(|vertex| f64::from(vertex.depth)), center);
        let vertices = [0, 1, 2].map(|corner: usize| {
            [0, 1].map(|axis: usize| {
                let offset = f64::from(primitive.offsets[corner][axis]) / 65_536.0;
                (f64::from(primitive.corners[corner][axis]) + offset) / 256.0
            })
        });
        let found = plane(vertices, primitive.depth.map(f64::from), center);
        assert!((found - expected).abs() < 2e-7, "{found} {expected}");
        checked += 1;
    }
    assert!(checked > 100);
}
