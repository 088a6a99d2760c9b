//! The pixels of a block in registers, and the composition of one Gaussian in them.

use super::accumulator::Accumulator;
use super::depth_ranges::DepthRanges;
use super::exponent::power;
use super::grid::{BLOCK_PIXELS, BLOCKS};
use super::inputs::Thresholds;
use super::masks::only;
use super::mode::{DepthMode, Exponential};
use crate::format::depth::DepthEncoding;
use crate::gaussian::splats::identity::Identity;
use crate::gaussian::splats::splat::SplatLook;
use fearless_simd::{Simd, f32x16, mask32x16, prelude::*, u32x16};
use isa::float::FusedMultiply;

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
        Passed { weight: t * alpha, rest: t.fused_add(-alpha, t) }
    }

    /// Adds so much of a colour.
    #[inline(always)]
    pub(super) fn add(&mut self, simd: S, weight: f32x16<S>, [red, green, blue]: [f32; 3]) {
        self.red = weight.fused_add(f32x16::splat(simd, red), self.red);
        self.green = weight.fused_add(f32x16::splat(simd, green), self.green);
        self.blue = weight.fused_add(f32x16::splat(simd, blue), self.blue);
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

/// A Gaussian as pixels show it.
#[derive(Clone, Copy)]
pub(crate) struct ShownGaussian {
    pub(crate) look: SplatLook,
    /// Zeros, if the mode does not find Gaussians.
    pub(crate) identity: Identity,
}

/// The depths and the Gaussians that a block's pixels show, as far as a mode finds them; the rest is zero.
#[derive(Clone, Copy)]
pub(crate) struct Shown<S: Simd> {
    mode: DepthMode,
    depth_unit: DepthEncoding,
    median_depth: u32x16<S>,
    depth_sum: f32x16<S>,
    weight_sum: f32x16<S>,
    nearest: u32x16<S>,
    median: u32x16<S>,
    median_z: f32x16<S>,
    z_sum: f32x16<S>,
}

impl<S: Simd> Shown<S> {
    /// The values of a block as they are in `accumulator`.
    #[inline(always)]
    pub(crate) fn load(
        accumulator: &Accumulator,
        simd: S,
        block: usize,
        mode: DepthMode,
        depth_unit: DepthEncoding,
    ) -> Self {
        let (zeros, none) = (u32x16::splat(simd, 0), f32x16::splat(simd, 0.0));
        let numbers = |found: bool, from: &[[u32; BLOCK_PIXELS]; BLOCKS]| {
            if found { u32x16::from_slice(simd, &from[block]) } else { zeros }
        };
        let floats = |found: bool, from: &[[f32; BLOCK_PIXELS]; BLOCKS]| {
            if found { f32x16::from_slice(simd, &from[block]) } else { none }
        };
        let Accumulator { means: [depths, weights], tracked, .. } = accumulator;
        Self {
            mode,
            depth_unit,
            median_depth: numbers(mode.finds_median(), &accumulator.median),
            depth_sum: floats(mode.finds_mean(), depths),
            weight_sum: floats(mode.finds_mean(), weights),
            nearest: numbers(mode.tracks(), &tracked.nearest),
            median: numbers(mode.tracks(), &tracked.median),
            median_z: floats(mode.tracks(), &tracked.median_z),
            z_sum: floats(mode.tracks(), &tracked.z_sums),
        }
    }

    /// Puts the values back.
    #[inline(always)]
    pub(crate) fn keep(self, accumulator: &mut Accumulator, block: usize) {
        let Accumulator { means: [depths, weights], tracked, .. } = accumulator;
        if self.mode.finds_median() {
            self.median_depth.store_slice(&mut accumulator.median[block]);
        }
        if self.mode.finds_mean() {
            self.depth_sum.store_slice(&mut depths[block]);
            self.weight_sum.store_slice(&mut weights[block]);
        }
        if self.mode.tracks() {
            self.nearest.store_slice(&mut tracked.nearest[block]);
            self.median.store_slice(&mut tracked.median[block]);
            self.median_z.store_slice(&mut tracked.median_z[block]);
            self.z_sum.store_slice(&mut tracked.z_sums[block]);
        }
    }

    /// True if some pixel of such transmittance may get another median or nearest Gaussian.
    #[inline(always)]
    pub(crate) fn may_choose(self, transmittance: f32x16<S>) -> bool {
        self.mode.finds_median() && transmittance.simd_ge(0.5).any_true()
    }

    /// Makes a Gaussian the median and the nearest where it is, by its `weight` and the transmittance before it.
    #[inline(always)]
    pub(crate) fn choose(
        &mut self,
        simd: S,
        transmittance: f32x16<S>,
        weight: f32x16<S>,
        ShownGaussian { look, identity }: ShownGaussian,
    ) {
        if !self.mode.finds_median() {
            return;
        }
        let is_median = only(simd, transmittance.simd_ge(0.5), weight).simd_gt(0.0);
        self.median_depth = is_median.select(u32x16::splat(simd, look.depth), self.median_depth);
        if self.mode.tracks() {
            let sequence = u32x16::splat(simd, identity.sequence);
            self.median = is_median.select(sequence, self.median);
            self.median_z = is_median.select(f32x16::splat(simd, identity.z), self.median_z);
            let is_nearest = only(simd, transmittance.simd_ge(1.0), weight).simd_gt(0.0);
            self.nearest = is_nearest.select(sequence, self.nearest);
        }
    }

    /// Adds so much of a Gaussian to the sums.
    #[inline(always)]
    pub(crate) fn add(&mut self, simd: S, weight: f32x16<S>, ShownGaussian { look, identity }: ShownGaussian) {
        if !self.mode.finds_mean() {
            return;
        }
        let depth = f32x16::splat(simd, self.depth_unit.decode(look.depth));
        self.depth_sum = weight.fused_add(depth, self.depth_sum);
        self.weight_sum += weight;
        if self.mode.tracks() {
            self.z_sum = weight.fused_add(f32x16::splat(simd, identity.z), self.z_sum);
        }
    }
}

/// Composites a Gaussian in a block, where alpha is 2 to the power of `-neg_log2_alpha`; returns how many pixels accepted it.
#[inline(always)]
pub(crate) fn accumulate<S: Simd>(
    accumulator: &mut Accumulator,
    simd: S,
    block: usize,
    neg_log2_alpha: f32x16<S>,
    gaussian: ShownGaussian,
    ranges: &DepthRanges,
    thresholds: Thresholds,
) -> u64 {
    let mut pixels = pixels(accumulator, simd, block);
    let depth_mode = thresholds.depth_mode;
    let mut shown = Shown::load(accumulator, simd, block, depth_mode, thresholds.depth_unit);
    let neg_log2_floor = f32x16::splat(simd, thresholds.neg_log2_floor);
    let reached = reached(simd, depth_mode, block, gaussian.look.depth, neg_log2_alpha, ranges, neg_log2_floor);
    let ceiling = f32x16::splat(simd, thresholds.alpha_ceiling);
    let alpha = alpha(simd, thresholds.exponential, reached, neg_log2_alpha, ceiling);
    let goes_on = composite_one(simd, &mut pixels, &mut shown, alpha, gaussian, thresholds);
    keep(accumulator, block, pixels);
    shown.keep(accumulator, block);
    let accepted = goes_on.to_bitmask() & reached.to_bitmask();
    accepted.count_ones().into()
}

/// Composites a Gaussian in a block; returns which pixels it does not finish.
///
/// A Gaussian that does not reach a pixel is composited with an alpha of zero, which changes nothing: to leave it out
/// would take longer.
#[inline(always)]
pub(crate) fn composite_one<S: Simd>(
    simd: S,
    pixels: &mut Pixels<S>,
    shown: &mut Shown<S>,
    alpha: f32x16<S>,
    gaussian: ShownGaussian,
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
    shown.choose(simd, t, weight, gaussian);
    shown.add(simd, weight, gaussian);
    pixels.add(simd, weight, gaussian.look.color);
    goes_on
}
