//! The blocks of a tile that a Gaussian may reach.

use super::grid::{BlockMiddles, HALF};
use super::inputs::TileInputs;
use crate::gaussian::splats::splat::Splat;
use crate::stats::optimizations::Optimization;
use fearless_simd::{Simd, f32x8, f64x4, mask32x16, prelude::*};
use isa::float::FusedMultiply;

/// A bound of rounding's effect on exponents, relative to them.
pub(crate) const RANGE_FACTOR: f32 = 1.0 + 1e-5;

/// The blocks of a tile that a Gaussian may reach, as [`StagedRound::place`] finds them for several at a time.
#[inline(always)]
pub(crate) fn reached_blocks<S: Simd>(
    simd: S,
    splat: &Splat,
    middles: &BlockMiddles,
    neg_log2_floor: f32,
) -> mask32x16<S> {
    let [a, b, c] = splat.factor;
    // In each column of blocks, and each row.
    let dx = f64x4::from_slice(simd, &middles.x) - splat.mean[0];
    let dy = f64x4::from_slice(simd, &middles.y) - splat.mean[1];
    let (u, v_of_column, v_of_row) = (dx * a, dx * b, dy * c);
    let u: f32x8<S> = u.narrow(u);
    // No closure: one that is not inlined would be compiled without the SIMD level's instructions.
    let rows =
        [v_of_column + v_of_row[0], v_of_column + v_of_row[1], v_of_column + v_of_row[2], v_of_column + v_of_row[3]];
    let upper: f32x8<S> = rows[0].narrow(rows[1]);
    let lower: f32x8<S> = rows[2].narrow(rows[3]);
    let v = upper.combine(lower);
    let [a, b, c] = [a as f32, b as f32, c as f32];
    let log2_opacity = f32x8::splat(simd, splat.log2_opacity);
    let factor = f32x8::splat(simd, RANGE_FACTOR);
    let log2_range = log2_opacity.fused_add(factor, f32x8::splat(simd, neg_log2_floor * RANGE_FACTOR + 1e-3));
    let least_u = (u.abs() - HALF * a.abs()).max(0.0);
    let least_v = (v.abs() - HALF * (b.abs() + c.abs())).max(0.0);
    let least_u = least_u * least_u;
    let least = least_v.fused_add(least_v, least_u.combine(least_u));
    least.simd_le(log2_range.combine(log2_range))
}

/// The number of `open` blocks of a tile in which a Gaussian would be evaluated if depths did not hide it.
#[inline(always)]
pub(crate) fn hidden_blocks<S: Simd>(simd: S, splat: &Splat, inputs: &TileInputs<'_>, open: mask32x16<S>) -> u32 {
    let bounded = inputs.optimizations.has(Optimization::Blocks) && !splat.needs_f64;
    let reached = if bounded {
        let neg_log2_floor = inputs.thresholds.neg_log2_floor;
        let middles = BlockMiddles::new(inputs.corner);
        open & reached_blocks(simd, splat, &middles, neg_log2_floor)
    } else {
        open
    };
    reached.to_bitmask().count_ones()
}
