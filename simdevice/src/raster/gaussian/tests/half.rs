//! binary16 rasterization against its definition, one number at a time.

use super::*;
use crate::raster::gaussian::by_block::binary16::scalar;
use crate::raster::gaussian::by_block::binary16::scalar::Splat16;

/// As [`naive_sample`](super::naive_sample), in binary16.
pub(super) fn naive_sample(
    draw: &BinnedDraw,
    tile: [u32; 2],
    [x, y]: [usize; 2],
    passes: impl Fn(u32) -> bool,
) -> Naive {
    let mut out = Naive::default();
    let state = scalar::State::new(&draw.state);
    let mut pixel = scalar::Pixel::default();
    for &primitive in draw.sorted.tiles.list(tile[0], tile[1]) {
        let index = SplatIndex::new(primitive);
        let g = index.of(&draw.sorted.splats);
        let alpha = alpha_at(draw, g, [0, 1].map(|axis| tile[axis] as usize * TILE + [x, y][axis]));
        if alpha >= state.alpha_floor {
            out.reached = true;
            if passes(g.look.depth) && pixel.add(&Splat16::new(g), alpha, &state) {
                out.median = g.look.depth;
            }
        }
    }
    let [r, g, b] = pixel.color;
    let covered = pixel.covered;
    out.fragment = covered.then_some([r, g, b, 1.0 - pixel.transmittance]);
    out.median = if covered { out.median } else { 0 };
    out
}

/// A Gaussian's alpha at a pixel of the framebuffer.
fn alpha_at(draw: &BinnedDraw, g: &Splat, at: [usize; 2]) -> f32 {
    let d = [0, 1].map(|axis| {
        // The kernel's roundings: from the tile's corner to the mean, to the middle of the block, to the pixel.
        let corner = (at[axis] / TILE * TILE) as f64;
        let inside = at[axis] % TILE;
        let middle = (4 * (inside / 4)) as f64 + 2.0 + (corner - g.mean[axis]);
        ((inside % 4) as f64 - 1.5 + middle) as f32
    });
    scalar::alpha(&Splat16::new(g), d, &scalar::State::new(&draw.state))
}

fn state() -> GaussianState {
    GaussianState { precision: GaussianPrecision::Float16, ..defaults() }
}

#[gaurast_runner::test]
fn numbers_are_rounded_to_the_nearest_and_even() {
    // Every binary16 number, those halfway to the next, and those beside.
    for half in 0..0x7C00u32 {
        let value = |half: u32| {
            let (exponent, fraction) = (half >> 10, half & 0x3FF);
            if exponent == 0 {
                fraction as f32 * 2.0f32.powi(-24)
            } else {
                (1024 + fraction) as f32 * 2.0f32.powi(exponent as i32 - 25)
            }
        };
        let next = if half == 0x7BFF { 65536.0 } else { value(half + 1) };
        let middle = 0.5 * (value(half) + next);
        let above = if half == 0x7BFF { f32::INFINITY } else { next };
        let even = if half % 2 == 0 { value(half) } else { above };
        for sign in [1.0, -1.0] {
            let round = |x: f32| sign * scalar::round(sign * x);
            assert_eq!(round(value(half)), value(half));
            assert_eq!(round(middle.next_down()), value(half), "{half:#x}");
            assert_eq!(round(middle), even, "{half:#x}");
            assert_eq!(round(middle.next_up()), above, "{half:#x}");
        }
    }
}

#[gaurast_runner::test]
fn powers_of_two_are_nearly_the_nearest() {
    let (mut worst, mut x) = (0.0f64, -14.0f32);
    while x <= 1.0 {
        let exact = f64::from(x).exp2();
        let ulp = 2.0f64.powi(exact.log2().floor() as i32 - 10);
        worst = worst.max((f64::from(scalar::exp2(x)) - exact).abs() / ulp);
        x += 1.0 / 4096.0;
    }
    assert!(worst < 0.501, "{worst} ulp");
    assert_eq!([-30.0, 0.0, 1.0, 7.0].map(scalar::exp2), [0.0, 1.0, 2.0, 2.0]);
}

#[gaurast_runner::test(each = simd_levels())]
fn it_equals_its_definition(case: &Case) {
    for seed in 40..43 {
        check(case, seed, 400, &state(), WHOLE);
    }
    let lax = GaussianState {
        alpha_floor: 0.0,
        alpha_ceiling: 1.0,
        transmittance_floor: 0.0,
        low_pass_variance: 0.0,
        ..state()
    };
    check(case, 43, 200, &lax, WHOLE);
}

#[gaurast_runner::test]
fn tiles_and_blocks_list_whatever_it_reaches() {
    let device = Device::new(&Config::default()).unwrap();
    for (seed, low_pass_variance) in [(50, 0.3), (51, 0.3), (52, 0.01)] {
        let state = GaussianState { low_pass_variance, ..state() };
        let draw = draw(seed, 600, state.clone(), &device, WHOLE);
        let mut reached = 0;
        for (group, splats) in draw.sorted.splats.iter().enumerate() {
            for (place, g) in splats.iter().enumerate() {
                for (x, y) in (0..64).flat_map(|y| (0..96).map(move |x| (x, y))) {
                    if alpha_at(&draw, g, [x, y]) < state.alpha_floor {
                        continue;
                    }
                    let list = draw.sorted.tiles.list((x / TILE) as u32, (y / TILE) as u32);
                    let named = list.iter().any(|&name| SplatIndex::new(name) == SplatIndex { group, place });
                    assert!(named, "seed {seed}: {g:?} at {x}, {y}");
                    reached += 1;
                }
            }
        }
        assert!(reached > 1000);
    }
}
