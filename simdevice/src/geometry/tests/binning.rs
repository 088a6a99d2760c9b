//! Tests of bins against a search of every pixel of every macro-tile.

use super::super::{FrontEnd, Primitive, PrimitiveKind, Surface};
use super::scene::*;
use crate::device::Device;
use crate::program::interface::VertexOutput;
use crate::runtime::Config;
use crate::state::{Rect, Topology};
use crate::stats::counters::Counters;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// True if a primitive covers a pixel's centre.
fn covers(primitive: &Primitive, [x, y]: [i64; 2]) -> bool {
    let at = [256 * x + 128, 256 * y + 128];
    let [a, b, c] = primitive.corners.map(|corner| corner.map(i64::from));
    let d = [a[0] + c[0] - b[0], a[1] + c[1] - b[1]];
    let outline = match primitive.kind {
        PrimitiveKind::Triangle => vec![a, b, c],
        _ => vec![a, b, c, d],
    };
    (0..outline.len()).all(|edge| {
        let (from, to) = (outline[edge], outline[(edge + 1) % outline.len()]);
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let value = dx * (at[1] - from[1]) - dy * (at[0] - from[0]);
        value > 0 || (value == 0 && (dy < 0 || (dy == 0 && dx > 0)))
    })
}

#[gaurast_runner::test]
fn macro_tiles_have_what_touches_them_in_order() {
    let mut rng = ChaCha8Rng::seed_from_u64(51);
    let area = Rect { x: 13, y: 21, width: 150, height: 110 };
    for (macro_tile_size, topology) in [
        (16, Topology::TriangleList),
        (64, Topology::TriangleList),
        (32, Topology::LineList),
        (32, Topology::PointList),
    ] {
        let config = Config { threads: 2, macro_tile_size, ..Config::default() };
        let device = Device::new(&config).unwrap();
        let mut positions = Vec::new();
        for _ in 0..300 {
            let reach: f32 = rng.random_range(1.0..60.0);
            let center = [rng.random_range(-20.0..220.0), rng.random_range(-20.0..170.0)];
            for _ in 0..3 {
                let [x, y] = center.map(|c: f32| c + rng.random_range(-reach..reach));
                positions.push(at_pixel(x, y, 0.5));
            }
        }
        let layers: Vec<[u32; 4]> = positions.iter().map(|_| [rng.random_range(0..3), 0, 0, 0]).collect();
        let programs = programs(&[VertexOutput::Layer]);
        let mut draw_state = state(topology);
        draw_state.line_width = 3.0;
        let mut draw = draw_with(&device, programs, draw_state, &positions);
        draw.attributes.push(stream(&layers, crate::Format::R32G32B32A32Uint));
        let surface = Surface { area, layers: 3, view: None, depth: None };
        let mut counters = Counters::default();
        let mut front = FrontEnd::new(&draw, surface, device.runtime(), &mut counters);
        let found = Found::new(front.next_segments(&mut counters).unwrap().unwrap());
        let mut pairs = 0;
        for layer in 0..5 {
            for row in 0..12 {
                for column in 0..14 {
                    let list = found.binned([column, row], layer);
                    assert!(list.windows(2).all(|pair| pair[0] < pair[1]));
                    pairs += list.len();
                    let pixels = Rect {
                        x: (column * macro_tile_size) as i32,
                        y: (row * macro_tile_size) as i32,
                        width: macro_tile_size,
                        height: macro_tile_size,
                    };
                    let pixels = pixels.intersect(area);
                    for (number, primitive) in (0..).zip(&found.primitives) {
                        if u32::from(primitive.layer) != layer {
                            assert!(!list.contains(&number));
                            continue;
                        }
                        let mut all = (0..pixels.height).flat_map(|y| (0..pixels.width).map(move |x| (x, y)));
                        let touches = all.any(|(x, y)| {
                            let at = [i64::from(pixels.x) + i64::from(x), i64::from(pixels.y) + i64::from(y)];
                            covers(primitive, at)
                        });
                        assert!(!touches || list.contains(&number));
                    }
                }
            }
        }
        assert_eq!(pairs as u64, found.pairs(), "nothing is binned elsewhere");
        assert!(pairs > 100);
    }
}
