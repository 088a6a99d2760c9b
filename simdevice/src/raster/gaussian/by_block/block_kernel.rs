//! Kernels that take a tile's blocks one after the other, each with its own list.

use super::block_lists::{BlockLists, divide};
use crate::gaussian::splats::splat::SplatIndex;
use crate::raster::gaussian::accumulator::Accumulator;
use crate::raster::gaussian::grid::ROUND;
use crate::raster::gaussian::inputs::{TileCounts, TileInputs};
use crate::stats::optimizations::Optimization;
use crate::stats::recorder::Run;
use fearless_simd::Simd;

/// A kernel that composites a block's list, one Gaussian after the other.
pub(crate) trait BlockKernel {
    /// Begins with a block.
    fn begin(&mut self, _accumulator: &Accumulator, _block: usize) {}

    /// True if a pixel of the block is not finished.
    fn is_open(&self, accumulator: &Accumulator, block: usize) -> bool {
        accumulator.open_lanes(block) != 0
    }

    /// Composites the Gaussian at an index in a block; returns how many pixels accepted it.
    fn composite<S: Simd>(
        &mut self,
        simd: S,
        inputs: &TileInputs<'_>,
        index: SplatIndex,
        accumulator: &mut Accumulator,
        block: usize,
    ) -> u64;

    /// Ends with a block.
    fn end(&mut self, _accumulator: &mut Accumulator, _block: usize) {}
}

/// Composites a tile by a kernel, in the order of its list.
#[inline(always)]
pub(crate) fn composite_by_block<S: Simd, K: BlockKernel>(
    simd: S,
    mut kernel: K,
    inputs: &TileInputs<'_>,
    lists: &mut BlockLists,
    accumulator: &mut Accumulator,
    runs: Option<&mut Vec<Run>>,
) -> TileCounts {
    let mut counts = divide(simd, inputs, lists, accumulator, runs);
    let ends_early = inputs.optimizations.has(Optimization::EarlyTermination);
    for (block, list) in lists.iter().enumerate() {
        kernel.begin(accumulator, block);
        for round in list.chunks(ROUND) {
            if ends_early && !kernel.is_open(accumulator, block) {
                break;
            }
            for &primitive in round {
                let index = SplatIndex::new(primitive);
                counts.contributions += kernel.composite(simd, inputs, index, accumulator, block);
            }
        }
        kernel.end(accumulator, block);
    }
    counts
}
