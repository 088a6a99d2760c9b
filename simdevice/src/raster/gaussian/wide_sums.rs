//! Sums in binary64, for draws whose floors let more layers be seen through each other than the usual ones do.
//!
//! Each layer rounds the transmittance and the colour of a pixel. With the usual floors a pixel ends before that is
//! worth much; without them errors of thousands of layers add up beyond the contract. A block's whole list is worked off
//! at once here, so that its sums stay at hand and are rounded to binary32 only in the end.

use super::layer::Layer;
use super::passing::Passing;
use super::{
    BLOCKS, CHUNK, FIND_MEAN, FIND_MEDIAN, GaussianTile, LANES, NO_DEPTH, Task, Thresholds, Work,
    locate,
};
use crate::simd::exp2::exp2_of_negated;
use crate::state::gaussian::GaussianState;
use crate::stats::optimizations::Skip;
use crate::stats::recorder::Run;
use fearless_simd::{Simd, f32x16, f64x8, mask64x8, prelude::*};

/// Whether a draw's floors let more layers be seen than the usual ones.
pub(super) fn pays(state: &GaussianState) -> bool {
    let usual = GaussianState::default();
    state.transmittance_floor < usual.transmittance_floor || state.alpha_floor < usual.alpha_floor
}

/// What the pixels of a block accumulate; signs of transmittances as in [`Layer`].
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Sums {
    color: [[f64; LANES]; 3],
    transmittance: [f64; LANES],
}

impl Sums {
    fn load(layer: &Layer, block: usize) -> Self {
        Self {
            color: [0, 1, 2].map(|channel| layer.color[channel][block].map(f64::from)),
            transmittance: layer.transmittance[block].map(f64::from),
        }
    }

    fn store(&self, layer: &mut Layer, block: usize) {
        for (channel, color) in layer.color.iter_mut().zip(&self.color) {
            channel[block] = color.map(|color| color as f32);
        }
        layer.transmittance[block] = self.transmittance.map(|t| t as f32);
    }

    /// Whether a pixel is not finished.
    fn is_open(&self) -> bool {
        self.transmittance.iter().any(|t| t.is_sign_positive())
    }

    /// Composites what has an alpha and a colour in the lanes of `reached`, and marks those that it finishes. Returns
    /// the weights, and in which lanes it is accepted.
    #[inline(always)]
    fn add<S: Simd>(
        &mut self,
        simd: S,
        alpha: f32x16<S>,
        color: [f32; 3],
        reached: u64,
        floor: f32,
    ) -> (f32x16<S>, u64) {
        let alphas = alpha.widen();
        let low = self.add_half(simd, 0, alphas.0, color, reached, floor);
        let high = self.add_half(simd, LANES / 2, alphas.1, color, reached, floor);
        (low.0.narrow(high.0), low.1 | high.1)
    }

    /// As [`Sums::add`], in half of the lanes.
    #[inline(always)]
    fn add_half<S: Simd>(
        &mut self,
        simd: S,
        first: usize,
        alpha: f64x8<S>,
        color: [f32; 3],
        reached: u64,
        floor: f32,
    ) -> (f64x8<S>, u64) {
        let lanes = first..first + LANES / 2;
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
        (weight, accepted.to_bitmask() << first)
    }
}

impl GaussianTile {
    /// Composites a tile in the order of its list.
    #[inline(always)]
    pub(super) fn composite_wide<S: Simd>(
        &mut self,
        simd: S,
        task: &Task<'_>,
        layer: usize,
        runs: Option<&mut Vec<Run>>,
    ) -> Work {
        let mut work = self.part(simd, task, layer, runs);
        let layer = &mut self.layers[layer];
        for block in 0..BLOCKS {
            let mut sums = Sums::load(layer, block);
            for chunk in self.lists[block].chunks(CHUNK) {
                if task.skips.has(Skip::Saturated) && !sums.is_open() {
                    break;
                }
                for &primitive in chunk {
                    let (batch, place) = locate(primitive);
                    let splat = &task.splats[batch][place];
                    let fall = task.falls(simd, (batch, place), block);
                    let look = (splat.color, splat.depth);
                    work.contributions += layer.accumulate_wide(
                        simd,
                        (block, &mut sums),
                        fall,
                        look,
                        &self.passing,
                        task.thresholds,
                    );
                }
            }
            sums.store(layer, block);
        }
        work
    }
}

impl Layer {
    /// As [`Layer::accumulate`], to sums that are kept elsewhere.
    #[inline(always)]
    fn accumulate_wide<S: Simd>(
        &mut self,
        simd: S,
        (block, sums): (usize, &mut Sums),
        fall: f32x16<S>,
        (color, depth): ([f32; 3], u32),
        passing: &Passing,
        thresholds: Thresholds,
    ) -> u64 {
        let ceiling = f32x16::splat(simd, thresholds.alpha_ceiling);
        let alpha = exp2_of_negated(simd, fall).min(ceiling);
        let mut reached = fall.simd_le(f32x16::splat(simd, thresholds.most_fall));
        if thresholds.depth_mode > NO_DEPTH {
            reached &= passing.pixels(simd, block, depth);
        }
        // What has fallen too far has no meaning, and may be anything.
        let alpha = reached.select(alpha, f32x16::splat(simd, 0.0));
        let before = sums.transmittance;
        let floor = thresholds.transmittance_floor;
        let (weight, accepted) = sums.add(simd, alpha, color, reached.to_bitmask(), floor);
        if thresholds.depth_mode >= FIND_MEDIAN {
            for (lane, (median, t)) in self.median[block].iter_mut().zip(before).enumerate() {
                if accepted >> lane & 1 == 1 && t >= 0.5 {
                    *median = depth;
                }
            }
        }
        if thresholds.depth_mode == FIND_MEAN {
            let depth = f32x16::splat(simd, thresholds.depth_unit.decode(depth));
            let [depths, weights] = &mut self.means;
            let sum = f32x16::from_slice(simd, &depths[block]);
            weight.mul_add(depth, sum).store_slice(&mut depths[block]);
            let sum = f32x16::from_slice(simd, &weights[block]) + weight;
            sum.store_slice(&mut weights[block]);
        }
        self.covered[block] |= accepted as u32;
        u64::from(accepted.count_ones())
    }
}
