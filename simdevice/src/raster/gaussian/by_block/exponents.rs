//! Exponents in binary64 of whatever shapes there are, cut off where the draw has a cut-off.

use crate::gaussian::splats::splat::SplatIndex;
use crate::gaussian::splats::surfel::Surfel;
use crate::raster::gaussian::cut_off::BlockPlace;
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
    let place = BlockPlace { corner: inputs.corner, block };
    let lanes = cut_off.lanes(simd, index.of(inputs.splats), inputs.kernel.surfel(index), place);
    mask32x16::from_bitmask(simd, lanes).select(neg_log2_alpha, f32x16::splat(simd, CUT))
}

/// The same as [`neg_log2_alphas`], of a Gaussian that is not cut off.
#[inline(always)]
fn uncut_neg_log2_alphas<S: Simd>(simd: S, inputs: &TileInputs<'_>, index: SplatIndex, block: usize) -> f32x16<S> {
    let splat = index.of(inputs.splats);
    let Kernel::Exact { surfels: Some(surfels), inverse_low_pass, .. } = inputs.kernel else {
        return neg_log2_alphas_f64(simd, splat, inputs, block);
    };
    let surfel = index.of(surfels);
    let middle = [0, 1].map(|axis| {
        let block = [BLOCK_X[block], BLOCK_Y[block]][axis];
        (f64::from(inputs.corner[axis]) + block) - splat.mean[axis]
    });
    let opacity = f64x8::splat(simd, splat.log2_opacity.into());
    let low = half_falloff(simd, surfel, middle, inverse_low_pass, 0) - opacity;
    let high = half_falloff(simd, surfel, middle, inverse_low_pass, 8) - opacity;
    let neg_log2_alpha: f32x16<S> = low.narrow(high);
    neg_log2_alpha.max(-1.0)
}

/// The falloff of a surfel in eight of a block's lanes, from number `first` on. `middle` is the block's, from the mean.
#[inline(always)]
fn half_falloff<S: Simd>(
    simd: S,
    surfel: &Surfel,
    middle: [f64; 2],
    inverse_low_pass: Option<f64>,
    first: usize,
) -> f64x8<S> {
    let dx = f64x8::from_slice(simd, &LANE_X_64[first..first + 8]) + middle[0];
    let dy = f64x8::from_slice(simd, &LANE_Y_64[first..first + 8]) + middle[1];
    surfel.falloff(simd, dx, dy, inverse_low_pass)
}
