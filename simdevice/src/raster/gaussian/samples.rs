//! A tile's samples and their tests.

use super::grid::{BLOCKS, PixelMask};
use crate::limits::MAX_SAMPLES;

pub(crate) const SAMPLES: usize = MAX_SAMPLES as usize;

/// A tile's samples and their tests: lanes by sample and block.
#[derive(Debug, Default)]
pub(crate) struct Samples {
    /// Samples that the draw may touch, and whose stored depth lies within bounds.
    pub(crate) candidates: [PixelMask; SAMPLES],
    /// Candidates that pass the stencil test.
    pub(crate) tested: [PixelMask; SAMPLES],
    /// The accumulator that a sample's block is composited in.
    pub(crate) accumulators: [[usize; BLOCKS]; SAMPLES],
}

impl Samples {
    /// Leaves alone what was covered and then discarded, as if nothing had reached it.
    pub(crate) fn leave(&mut self, covered: &[PixelMask; SAMPLES], kept: &[PixelMask; SAMPLES]) {
        let lanes = covered.iter().zip(kept);
        for (candidates, (covered, kept)) in self.candidates.iter_mut().zip(lanes) {
            for (block, candidates) in candidates.iter_mut().enumerate() {
                *candidates &= !(covered[block] & !kept[block]);
            }
        }
    }
}
