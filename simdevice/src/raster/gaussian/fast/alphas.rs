//! Phase 2 of the fast kernel: the alphas of a round's Gaussians in the blocks that they may reach.

use super::staging::{Reaching, StagedRound};
use crate::raster::gaussian::depth_ranges::DepthRanges;
use crate::raster::gaussian::exponent::power;
use crate::raster::gaussian::grid::{BLOCK_PIXELS, BLOCKS, ROUND};
use crate::raster::gaussian::inputs::Thresholds;
use crate::raster::gaussian::masks::{Tally, only};
use crate::raster::gaussian::mode::DepthMode;
use crate::raster::gaussian::pixels::reached;
use fearless_simd::{Simd, f32x16, prelude::*};

/// The alphas of a round's Gaussians in the blocks that they may reach, by block and then in the order of the list.
#[derive(Debug)]
#[repr(C, align(64))]
pub(crate) struct Alphas {
    pub(super) alphas: [[f32; BLOCK_PIXELS]; BLOCKS * ROUND],
}

impl Default for Alphas {
    fn default() -> Self {
        Self { alphas: [[0.0; BLOCK_PIXELS]; BLOCKS * ROUND] }
    }
}

impl Alphas {
    /// Finds the alphas of all Gaussians in the blocks that they may reach. Returns the number of pixels that they
    /// reach, of those that are not finished, and the number of pairs of a Gaussian and a block. Without `IS_CAPPED`,
    /// alphas are not compared with the ceiling, which none may reach then.
    ///
    /// They come before any is composited, since they do not depend on each other: several are on their way at a time.
    /// A function of its own, so that its constants have the registers for themselves.
    #[inline(never)]
    pub(super) fn find<S: Simd, const DEPTH: DepthMode, const IS_CAPPED: bool>(
        &mut self,
        simd: S,
        reaching: &Reaching,
        (round, most_fall): (&StagedRound, &[[f32; BLOCK_PIXELS]; BLOCKS]),
        ranges: &DepthRanges,
        thresholds: Thresholds,
    ) -> (u64, u64) {
        simd.vectorize(
            #[inline(always)]
            || {
                let ceiling = f32x16::splat(simd, thresholds.alpha_ceiling);
                let mut pixels = Tally::new(simd);
                let mut items = &mut self.alphas[..];
                let mut count_of_all = 0;
                for (block, &reaching) in reaching.iter().enumerate() {
                    let count = reaching.count_ones() as usize;
                    let Some((alphas, others)) = items.split_at_mut_checked(count) else {
                        break;
                    };
                    items = others;
                    count_of_all += count as u64;
                    let Some(column) = round.column(block) else {
                        break;
                    };
                    let most_fall = f32x16::from_slice(simd, &most_fall[block]);
                    let mut rest = reaching;
                    for to in alphas {
                        let number = rest.trailing_zeros() as usize;
                        rest &= rest.wrapping_sub(1);
                        let fall = round.falls(simd, number, (block, column));
                        let at = (block, round.looks[number].depth);
                        let reached = reached(simd, DEPTH, at, fall, ranges, most_fall);
                        pixels.add(reached);
                        let power = power(simd, DEPTH, fall);
                        let alpha = if IS_CAPPED { power.min(ceiling) } else { power };
                        only(simd, reached, alpha).store_slice(to);
                    }
                }
                (pixels.total(), count_of_all)
            },
        )
    }
}
