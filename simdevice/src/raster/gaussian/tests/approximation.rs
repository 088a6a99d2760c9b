//! Approximations that a draw permits keep their bounds.

use super::*;
use crate::simd::exp2::{CUBIC, Powers, QUADRATIC};
use crate::state::gaussian::GaussianApproximation;

/// The worst relative error of a polynomial's powers of two at a level, over all neg_log2_alphas that it is for.
fn worst_error<const TERMS: usize>(powers: &Powers<TERMS>, level: Level) -> f64 {
    let mut worst = 0.0f64;
    let mut first = -4.0f32;
    while first < 125.9 {
        let neg_log2_alphas: [f32; BLOCK_PIXELS] = std::array::from_fn(|lane| first + lane as f32 / 4096.0);
        let found = dispatch!(level, simd =>
            powers.of_negated(simd, f32x16::simd_from(simd, neg_log2_alphas)).to_array());
        for (neg_log2_alpha, power) in neg_log2_alphas.into_iter().zip(found) {
            let exact = f64::from(-neg_log2_alpha).exp2();
            worst = worst.max((f64::from(power) / exact - 1.0).abs());
        }
        first += 16.0 / 4096.0;
    }
    worst
}

#[gaurast_runner::test(each = simd_levels())]
fn powers_of_fewer_terms_are_within_their_bounds(case: &Case) {
    let level = token_of(case);
    for (worst, bound) in [(worst_error(&CUBIC, level), CUBIC.error), (worst_error(&QUADRATIC, level), QUADRATIC.error)]
    {
        let bound = f64::from(bound);
        assert!(worst <= bound, "{worst:e} exceeds {bound:e}");
        // A bound that is far off would refuse these powers where they may be used.
        assert!(worst > 0.9 * bound, "{worst:e}, not {bound:e}");
    }
}

fn allowing(exponential_error: f32, contribution_budget: f32) -> GaussianState {
    GaussianState { approximation: GaussianApproximation { exponential_error, contribution_budget }, ..defaults() }
}

#[gaurast_runner::test(each = simd_levels())]
fn the_kernel_with_fast_powers_equals_its_naive_twin(case: &Case) {
    for seed in 0..2 {
        check(case, seed, 400, &allowing(1e-4, 0.0), WHOLE);
        check(case, seed, 400, &allowing(1.0, 0.0), WHOLE);
    }
    // What allows less than the cubic's error is exact.
    check(case, 3, 400, &allowing(7e-5, 0.0), WHOLE);
}

/// Pixels, and blocks that were left out.
fn picture(device: &Device, count: u32, state: GaussianState) -> (Vec<Option<[f32; 4]>>, f32, u64) {
    let draw = draw(50, count, state, device, WHOLE);
    let colors = draw.sorted.splats.iter().flatten().flat_map(|splat| splat.look.color);
    let range = colors.fold(0.0, f32::max);
    let mut tile = Box::new(GaussianTile::default());
    let mut counters = Counters::default();
    let mut pixels = Vec::new();
    for (y, x) in (0..4).flat_map(|y| (0..6).map(move |x| (y, x))) {
        tile.render(&draw, device.level(), x, y, &mut counters);
        let all = (0..TILE * TILE).map(|at| tile.pixel(at % TILE, at / TILE));
        pixels.extend(all);
    }
    (pixels, range, counters.get(Counter::BlocksLeftOut))
}

#[gaurast_runner::test(each = simd_levels())]
fn what_is_left_out_is_within_the_budget(case: &Case) {
    let device = device_of(case);
    let (exact, range, none) = picture(&device, 3000, defaults());
    assert_eq!(none, 0);
    for budget in [0.004, 0.05, 0.4] {
        let (pixels, _, left_out) = picture(&device, 3000, allowing(0.0, budget));
        assert!(left_out > 0, "{budget}");
        let mut worst = [0.0f32; 2];
        for (exact, pixel) in exact.iter().zip(&pixels) {
            assert_eq!(exact.is_some(), pixel.is_some());
            let [exact, pixel] = [exact, pixel].map(|pixel| pixel.unwrap_or_default());
            for (channel, (exact, pixel)) in exact.into_iter().zip(pixel).enumerate() {
                let worst = &mut worst[usize::from(channel == 3)];
                *worst = worst.max((exact - pixel).abs());
            }
        }
        let [color, alpha] = worst;
        assert!(color > 0.0, "{budget}: it is the same picture");
        assert!(color <= budget * range + 1e-5, "{budget}: {color}");
        assert!(alpha <= budget + 1e-6, "{budget}: {alpha}");
    }
}

#[gaurast_runner::test]
fn skips_that_are_off_leave_nothing_out() {
    let device = Device::new(&Config { optimizations: Optimizations::NONE, ..Config::default() }).unwrap();
    let exact = picture(&device, 1000, defaults());
    assert_eq!(picture(&device, 1000, allowing(0.0, 0.4)), exact);
}
