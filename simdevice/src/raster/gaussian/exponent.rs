//! Alphas as powers of two. An alpha is 2 to the power of minus a number, its *negated base-2 logarithm*
//! (`neg_log2_alpha`): the exponent of the Gaussian, less the logarithm of the opacity.

use super::grid::{BLOCK_X, BLOCK_Y, LANE_X_64, LANE_Y_64};
use super::inputs::TileInputs;
use super::mode::Exponential;
use crate::gaussian::splats::splat::Splat;
use crate::simd::exp2::{CUBIC, QUADRATIC, exp2_of_negated};
use fearless_simd::{Simd, f32x16, f64x8, prelude::*};

/// 2 to the power of `-neg_log2_alpha`.
#[inline(always)]
pub(crate) fn power<S: Simd>(simd: S, exponential: Exponential, neg_log2_alpha: f32x16<S>) -> f32x16<S> {
    match exponential {
        Exponential::Cubic => CUBIC.of_negated(simd, neg_log2_alpha),
        Exponential::Quadratic => QUADRATIC.of_negated(simd, neg_log2_alpha),
        Exponential::Exact => exp2_of_negated(simd, neg_log2_alpha),
    }
}

/// Minus the base-2 logarithms of a Gaussian's alphas at a block's pixels, formed in binary64. They are no less than -1: that is the
/// alpha 2, which exceeds any ceiling.
///
/// A Gaussian wider than the period of a panorama counts where it is nearer than its copies.
#[inline(always)]
pub(crate) fn neg_log2_alphas_f64<S: Simd>(simd: S, splat: &Splat, inputs: &TileInputs<'_>, block: usize) -> f32x16<S> {
    let middle = [0, 1].map(|axis| {
        let block = [BLOCK_X[block], BLOCK_Y[block]][axis];
        (f64::from(inputs.corner[axis]) + block) - splat.mean[axis]
    });
    let half_period = if splat.exceeds_period { inputs.half_period } else { f64::INFINITY };
    let low = half_neg_log2_alphas(simd, splat, middle, half_period, 0);
    let high = half_neg_log2_alphas(simd, splat, middle, half_period, 8);
    let neg_log2_alpha: f32x16<S> = low.narrow(high);
    neg_log2_alpha.max(-1.0)
}

/// The same as [`neg_log2_alphas_f64`] for eight of the lanes from number `first` on, of any size and in binary64. `middle` is the
/// block's, from the mean.
#[inline(always)]
fn half_neg_log2_alphas<S: Simd>(simd: S, splat: &Splat, middle: [f64; 2], half_period: f64, first: usize) -> f64x8<S> {
    let [a, b, c] = splat.factor;
    let within = f64x8::splat(simd, half_period);
    let dx = f64x8::from_slice(simd, &LANE_X_64[first..first + 8]) + middle[0];
    let dy = f64x8::from_slice(simd, &LANE_Y_64[first..first + 8]) + middle[1];
    let (u, v) = (dx * a, dx * b + dy * c);
    let neg_log2_alpha = u * u + v * v - f64x8::splat(simd, splat.log2_opacity.into());
    let inside = dx.simd_ge(-within) & dx.simd_lt(within);
    inside.select(neg_log2_alpha, f64x8::splat(simd, 1e3))
}
