//! The kernel for what the fast one cannot do in the order of a list: exponents in binary64 at every pixel, and sums in binary32.

use super::block_kernel::BlockKernel;
use super::exponents::falls;
use crate::raster::gaussian::accumulator::Accumulator;
use crate::raster::gaussian::depth_ranges::DepthRanges;
use crate::raster::gaussian::inputs::TileInputs;
use crate::raster::gaussian::pixels::accumulate;
use fearless_simd::Simd;

/// Compositing in the order of the list, by sums in binary32.
pub(crate) struct InOrder;

impl BlockKernel for InOrder {
    #[inline(always)]
    fn composite<S: Simd>(
        &mut self,
        simd: S,
        task: &TileInputs<'_>,
        (batch, place): (usize, usize),
        (accumulator, block): (&mut Accumulator, usize),
        ranges: &DepthRanges,
    ) -> u64 {
        let splat = &task.splats[batch][place];
        let fall = falls(simd, task, (batch, place), block);
        let look = splat.look;
        accumulate(accumulator, simd, block, fall, look, ranges, task.thresholds)
    }
}
