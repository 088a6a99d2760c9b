//! Phase 2 of the fast kernel: the alphas of a round's Gaussians in the blocks that they may reach.

use super::staging::{Reaching, StagedRound};
use crate::raster::gaussian::depth_ranges::DepthRanges;
use crate::raster::gaussian::exponent::power;
use crate::raster::gaussian::grid::{BLOCK_PIXELS, BLOCKS, ROUND};
use crate::raster::gaussian::inputs::Thresholds;
use crate::raster::gaussian::masks::{Tally, only};
use crate::raster::gaussian::mode::Mode;
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

/// The numbers of alphas of a round.
pub(super) struct AlphaCounts {
    /// Pairs of a Gaussian and a pixel that it reaches, of pixels that are not finished.
    pub(super) pixels: u64,
    /// Pairs of a Gaussian and a block.
    pub(super) blocks: u64,
}

impl Alphas {
    /// Computes the alphas of all Gaussians in the blocks that they may reach: zero below the floor, of which
    /// `neg_log2_floors` are the negated logarithms. Without `IS_CAPPED`, alphas are not compared with the ceiling, which
    /// none may reach then.
    ///
    /// All are computed before any is composited, since they do not depend on each other: the processor works on several at a
    /// time. The function is not inlined, so that its constants have the registers for themselves.
    #[inline(never)]
    pub(super) fn find<S: Simd, M: Mode, const IS_CAPPED: bool>(
        &mut self,
        simd: S,
        reaching: &Reaching,
        round: &StagedRound,
        neg_log2_floors: &[[f32; BLOCK_PIXELS]; BLOCKS],
        ranges: &DepthRanges,
        thresholds: Thresholds,
    ) -> AlphaCounts {
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
                    let neg_log2_floor = f32x16::from_slice(simd, &neg_log2_floors[block]);
                    let mut rest = reaching;
                    for to in alphas {
                        let number = rest.trailing_zeros() as usize;
                        rest &= rest.wrapping_sub(1);
                        let neg_log2_alpha = round.neg_log2_alphas(simd, number, block, column);
                        let depth = round.looks[number].depth;
                        let reached = reached(simd, M::DEPTH, block, depth, neg_log2_alpha, ranges, neg_log2_floor);
                        pixels.add(reached);
                        let power = power(simd, M::EXPONENTIAL, neg_log2_alpha);
                        let alpha = if IS_CAPPED { power.min(ceiling) } else { power };
                        only(simd, reached, alpha).store_slice(to);
                    }
                }
                AlphaCounts { pixels: pixels.total(), blocks: count_of_all }
            },
        )
    }
}
