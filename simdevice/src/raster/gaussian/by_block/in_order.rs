//! The kernel for what the fast one cannot do in the order of a list: exponents in binary64 at every pixel, and sums in binary32.

use super::block_kernel::BlockKernel;
use super::exponents::neg_log2_alphas;
use crate::gaussian::splats::identity::Identity;
use crate::gaussian::splats::splat::SplatIndex;
use crate::raster::gaussian::accumulator::Accumulator;
use crate::raster::gaussian::inputs::TileInputs;
use crate::raster::gaussian::pixels::{ShownGaussian, accumulate};
use fearless_simd::Simd;

/// Compositing in the order of the list, by sums in binary32.
pub(crate) struct InOrder;

impl BlockKernel for InOrder {
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
        let gaussian = ShownGaussian { look: splat.look, identity: Identity::default() };
        accumulate(accumulator, simd, block, neg_log2_alpha, gaussian, inputs.ranges, inputs.thresholds)
    }
}
