//! The pixels of a block in registers, and the composition of one Gaussian in them.

use super::accumulator::Accumulator;
use super::depth_ranges::DepthRanges;
use super::exponent::power;
use super::inputs::Thresholds;
use super::masks::only;
use super::mode::{DepthMode, Exponential};
use crate::gaussian::splats::splat::SplatLook;
use fearless_simd::{Simd, f32x16, mask32x16, prelude::*, u32x16};

/// The sums of a block's pixels.
///
/// Nothing here is indexed or iterated over, or it would leave the registers.
#[derive(Clone, Copy)]
pub(crate) struct Pixels<S: Simd> {
    red: f32x16<S>,
    green: f32x16<S>,
    blue: f32x16<S>,
    pub(super) transmittance: f32x16<S>,
}

/// A Gaussian's effect on a block's pixels.
pub(crate) struct Passed<S: Simd> {
    /// Its contribution.
    pub(super) weight: f32x16<S>,
    /// The transmittance behind it.
    pub(super) rest: f32x16<S>,
}

/// A block's pixels as they are, before any of a round.
#[inline(always)]
pub(crate) fn pixels<S: Simd>(accumulator: &Accumulator, simd: S, block: usize) -> Pixels<S> {
    let [r, g, b] = &accumulator.color;
    Pixels {
        red: f32x16::from_slice(simd, &r[block]),
        green: f32x16::from_slice(simd, &g[block]),
        blue: f32x16::from_slice(simd, &b[block]),
        transmittance: f32x16::from_slice(simd, &accumulator.transmittance[block]),
    }
}

/// Puts a block's pixels back.
#[inline(always)]
pub(crate) fn keep<S: Simd>(accumulator: &mut Accumulator, block: usize, pixels: Pixels<S>) {
    let [r, g, b] = &mut accumulator.color;
    pixels.red.store_slice(&mut r[block]);
    pixels.green.store_slice(&mut g[block]);
    pixels.blue.store_slice(&mut b[block]);
    pixels.transmittance.store_slice(&mut accumulator.transmittance[block]);
}

impl<S: Simd> Pixels<S> {
    /// The effect of a Gaussian of so much alpha. The transmittance behind it is rounded once.
    #[inline(always)]
    pub(super) fn pass(&self, alpha: f32x16<S>) -> Passed<S> {
        let t = self.transmittance;
        Passed { weight: t * alpha, rest: t.mul_add_precise(-alpha, t) }
    }

    /// Adds so much of a colour.
    #[inline(always)]
    pub(super) fn add(&mut self, simd: S, weight: f32x16<S>, [red, green, blue]: [f32; 3]) {
        self.red = weight.mul_add_precise(f32x16::splat(simd, red), self.red);
        self.green = weight.mul_add_precise(f32x16::splat(simd, green), self.green);
        self.blue = weight.mul_add_precise(f32x16::splat(simd, blue), self.blue);
    }
}

/// The pixels of a block where alpha is not below the floor, and the depth passes.
#[inline(always)]
pub(crate) fn reached<S: Simd>(
    simd: S,
    depth_mode: DepthMode,
    block: usize,
    depth: u32,
    neg_log2_alpha: f32x16<S>,
    ranges: &DepthRanges,
    neg_log2_floor: f32x16<S>,
) -> mask32x16<S> {
    let reached = neg_log2_alpha.simd_le(neg_log2_floor);
    if depth_mode.tests() { reached & ranges.pixels(simd, block, depth) } else { reached }
}

/// The alphas of pixels, at most `ceiling`; zero where they are not `reached`: powers of such exponents are undefined.
#[inline(always)]
pub(crate) fn alpha<S: Simd>(
    simd: S,
    exponential: Exponential,
    reached: mask32x16<S>,
    neg_log2_alpha: f32x16<S>,
    ceiling: f32x16<S>,
) -> f32x16<S> {
    only(simd, reached, power(simd, exponential, neg_log2_alpha).min(ceiling))
}

/// Composites a Gaussian of a colour and a depth in a block, where alpha is 2 to the power of `-neg_log2_alpha`; returns
/// how many pixels accepted it.
#[inline(always)]
pub(crate) fn accumulate<S: Simd>(
    accumulator: &mut Accumulator,
    simd: S,
    block: usize,
    neg_log2_alpha: f32x16<S>,
    look: SplatLook,
    ranges: &DepthRanges,
    thresholds: Thresholds,
) -> u64 {
    let mut pixels = pixels(accumulator, simd, block);
    let neg_log2_floor = f32x16::splat(simd, thresholds.neg_log2_floor);
    let depth_mode = thresholds.depth_mode;
    let reached = reached(simd, depth_mode, block, look.depth, neg_log2_alpha, ranges, neg_log2_floor);
    let ceiling = f32x16::splat(simd, thresholds.alpha_ceiling);
    let alpha = alpha(simd, thresholds.exponential, reached, neg_log2_alpha, ceiling);
    let goes_on = composite_one(accumulator, simd, block, &mut pixels, alpha, look, thresholds);
    keep(accumulator, block, pixels);
    let accepted = goes_on.to_bitmask() & reached.to_bitmask();
    accepted.count_ones().into()
}

/// Composites a Gaussian of a colour and a depth in a block; returns which pixels it does not finish.
///
/// A Gaussian that does not reach a pixel is composited with an alpha of zero, which changes nothing: to leave it out
/// would take longer.
#[inline(always)]
pub(crate) fn composite_one<S: Simd>(
    accumulator: &mut Accumulator,
    simd: S,
    block: usize,
    pixels: &mut Pixels<S>,
    alpha: f32x16<S>,
    SplatLook { color, depth }: SplatLook,
    thresholds: Thresholds,
) -> mask32x16<S> {
    let t = pixels.transmittance;
    let finished = -t.abs();
    if thresholds.depth_mode.finds_reached() {
        let reached = alpha.simd_gt(0.0);
        pixels.transmittance = reached.select(finished, t);
        return !reached;
    }
    let Passed { weight, rest } = pixels.pass(alpha);
    // A finished pixel's transmittance is negative, and what is left of it fails like one below the floor.
    let goes_on = rest.simd_ge(f32x16::splat(simd, thresholds.transmittance_floor));
    pixels.transmittance = goes_on.select(rest, finished);
    let weight = only(simd, goes_on, weight);
    if thresholds.depth_mode.finds_median() {
        let median = u32x16::from_slice(simd, &accumulator.median[block]);
        let first_half = weight.simd_gt(0.0) & t.simd_ge(0.5);
        let median = first_half.select(u32x16::splat(simd, depth), median);
        median.store_slice(&mut accumulator.median[block]);
    }
    if thresholds.depth_mode.finds_mean() {
        let depth = f32x16::splat(simd, thresholds.depth_unit.decode(depth));
        let [depths, weights] = &mut accumulator.means;
        let sum = f32x16::from_slice(simd, &depths[block]);
        weight.mul_add_precise(depth, sum).store_slice(&mut depths[block]);
        let sum = f32x16::from_slice(simd, &weights[block]) + weight;
        sum.store_slice(&mut weights[block]);
    }
    pixels.add(simd, weight, color);
    goes_on
}
