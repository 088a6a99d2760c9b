//! Exponents in binary64 of whatever shapes there are, cut off where the draw has a cut-off.

use crate::gaussian::splats::splat::SplatIndex;
use crate::raster::gaussian::exponent::neg_log2_alphas_f64;
use crate::raster::gaussian::grid::{BLOCK_X, BLOCK_Y, LANE_X_64, LANE_Y_64};
use crate::raster::gaussian::inputs::TileInputs;
use crate::raster::gaussian::kernel::Kernel;
use fearless_simd::{Simd, f32x16, f64x8, mask32x16, prelude::*};

/// Minus the base-2 logarithm of the alpha where a Gaussian is cut off: greater than that of any alpha that contributes.
const CUT: f32 = 1e3;

/// Minus the base-2 logarithms of a Gaussian's alphas at a block's pixels.
#[inline(always)]
pub(crate) fn neg_log2_alphas<S: Simd>(simd: S, inputs: &TileInputs<'_>, index: SplatIndex, block: usize) -> f32x16<S> {
    let neg_log2_alpha = uncut_neg_log2_alphas(simd, inputs, index, block);
    let Some(cut_off) = inputs.kernel.cut_off() else {
        return neg_log2_alpha;
    };
    let lanes = cut_off.lanes(index.of(inputs.splats), inputs.corner, block);
    mask32x16::from_bitmask(simd, lanes.into()).select(neg_log2_alpha, f32x16::splat(simd, CUT))
}

/// The same as [`neg_log2_alphas`], of a Gaussian that is not cut off.
#[inline(always)]
fn uncut_neg_log2_alphas<S: Simd>(simd: S, inputs: &TileInputs<'_>, index: SplatIndex, block: usize) -> f32x16<S> {
    let splat = index.of(inputs.splats);
    let Kernel::Exact { surfels: Some(surfels), inverse_low_pass, .. } = inputs.kernel else {
        return neg_log2_alphas_f64(simd, splat, inputs, block);
    };
    let surfel = index.of(surfels);
    let from_mean = |axis: usize, block: f64| (f64::from(inputs.corner[axis]) + block) - splat.mean[axis];
    let middle = [from_mean(0, BLOCK_X[block]), from_mean(1, BLOCK_Y[block])];
    let opacity = f64x8::splat(simd, splat.log2_opacity.into());
    let half = |first: usize| {
        let dx = f64x8::from_slice(simd, &LANE_X_64[first..first + 8]) + middle[0];
        let dy = f64x8::from_slice(simd, &LANE_Y_64[first..first + 8]) + middle[1];
        surfel.falloff(simd, dx, dy, inverse_low_pass) - opacity
    };
    let neg_log2_alpha: f32x16<S> = half(0).narrow(half(8));
    neg_log2_alpha.max(-1.0)
}
