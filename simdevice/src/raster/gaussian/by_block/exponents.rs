//! Exponents in binary64 of whatever shapes there are, cut off where the draw has a cut-off.

use crate::raster::gaussian::exponent::falls_64;
use crate::raster::gaussian::grid::{BLOCK_X, BLOCK_Y, LANE_X_64, LANE_Y_64};
use crate::raster::gaussian::inputs::TileInputs;
use crate::raster::gaussian::kernel::Kernel;
use fearless_simd::{Simd, f32x16, f64x8, mask32x16, prelude::*};

/// The fall of an alpha where a Gaussian is cut off: greater than that of any that contributes.
const CUT: f32 = 1e3;

/// The fall of a primitive's alpha at a block's pixels: minus its base-2 logarithm.
#[inline(always)]
pub(crate) fn falls<S: Simd>(
    simd: S,
    task: &TileInputs<'_>,
    (batch, place): (usize, usize),
    block: usize,
) -> f32x16<S> {
    let fall = whole_falls(simd, task, (batch, place), block);
    let Some(cut_off) = task.mode.cut_off() else {
        return fall;
    };
    let lanes = cut_off.lanes(&task.splats[batch][place], task.corner, block);
    mask32x16::from_bitmask(simd, lanes.into()).select(fall, f32x16::splat(simd, CUT))
}

/// As [`falls`], of a primitive that is not cut off.
#[inline(always)]
fn whole_falls<S: Simd>(simd: S, task: &TileInputs<'_>, (batch, place): (usize, usize), block: usize) -> f32x16<S> {
    let splat = &task.splats[batch][place];
    let Kernel::Exact { surfels: Some(surfels), inverse_low_pass, .. } = task.mode else {
        return falls_64(simd, splat, task, block);
    };
    let surfel = &surfels[batch][place];
    let from_mean = |axis: usize, block: f64| (f64::from(task.corner[axis]) + block) - splat.mean[axis];
    let middle = [from_mean(0, BLOCK_X[block]), from_mean(1, BLOCK_Y[block])];
    let opacity = f64x8::splat(simd, splat.log2_opacity.into());
    let fall = |first: usize| {
        let dx = f64x8::from_slice(simd, &LANE_X_64[first..first + 8]) + middle[0];
        let dy = f64x8::from_slice(simd, &LANE_Y_64[first..first + 8]) + middle[1];
        surfel.falloff(simd, dx, dy, inverse_low_pass) - opacity
    };
    let fall: f32x16<S> = fall(0).narrow(fall(8));
    fall.max(-1.0)
}
