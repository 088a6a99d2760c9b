//! Kernels that take a tile's blocks one after the other, each with its own list.

use super::block_lists::{BlockLists, part};
use crate::gaussian::splats::splat::locate;
use crate::raster::gaussian::accumulator::Accumulator;
use crate::raster::gaussian::depth_ranges::DepthRanges;
use crate::raster::gaussian::grid::ROUND;
use crate::raster::gaussian::inputs::{TileCounts, TileInputs};
use crate::stats::optimizations::Optimization;
use crate::stats::recorder::Run;
use fearless_simd::Simd;

/// A kernel that composites a block's list, one Gaussian after the other.
pub(crate) trait BlockKernel {
    /// Begins with a block.
    fn begin(&mut self, _layer: &Accumulator, _block: usize) {}

    /// Reports whether a pixel of the block is not finished.
    fn is_open(&self, accumulator: &Accumulator, block: usize) -> bool {
        accumulator.open_lanes(block) != 0
    }

    /// Composites the Gaussian at a batch and a place there; returns how many pixels accepted it.
    fn composite<S: Simd>(
        &mut self,
        simd: S,
        task: &TileInputs<'_>,
        at: (usize, usize),
        to: (&mut Accumulator, usize),
        ranges: &DepthRanges,
    ) -> u64;

    /// Ends with a block.
    fn end(&mut self, _layer: &mut Accumulator, _block: usize) {}
}

/// Composites a tile by a kernel, in the order of its list.
#[inline(always)]
pub(crate) fn composite_by_block<S: Simd, K: BlockKernel>(
    simd: S,
    mut kernel: K,
    task: &TileInputs<'_>,
    lists: &mut BlockLists,
    (accumulator, ranges): (&mut Accumulator, &DepthRanges),
    runs: Option<&mut Vec<Run>>,
) -> TileCounts {
    let mut work = part(simd, task, lists, (accumulator, ranges), runs);
    let ends_early = task.optimizations.has(Optimization::EarlyTermination);
    for (block, list) in lists.iter().enumerate() {
        kernel.begin(accumulator, block);
        for round in list.chunks(ROUND) {
            if ends_early && !kernel.is_open(accumulator, block) {
                break;
            }
            for &primitive in round {
                let at = locate(primitive);
                work.contributions += kernel.composite(simd, task, at, (&mut *accumulator, block), ranges);
            }
        }
        kernel.end(accumulator, block);
    }
    work
}
