//! The per-pixel order: each pixel sorts what reaches it by depth along its own ray.
//!
//! Blocks are taken one by one. What reaches a block is evaluated for its 16 pixels at once, alpha and depth, in
//! binary64; each pixel gathers what contributes to it, sorts it exactly and composites it front to back in binary64. A
//! pixel holds the nearest [`HELD`] at a time: memory is bounded whatever a scene stacks up, and what a pass leaves out
//! is gathered by the next, so that time stays near linear.

use super::block_lists::{BlockLists, divide};
use super::exponents::neg_log2_alphas;
use crate::gaussian::splats::ray_depth::{PixelRays, RayDepths, Rays, ordered_key};
use crate::gaussian::splats::splat::SplatIndex;
use crate::raster::gaussian::accumulator::Accumulator;
use crate::raster::gaussian::grid::{BLOCK_PIXELS, BLOCK_X, BLOCK_Y, LANE_X_64, LANE_Y_64};
use crate::raster::gaussian::inputs::{TileCounts, TileInputs};
use crate::simd::exp2::exp2_of_negated;
use crate::stats::recorder::Run;
use devmem::host;
use fearless_simd::{Simd, f32x16, prelude::*};

/// The most contributions that a pixel sorts at a time.
#[cfg(not(test))]
const HELD: usize = 16_384;

/// Few, so that tests see several passes.
#[cfg(test)]
pub(crate) const HELD: usize = 64;

/// The place of a contribution in a pixel's order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct OrderKey {
    /// The depth: see [`ordered_key`].
    depth: u64,
    /// The place in the block's list, which follows the draw.
    number: u32,
}

/// A Gaussian's contribution to a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Contribution {
    key: OrderKey,
    /// The bits of its alpha.
    alpha: u32,
}

/// The key before all others.
const START: OrderKey = OrderKey { depth: 0, number: 0 };

/// The key after all others.
const END: OrderKey = OrderKey { depth: u64::MAX, number: u32::MAX };

/// One pixel's contributions: the nearest of those beyond `after`.
#[derive(Clone, Debug)]
struct Gathered {
    list: Vec<Contribution>,
    after: OrderKey,
    /// The key from which on contributions are left to the next pass.
    limit: OrderKey,
}

impl Default for Gathered {
    fn default() -> Self {
        Self { list: Vec::new(), after: START, limit: END }
    }
}

impl Gathered {
    fn clear(&mut self) {
        self.list.clear();
        (self.after, self.limit) = (START, END);
    }

    fn add(&mut self, contribution: Contribution) {
        let key = contribution.key;
        if key <= self.after || key >= self.limit {
            return;
        }
        host::push(&mut self.list, contribution);
        if self.list.len() == 2 * HELD {
            let (_, next, _) = self.list.select_nth_unstable(HELD);
            self.limit = next.key;
            self.list.truncate(HELD);
        }
    }

    /// The contributions that were gathered, in order.
    fn sorted(&mut self) -> &[Contribution] {
        self.list.sort_unstable();
        &self.list
    }

    /// Makes it gather what the last pass left out, if that left anything out.
    fn advance(&mut self) -> bool {
        let more = self.limit != END;
        if let Some(last) = self.list.last() {
            self.after = last.key;
        }
        self.list.clear();
        self.limit = END;
        more
    }
}

/// The sums of a pixel.
#[derive(Clone, Copy, Debug)]
struct Sum {
    color: [f64; 3],
    transmittance: f64,
    median: u32,
    covered: bool,
    finished: bool,
}

impl Sum {
    const EMPTY: Self = Self { color: [0.0; 3], transmittance: 1.0, median: 0, covered: false, finished: false };
}

/// A worker's scratch for tiles in the per-pixel order.
#[derive(Clone, Debug, Default)]
pub(crate) struct PerPixel {
    pixels: [Gathered; BLOCK_PIXELS],
}

/// Composites a tile in the per-pixel order.
#[inline(always)]
pub(crate) fn composite_per_pixel<S: Simd>(
    scratch: &mut PerPixel,
    simd: S,
    inputs: &TileInputs<'_>,
    depths: RayDepths<'_>,
    lists: &mut BlockLists,
    accumulator: &mut Accumulator,
    runs: Option<&mut Vec<Run>>,
) -> TileCounts {
    let mut counts = divide(simd, inputs, lists, accumulator, runs);
    for (block, names) in lists.iter().enumerate() {
        if names.is_empty() {
            continue;
        }
        counts.contributions += scratch.composite_block(simd, inputs, depths, names, accumulator, block);
    }
    counts
}

impl PerPixel {
    /// Composites a block of an accumulator; returns how many Gaussians its pixels accepted.
    #[inline(always)]
    fn composite_block<S: Simd>(
        &mut self,
        simd: S,
        inputs: &TileInputs<'_>,
        depths: RayDepths<'_>,
        names: &[u32],
        accumulator: &mut Accumulator,
        block: usize,
    ) -> u64 {
        let mut open = accumulator.open_lanes(block);
        let rays = block_rays(&depths.rays, inputs.corner, block);
        let mut sums = [Sum::EMPTY; BLOCK_PIXELS];
        for pixel in &mut self.pixels {
            pixel.clear();
        }
        let mut contributions = 0;
        while open != 0 {
            for (number, &primitive) in (0..).zip(names) {
                let index = SplatIndex::new(primitive);
                let splat = index.of(inputs.splats);
                let neg_log2_alpha = neg_log2_alphas(simd, inputs, index, block);
                let ceiling = f32x16::splat(simd, inputs.thresholds.alpha_ceiling);
                let alpha = exp2_of_negated(simd, neg_log2_alpha).min(ceiling);
                let mut reached = neg_log2_alpha.simd_le(inputs.thresholds.neg_log2_floor);
                if inputs.thresholds.depth_mode.tests() {
                    reached &= inputs.ranges.pixels(simd, block, splat.look.depth);
                }
                let mut reached = reached.to_bitmask() as u32 & open;
                if reached == 0 {
                    continue;
                }
                let (alpha, along) = (alpha.to_array(), {
                    let depth = index.of(depths.by_group);
                    let mut along = [0.0; BLOCK_PIXELS];
                    depth.along(simd, &rays, 0).store_slice(&mut along[..8]);
                    depth.along(simd, &rays, 8).store_slice(&mut along[8..]);
                    along
                });
                while reached != 0 {
                    let lane = reached.trailing_zeros() as usize % BLOCK_PIXELS;
                    let key = OrderKey { depth: ordered_key(along[lane]), number };
                    self.pixels[lane].add(Contribution { key, alpha: alpha[lane].to_bits() });
                    reached &= reached - 1;
                }
            }
            let pixels = sums.iter_mut().zip(&mut self.pixels);
            for (lane, (sum, pixel)) in pixels.enumerate() {
                if open >> lane & 1 == 0 {
                    continue;
                }
                contributions += composite_pixel(sum, pixel, names, inputs);
                if sum.finished || !pixel.advance() {
                    open &= !(1 << lane);
                }
            }
        }
        store(accumulator, block, &sums);
        contributions
    }
}

/// Composites what a pixel gathered, front to back; returns how many it accepted.
fn composite_pixel(sum: &mut Sum, pixel: &mut Gathered, names: &[u32], inputs: &TileInputs<'_>) -> u64 {
    let floor = f64::from(inputs.thresholds.transmittance_floor);
    let mut accepted = 0;
    for contribution in pixel.sorted() {
        let alpha = f64::from(f32::from_bits(contribution.alpha));
        let weight = sum.transmittance * alpha;
        let rest = sum.transmittance - weight;
        if rest < floor {
            sum.finished = true;
            break;
        }
        let splat = inputs.splat(names[contribution.key.number as usize]);
        for (sum, color) in sum.color.iter_mut().zip(splat.look.color) {
            *sum += weight * f64::from(color);
        }
        if inputs.thresholds.depth_mode.finds_median() && sum.transmittance >= 0.5 {
            sum.median = splat.look.depth;
        }
        sum.transmittance = rest;
        sum.covered = true;
        accepted += 1;
    }
    accepted
}

/// The rays of a block's pixels.
fn block_rays(rays: &PixelRays, corner: [u32; 2], block: usize) -> Rays {
    let middle = [BLOCK_X[block] + f64::from(corner[0]), BLOCK_Y[block] + f64::from(corner[1])];
    rays.of(LANE_X_64.map(|x| x + middle[0]), LANE_Y_64.map(|y| y + middle[1]))
}

/// Takes what the open pixels of a block accumulated.
fn store(accumulator: &mut Accumulator, block: usize, sums: &[Sum; BLOCK_PIXELS]) {
    let open = accumulator.open_lanes(block);
    for (lane, sum) in sums.iter().enumerate() {
        if open >> lane & 1 == 0 {
            continue;
        }
        let t = sum.transmittance as f32;
        accumulator.transmittance[block][lane] = if sum.finished { -t } else { t };
        for (channel, &color) in accumulator.color.iter_mut().zip(&sum.color) {
            channel[block][lane] = color as f32;
        }
        accumulator.median[block][lane] = sum.median;
        accumulator.covered[block] |= u32::from(sum.covered) << lane;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[gaurast_runner::test]
    fn passes_give_everything_once_and_in_order() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for count in [0, 1, HELD, 2 * HELD - 1, 2 * HELD, 2 * HELD + 1, 20 * HELD + 3] {
            // Many are equal.
            let all: Vec<Contribution> = (0..count as u32)
                .map(|number| Contribution {
                    key: OrderKey { depth: 1 << 63 | rng.random_range(0..HELD as u64), number },
                    alpha: number,
                })
                .collect();
            let mut sorted = all.clone();
            sorted.sort();
            let (mut pixel, mut given, mut passes) = (Gathered::default(), Vec::new(), 0);
            loop {
                for &contribution in &all {
                    pixel.add(contribution);
                    assert!(pixel.list.len() < 2 * HELD);
                }
                given.extend_from_slice(pixel.sorted());
                passes += 1;
                if !pixel.advance() {
                    break;
                }
            }
            assert!(given == sorted, "{count}");
            assert!(passes <= 1 + count / HELD, "{count}: {passes}");
        }
    }
}
