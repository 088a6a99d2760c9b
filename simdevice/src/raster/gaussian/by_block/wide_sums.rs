//! The kernel of sums in binary64, for draws whose floors let more layers be seen through each other than the usual ones do.
//!
//! Each layer rounds the transmittance and the colour of a pixel. With the usual floors a pixel ends before that
//! is worth much; without them errors of thousands of layers add up beyond the contract. A block's whole list is
//! worked off at once here, so that its sums stay at hand and are rounded to binary32 only in the end.

use super::block_kernel::BlockKernel;
use super::exponents::neg_log2_alphas;
use crate::gaussian::splats::splat::{SplatIndex, SplatLook};
use crate::raster::gaussian::accumulator::Accumulator;
use crate::raster::gaussian::grid::BLOCK_PIXELS;
use crate::raster::gaussian::inputs::TileInputs;
use crate::simd::exp2::exp2_of_negated;
use fearless_simd::{Simd, f32x16, f64x8, mask64x8, prelude::*};
use isa::float::FusedMultiply;

/// Compositing in the order of the list, by sums in binary64.
pub(crate) struct WideSums(Sums);

impl WideSums {
    /// Sums of no block yet.
    pub(crate) fn new() -> Self {
        Self(Sums { color: [[0.0; BLOCK_PIXELS]; 3], transmittance: [0.0; BLOCK_PIXELS] })
    }
}

impl BlockKernel for WideSums {
    #[inline(always)]
    fn begin(&mut self, accumulator: &Accumulator, block: usize) {
        self.0 = Sums::load(accumulator, block);
    }

    #[inline(always)]
    fn is_open(&self, _: &Accumulator, _: usize) -> bool {
        self.0.is_open()
    }

    #[inline(always)]
    fn composite<S: Simd>(
        &mut self,
        simd: S,
        inputs: &TileInputs<'_>,
        index: SplatIndex,
        accumulator: &mut Accumulator,
        block: usize,
    ) -> u64 {
        let splat = index.of(inputs.splats);
        let neg_log2_alpha = neg_log2_alphas(simd, inputs, index, block);
        accumulate(accumulator, &mut self.0, simd, block, neg_log2_alpha, splat.look, inputs)
    }

    #[inline(always)]
    fn end(&mut self, accumulator: &mut Accumulator, block: usize) {
        self.0.store(accumulator, block);
    }
}

/// The sums of a block's pixels; signs of transmittances as in [`Accumulator`].
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Sums {
    color: [[f64; BLOCK_PIXELS]; 3],
    transmittance: [f64; BLOCK_PIXELS],
}

/// The lanes of a block that accept a Gaussian, and its weights there; elsewhere they are zero.
struct Accepted<Weights> {
    weights: Weights,
    /// A bit for each.
    lanes: u64,
}

impl Sums {
    fn load(accumulator: &Accumulator, block: usize) -> Self {
        Self {
            color: [0, 1, 2].map(|channel| accumulator.color[channel][block].map(f64::from)),
            transmittance: accumulator.transmittance[block].map(f64::from),
        }
    }

    fn store(&self, accumulator: &mut Accumulator, block: usize) {
        for (channel, color) in accumulator.color.iter_mut().zip(&self.color) {
            channel[block] = color.map(|color| color as f32);
        }
        accumulator.transmittance[block] = self.transmittance.map(|t| t as f32);
    }

    /// True if a pixel is not finished.
    fn is_open(&self) -> bool {
        self.transmittance.iter().any(|t| t.is_sign_positive())
    }

    /// Composites what has an alpha and a colour in the lanes of `reached`, and marks those that it finishes. Returns
    /// what the pixels accept.
    #[inline(always)]
    fn add<S: Simd>(
        &mut self,
        simd: S,
        alpha: f32x16<S>,
        color: [f32; 3],
        reached: u64,
        floor: f32,
    ) -> Accepted<f32x16<S>> {
        let alphas = alpha.widen();
        let low = self.add_half(simd, 0, alphas.0, color, reached, floor);
        let high = self.add_half(simd, BLOCK_PIXELS / 2, alphas.1, color, reached, floor);
        Accepted { weights: low.weights.narrow(high.weights), lanes: low.lanes | high.lanes }
    }

    /// Does what [`Sums::add`] does, in half of the lanes.
    #[inline(always)]
    fn add_half<S: Simd>(
        &mut self,
        simd: S,
        first: usize,
        alpha: f64x8<S>,
        color: [f32; 3],
        reached: u64,
        floor: f32,
    ) -> Accepted<f64x8<S>> {
        let lanes = first..first + BLOCK_PIXELS / 2;
        let reached = mask64x8::from_bitmask(simd, reached >> first & 0xff);
        let t = f64x8::from_slice(simd, &self.transmittance[lanes.clone()]);
        let weight = t * alpha;
        let rest = t - weight;
        // As in the fast kernel: a finished pixel's transmittance is negative, and what is left of it fails.
        let accepted = reached & rest.simd_ge(f64x8::splat(simd, floor.into()));
        let t = accepted.select(rest, reached.select(-t.abs(), t));
        t.store_slice(&mut self.transmittance[lanes.clone()]);
        let weight = accepted.select(weight, f64x8::splat(simd, 0.0));
        for (sum, color) in self.color.iter_mut().zip(color) {
            // Not fused, so that all levels agree.
            let part = weight * f64::from(color);
            let all = f64x8::from_slice(simd, &sum[lanes.clone()]) + part;
            all.store_slice(&mut sum[lanes.clone()]);
        }
        Accepted { weights: weight, lanes: accepted.to_bitmask() << first }
    }
}

/// Composites a Gaussian of a colour and a depth in a block, where alpha is 2 to the power of `-neg_log2_alpha`; returns how many
/// pixels accepted it. Colours and transmittances are in `sums`, depths in `accumulator`.
#[inline(always)]
fn accumulate<S: Simd>(
    accumulator: &mut Accumulator,
    sums: &mut Sums,
    simd: S,
    block: usize,
    neg_log2_alpha: f32x16<S>,
    SplatLook { color, depth }: SplatLook,
    inputs: &TileInputs<'_>,
) -> u64 {
    let thresholds = &inputs.thresholds;
    let ceiling = f32x16::splat(simd, thresholds.alpha_ceiling);
    let alpha = exp2_of_negated(simd, neg_log2_alpha).min(ceiling);
    let mut reached = neg_log2_alpha.simd_le(f32x16::splat(simd, thresholds.neg_log2_floor));
    if thresholds.depth_mode.tests() {
        reached &= inputs.ranges.pixels(simd, block, depth);
    }
    // Where it is not reached, alpha is undefined.
    let alpha = reached.select(alpha, f32x16::splat(simd, 0.0));
    let before = sums.transmittance;
    let floor = thresholds.transmittance_floor;
    let Accepted { weights: weight, lanes: accepted } = sums.add(simd, alpha, color, reached.to_bitmask(), floor);
    if thresholds.depth_mode.finds_median() {
        for (lane, (median, t)) in accumulator.median[block].iter_mut().zip(before).enumerate() {
            if accepted >> lane & 1 == 1 && t >= 0.5 {
                *median = depth;
            }
        }
    }
    if thresholds.depth_mode.finds_mean() {
        let depth = f32x16::splat(simd, thresholds.depth_unit.decode(depth));
        let [depths, weights] = &mut accumulator.means;
        let sum = f32x16::from_slice(simd, &depths[block]);
        weight.fused_add(depth, sum).store_slice(&mut depths[block]);
        let sum = f32x16::from_slice(simd, &weights[block]) + weight;
        sum.store_slice(&mut weights[block]);
    }
    accumulator.covered[block] |= accepted as u32;
    u64::from(accepted.count_ones())
}
