//! The depths that pass a draw's depth test, by pixel, block and tile.
//!
//! Whatever the comparison, what passes against a stored depth is a range of numbers, counted modulo 2^32: all but the
//! stored depth are those from one more to one less. So one subtraction and one comparison do for every operation, and
//! nothing in the kernel depends on which it is.

use super::grid::{BLOCK_PIXELS, BLOCKS, PixelMask, ROUND};
use crate::gaussian::view::center_depth::DepthTrend;
use crate::state::CompareOp;
use fearless_simd::{Simd, mask32x16, prelude::*, u32x16};

/// No depth has this number or a greater one.
const NO_DEPTH: u32 = u32::MAX;

/// The depths that pass in a tile.
#[derive(Debug)]
#[repr(align(64))]
pub(crate) struct DepthRanges {
    /// A depth passes at a pixel if it is `first` or at most `span` more.
    first: [[u32; BLOCK_PIXELS]; BLOCKS],
    span: [[u32; BLOCK_PIXELS]; BLOCKS],
    /// Depths beyond these fail in all of a block.
    least: [u32; BLOCKS],
    greatest: [u32; BLOCKS],
    /// Depths beyond these fail in all of the tile.
    tile: [u32; 2],
}

impl Default for DepthRanges {
    fn default() -> Self {
        Self {
            first: [[0; BLOCK_PIXELS]; BLOCKS],
            span: [[NO_DEPTH; BLOCK_PIXELS]; BLOCKS],
            least: [0; BLOCKS],
            greatest: [NO_DEPTH; BLOCKS],
            tile: [0, NO_DEPTH],
        }
    }
}

/// The depths that pass against a stored one, if any do: the first, and how many more there are.
fn range(op: CompareOp, stored: u32) -> Option<(u32, u32)> {
    const LAST: u32 = NO_DEPTH - 1;
    let between = |first: u32, last: u32| last.checked_sub(first).map(|span| (first, span));
    match op {
        CompareOp::Never => None,
        CompareOp::Less => between(0, stored.checked_sub(1)?),
        CompareOp::Equal => between(stored, stored),
        CompareOp::LessOrEqual => between(0, stored),
        CompareOp::Greater => between(stored.checked_add(1)?, LAST),
        // One more than the greatest number is the least.
        CompareOp::NotEqual => Some((stored.wrapping_add(1), LAST)),
        CompareOp::GreaterOrEqual => between(stored, LAST),
        CompareOp::Always => between(0, LAST),
    }
}

impl DepthRanges {
    /// Makes this what passes against the depths stored at `lanes` of a tile, which are in the order of its blocks.
    pub(crate) fn set(&mut self, op: CompareOp, stored: &[u32], lanes: &PixelMask) {
        self.tile = [NO_DEPTH, 0];
        for (block, stored) in stored.as_chunks::<BLOCK_PIXELS>().0.iter().enumerate().take(BLOCKS) {
            let (mut least, mut greatest) = (NO_DEPTH, 0);
            for (lane, &stored) in stored.iter().enumerate() {
                let range = range(op, stored);
                let (first, span) = range.unwrap_or((NO_DEPTH, 0));
                self.first[block][lane] = first;
                self.span[block][lane] = span;
                if range.is_some() && lanes[block] >> lane & 1 == 1 {
                    // A range that runs over is bounded by nothing.
                    let (low, high) = match first.checked_add(span) {
                        Some(last) => (first, last),
                        None => (0, NO_DEPTH),
                    };
                    least = least.min(low);
                    greatest = greatest.max(high);
                }
            }
            self.least[block] = least;
            self.greatest[block] = greatest;
            self.tile = [self.tile[0].min(least), self.tile[1].max(greatest)];
        }
    }

    /// True if a depth fails in all of the tile.
    #[inline(always)]
    pub(crate) fn hides(&self, depth: u32) -> bool {
        depth < self.tile[0] || depth > self.tile[1]
    }

    /// True if a depth and all that follow it fail in all of the tile.
    #[inline(always)]
    pub(crate) fn rejects_rest(&self, depth: u32, trend: DepthTrend) -> bool {
        match trend {
            DepthTrend::Rising => depth > self.tile[1],
            DepthTrend::Falling => depth < self.tile[0],
            DepthTrend::None => false,
        }
    }

    /// The blocks where a depth may pass.
    #[inline(always)]
    pub(crate) fn blocks<S: Simd>(&self, simd: S, depth: u32) -> mask32x16<S> {
        let depth = u32x16::splat(simd, depth);
        let least = u32x16::simd_from(simd, self.least);
        let greatest = u32x16::simd_from(simd, self.greatest);
        depth.simd_ge(least) & depth.simd_le(greatest)
    }

    /// Depths of a round that may pass in a block: a bit for each.
    #[inline(always)]
    pub(crate) fn shown<S: Simd>(&self, simd: S, block: usize, depths: &[u32; ROUND]) -> u32 {
        let least = S::u32s::splat(simd, self.least[block]);
        let greatest = S::u32s::splat(simd, self.greatest[block]);
        let mut shown = 0;
        for first in (0..ROUND).step_by(S::u32s::LEN) {
            let depth = S::u32s::from_slice(simd, &depths[first..first + S::u32s::LEN]);
            let bits = depth.simd_ge(least).to_bitmask() & depth.simd_le(greatest).to_bitmask();
            shown |= (bits as u32) << first;
        }
        shown
    }

    /// The pixels of a block where a depth passes.
    #[inline(always)]
    pub(crate) fn pixels<S: Simd>(&self, simd: S, block: usize, depth: u32) -> mask32x16<S> {
        let first = u32x16::from_slice(simd, &self.first[block]);
        let span = u32x16::from_slice(simd, &self.span[block]);
        (u32x16::splat(simd, depth) - first).simd_le(span)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPS: [CompareOp; 8] = [
        CompareOp::Never,
        CompareOp::Less,
        CompareOp::Equal,
        CompareOp::LessOrEqual,
        CompareOp::Greater,
        CompareOp::NotEqual,
        CompareOp::GreaterOrEqual,
        CompareOp::Always,
    ];

    #[gaurast_runner::test]
    fn ranges_are_the_comparisons() {
        let one = 1.0f32.to_bits();
        let depths = [0, 1, 2, 77, (1 << 16) - 1, (1 << 24) - 1, one - 1, one];
        // An image may hold what is no depth.
        let stored = depths.into_iter().chain([u32::MAX - 1, u32::MAX]);
        for op in OPS {
            for stored in stored.clone() {
                let (first, span) = range(op, stored).unwrap_or((NO_DEPTH, 0));
                for depth in depths {
                    let passes = depth.wrapping_sub(first) <= span;
                    assert_eq!(passes, op.holds(depth, stored), "{depth} {op:?} {stored}");
                }
            }
        }
    }

    #[gaurast_runner::test]
    fn what_a_tile_hides_passes_nowhere() {
        for op in OPS {
            for lanes in [[0xFFFF; BLOCKS], [0x0180; BLOCKS], [0; BLOCKS]] {
                let stored: Vec<u32> = (0..256).map(|at| 100 + at * 37 % 50).collect();
                let mut ranges = DepthRanges::default();
                ranges.set(op, &stored, &lanes);
                for depth in 90..160 {
                    let passes = (0..256).any(|at| {
                        lanes[at / BLOCK_PIXELS] >> (at % BLOCK_PIXELS) & 1 == 1 && op.holds(depth, stored[at])
                    });
                    assert!(!(passes && ranges.hides(depth)), "{op:?} {depth}");
                    // Bounds of single ranges are exact but for Equal, whose depths have gaps.
                    if !passes && op != CompareOp::Equal {
                        assert!(ranges.hides(depth), "{op:?} {depth}");
                    }
                    let from = |trend| ranges.rejects_rest(depth, trend);
                    let later = |mut depths: std::ops::Range<u32>| depths.all(|d| ranges.hides(d));
                    assert!(!from(DepthTrend::Rising) || later(depth..200));
                    assert!(!from(DepthTrend::Falling) || later(0..depth + 1));
                    assert!(!from(DepthTrend::None));
                }
            }
        }
    }
}
