//! The pixels of a block in registers, and the composition of one Gaussian in them.

use super::accumulator::Accumulator;
use super::depth_ranges::DepthRanges;
use super::exponent::power;
use super::inputs::Thresholds;
use super::masks::only;
use super::mode::{DepthMode, FIND_MEAN, FIND_MEDIAN, FIND_REACHED, NO_DEPTH};
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
    /// The effect of a Gaussian of so much alpha. The transmittance behind it is rounded once, where processors can.
    #[inline(always)]
    pub(super) fn pass(&self, alpha: f32x16<S>) -> Passed<S> {
        let t = self.transmittance;
        Passed { weight: t * alpha, rest: t.mul_add(-alpha, t) }
    }

    /// Adds so much of a colour.
    #[inline(always)]
    pub(super) fn add(&mut self, simd: S, weight: f32x16<S>, [red, green, blue]: [f32; 3]) {
        self.red = weight.mul_add(f32x16::splat(simd, red), self.red);
        self.green = weight.mul_add(f32x16::splat(simd, green), self.green);
        self.blue = weight.mul_add(f32x16::splat(simd, blue), self.blue);
    }
}

/// The pixels of a block where alpha has fallen no further than it may, and the depth passes.
#[inline(always)]
pub(crate) fn reached<S: Simd>(
    simd: S,
    mode: DepthMode,
    (block, depth): (usize, u32),
    fall: f32x16<S>,
    ranges: &DepthRanges,
    most_fall: f32x16<S>,
) -> mask32x16<S> {
    let reached = fall.simd_le(most_fall);
    if mode > NO_DEPTH { reached & ranges.pixels(simd, block, depth) } else { reached }
}

/// The alphas of pixels where they have fallen so far; zero where nothing is reached: too far down, powers mean
/// nothing.
#[inline(always)]
pub(crate) fn alpha<S: Simd>(
    simd: S,
    mode: DepthMode,
    reached: mask32x16<S>,
    fall: f32x16<S>,
    ceiling: f32x16<S>,
) -> f32x16<S> {
    only(simd, reached, power(simd, mode, fall).min(ceiling))
}

/// Composites a Gaussian of a colour and a depth in a block, where alpha is 2 to the power of `-fall`; returns
/// how many pixels accepted it.
#[inline(always)]
pub(crate) fn accumulate<S: Simd>(
    accumulator: &mut Accumulator,
    simd: S,
    block: usize,
    fall: f32x16<S>,
    look: SplatLook,
    ranges: &DepthRanges,
    thresholds: Thresholds,
) -> u64 {
    let mut pixels = pixels(accumulator, simd, block);
    let most_fall = f32x16::splat(simd, thresholds.most_fall);
    let mode = thresholds.depth_mode;
    let reached = reached(simd, mode, (block, look.depth), fall, ranges, most_fall);
    let ceiling = f32x16::splat(simd, thresholds.alpha_ceiling);
    let alpha = alpha(simd, mode, reached, fall, ceiling);
    let at = (block, &mut pixels);
    let goes_on = composite_one(accumulator, simd, at, alpha, look, thresholds);
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
    (block, pixels): (usize, &mut Pixels<S>),
    alpha: f32x16<S>,
    SplatLook { color, depth }: SplatLook,
    thresholds: Thresholds,
) -> mask32x16<S> {
    let t = pixels.transmittance;
    let finished = -t.abs();
    if thresholds.depth_mode == FIND_REACHED {
        let reached = alpha.simd_gt(0.0);
        pixels.transmittance = reached.select(finished, t);
        return !reached;
    }
    let Passed { weight, rest } = pixels.pass(alpha);
    // A finished pixel's transmittance is negative, and what is left of it fails like one below the floor.
    let goes_on = rest.simd_ge(f32x16::splat(simd, thresholds.transmittance_floor));
    pixels.transmittance = goes_on.select(rest, finished);
    let weight = only(simd, goes_on, weight);
    if thresholds.depth_mode >= FIND_MEDIAN {
        let median = u32x16::from_slice(simd, &accumulator.median[block]);
        let first_half = weight.simd_gt(0.0) & t.simd_ge(0.5);
        let median = first_half.select(u32x16::splat(simd, depth), median);
        median.store_slice(&mut accumulator.median[block]);
    }
    if thresholds.depth_mode == FIND_MEAN {
        let depth = f32x16::splat(simd, thresholds.depth_unit.decode(depth));
        let [depths, weights] = &mut accumulator.means;
        let sum = f32x16::from_slice(simd, &depths[block]);
        weight.mul_add(depth, sum).store_slice(&mut depths[block]);
        let sum = f32x16::from_slice(simd, &weights[block]) + weight;
        sum.store_slice(&mut weights[block]);
    }
    pixels.add(simd, weight, color);
    goes_on
}
