//! Exponents of alphas at a block's pixels, and their powers.

use super::grid::{BLOCK_X, BLOCK_Y, LANE_X_64, LANE_Y_64};
use super::inputs::TileInputs;
use super::mode::{DepthMode, FAST_POWERS, FASTER_POWERS};
use crate::gaussian::splats::splat::Splat;
use crate::simd::exp2::{CUBIC, QUADRATIC, exp2_of_negated};
use fearless_simd::{Simd, f32x16, f64x8, prelude::*};

/// 2 to the power of `-fall`, as a mode has it.
#[inline(always)]
pub(crate) fn power<S: Simd>(simd: S, mode: DepthMode, fall: f32x16<S>) -> f32x16<S> {
    match mode {
        FAST_POWERS => CUBIC.of_negated(simd, fall),
        FASTER_POWERS => QUADRATIC.of_negated(simd, fall),
        _ => exp2_of_negated(simd, fall),
    }
}

/// The fall of a Gaussian's alpha at a block's pixels, formed in binary64: minus its base-2 logarithm, but no less
/// than -1, which is more than any ceiling, and still a power that is formed.
///
/// A Gaussian wider than the period of a panorama counts where it is nearer than its copies.
#[inline(always)]
pub(crate) fn falls_64<S: Simd>(simd: S, splat: &Splat, task: &TileInputs<'_>, block: usize) -> f32x16<S> {
    let [a, b, c] = splat.factor;
    let from_mean = |axis: usize, block: f64| (f64::from(task.corner[axis]) + block) - splat.mean[axis];
    let opacity = f64x8::splat(simd, splat.log2_opacity.into());
    let half_period = if splat.exceeds_period { task.half_period } else { f64::INFINITY };
    let within = f64x8::splat(simd, half_period);
    let nothing = f64x8::splat(simd, 1e3);
    let middle = [from_mean(0, BLOCK_X[block]), from_mean(1, BLOCK_Y[block])];
    let fall = |first: usize| {
        let dx = f64x8::from_slice(simd, &LANE_X_64[first..first + 8]) + middle[0];
        let dy = f64x8::from_slice(simd, &LANE_Y_64[first..first + 8]) + middle[1];
        let (u, v) = (dx * a, dx * b + dy * c);
        let fall = u * u + v * v - opacity;
        let inside = dx.simd_ge(-within) & dx.simd_lt(within);
        inside.select(fall, nothing)
    };
    let fall: f32x16<S> = fall(0).narrow(fall(8));
    fall.max(-1.0)
}
