//! The per-pixel order against a twin that takes one pixel at a time.

use super::*;
use crate::gaussian::splats::ray_depth::ordered_key;
use crate::raster::gaussian::by_block::per_pixel::HELD;

/// As [`naive_sample`](super::naive_sample), in the per-pixel order.
pub(super) fn naive_sample(
    draw: &BinnedDraw,
    tile: [u32; 2],
    [x, y]: [usize; 2],
    power: impl Fn(f32) -> f32,
    passes: impl Fn(u32) -> bool,
) -> Naive {
    let mut out = Naive::default();
    let state = &draw.state;
    let neg_log2_floor = (-libm::log2(state.alpha_floor.into())).min(126.0) as f32;
    let depths = draw.ray_depths().unwrap();
    let at = [x, y].map(|at| at as f64 + 0.5);
    let at = [0, 1].map(|axis| at[axis] + f64::from(tile[axis] * TILE_SIZE));
    let rays = depths.rays.of([at[0]; 16], [at[1]; 16]);
    let mut reached = Vec::new();
    for &primitive in draw.sorted.tiles.list(tile[0], tile[1]) {
        let index = SplatIndex::new(primitive);
        let g = index.of(&draw.sorted.splats);
        let f = g.factor;
        // The kernel's roundings: from the corner to the mean, to the middle of the block, to the pixel.
        let from = |axis: usize, at: usize| {
            let middle = (4 * (at / 4)) as f64 + 2.0;
            let from_mean = f64::from(tile[axis] * TILE_SIZE) - g.mean[axis];
            ((at % 4) as f64 - 1.5) + (middle + from_mean)
        };
        let (dx, dy) = (from(0, x), from(1, y));
        let (u, v) = (dx * f[0], dx * f[1] + dy * f[2]);
        let neg_log2_alpha = ((u * u + v * v - f64::from(g.log2_opacity)) as f32).max(-1.0);
        if neg_log2_alpha > neg_log2_floor {
            continue;
        }
        let alpha = power(-neg_log2_alpha).min(state.alpha_ceiling);
        out.reached = true;
        if passes(g.look.depth) {
            let depth = index.of(depths.by_group);
            let along = dispatch!(Level::baseline(), simd => depth.along(simd, &rays, 0).as_slice()[0]);
            reached.push((ordered_key(along), g, alpha));
        }
    }
    // Stable.
    reached.sort_by_key(|(key, ..)| *key);
    let (mut c, mut t, mut covered) = ([0.0f64; 3], 1.0f64, false);
    for (_, g, alpha) in reached {
        let weight = t * f64::from(alpha);
        if t - weight < f64::from(state.transmittance_floor) {
            break;
        }
        if t >= 0.5 {
            out.median = g.look.depth;
        }
        for (c, color) in c.iter_mut().zip(g.look.color) {
            *c += weight * f64::from(color);
        }
        t -= weight;
        covered = true;
    }
    let [r, g, b] = c.map(|c| c as f32);
    out.fragment = covered.then_some([r, g, b, 1.0 - t as f32]);
    out
}

#[gaurast_runner::test(each = simd_levels())]
fn it_equals_its_twin(case: &Case) {
    let state = GaussianState { order: GaussianOrder::PerPixel, ..defaults() };
    for seed in 20..23 {
        check(case, seed, 400, &state, WHOLE);
    }
    // Everything contributes everywhere, in several passes.
    let state = GaussianState { alpha_floor: 0.0, transmittance_floor: 0.0, low_pass_variance: 0.0, ..state };
    check(case, 23, 3 * HELD as u32, &state, WHOLE);
}

#[gaurast_runner::test]
fn it_is_another_order() {
    let device = Device::new(&Config::default()).unwrap();
    let picture = |order| {
        let state = GaussianState { order, ..defaults() };
        let draw = draw(24, 400, state, &device, WHOLE);
        let mut tile = Box::new(GaussianTile::default());
        tile.render(&draw, device.level(), 2, 2, &mut Counters::default());
        (0..TILE * TILE).map(|at| tile.pixel(at % TILE, at / TILE)).collect::<Vec<_>>()
    };
    let by_pixel = picture(GaussianOrder::PerPixel);
    for order in [GaussianOrder::ViewDepth, GaussianOrder::RadialDistance, GaussianOrder::Primitive] {
        assert!(picture(order) != by_pixel, "{order:?}");
    }
}
