//! The accumulators of Gaussian mode for a tile's pixels, or for one sample of each.

use super::grid::{ALL_LANES, BLOCK_PIXELS, BLOCKS, PixelMask, TILE, block_and_lane};
use crate::format::depth::DepthEncoding;
use fearless_simd::{Simd, f32x16, i32x16, prelude::*};

/// Accumulated colour and transmittance of a tile's pixels, or of one sample of each.
///
/// Arrays are indexed by block, row by row, then by pixel of the block in the order of [`block_and_lane`].
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Accumulator {
    pub(crate) color: [[[f32; BLOCK_PIXELS]; BLOCKS]; 3],
    /// Transmittance; negative where the pixel is finished, [`UNTOUCHED`] where it is not to be touched.
    pub(crate) transmittance: [[f32; BLOCK_PIXELS]; BLOCKS],
    /// In the fast kernel, minus the base-2 logarithm of the alpha floor at each pixel; negative infinity where the pixel is
    /// finished, so that no alpha reaches the floor.
    pub(crate) neg_log2_floors: [[f32; BLOCK_PIXELS]; BLOCKS],
    /// Bit `lane` of entry `block` tells that some Gaussian contributed.
    pub(crate) covered: [u32; BLOCKS],
    /// The median depth as the attachment holds it, where covered, if the draw writes depth.
    pub(crate) median: [[u32; BLOCK_PIXELS]; BLOCKS],
    /// The sums of weighted depths and of weights, if a fragment program reads their ratio.
    pub(crate) means: [[[f32; BLOCK_PIXELS]; BLOCKS]; 2],
    /// The Gaussians that are shown, where covered, if a fragment program reads them.
    pub(crate) tracked: Tracked,
}

/// The Gaussians that a tile's pixels, or one sample of each, show: numbers of Gaussians in the set, and depth variables.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Tracked {
    /// The number of the first Gaussian that contributed.
    pub(crate) nearest: [[u32; BLOCK_PIXELS]; BLOCKS],
    /// The number of the one whose depth is the median.
    pub(crate) median: [[u32; BLOCK_PIXELS]; BLOCKS],
    /// The depth variable of the median.
    pub(crate) median_z: [[f32; BLOCK_PIXELS]; BLOCKS],
    /// The sums of weighted depth variables. [`Accumulator::means`] has those of weights.
    pub(crate) z_sums: [[f32; BLOCK_PIXELS]; BLOCKS],
}

/// The transmittance of a pixel that is not to be touched: nothing is left of it, and it is below every floor.
const UNTOUCHED: f32 = f32::NEG_INFINITY;

/// A transmittance that is compared with pixels': its bits, which as integers are in the order of what they stand for,
/// and less than zero where a pixel is finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TransmittanceBits(i32);

/// Every pixel that is not finished has more.
pub(crate) const NOT_TERMINATED: TransmittanceBits = TransmittanceBits(-1);

impl TransmittanceBits {
    /// A transmittance; with none at all, a pixel whose own is zero is not finished yet.
    pub(crate) fn of(transmittance: f32) -> Self {
        if transmittance > 0.0 { Self(transmittance.to_bits() as i32) } else { NOT_TERMINATED }
    }
}

/// Makes the sums of a tile's pixels zero. What is longer would be cleared by instructions that are slow to begin.
#[inline(never)]
fn clear_sums(sums: &mut [[f32; BLOCK_PIXELS]; BLOCKS]) {
    *sums = [[0.0; BLOCK_PIXELS]; BLOCKS];
}

impl Accumulator {
    pub(crate) const EMPTY: Self = Self {
        color: [[[0.0; BLOCK_PIXELS]; BLOCKS]; 3],
        transmittance: [[1.0; BLOCK_PIXELS]; BLOCKS],
        neg_log2_floors: [[0.0; BLOCK_PIXELS]; BLOCKS],
        covered: [0; BLOCKS],
        median: [[0; BLOCK_PIXELS]; BLOCKS],
        means: [[[0.0; BLOCK_PIXELS]; BLOCKS]; 2],
        tracked: Tracked {
            nearest: [[0; BLOCK_PIXELS]; BLOCKS],
            median: [[0; BLOCK_PIXELS]; BLOCKS],
            median_z: [[0.0; BLOCK_PIXELS]; BLOCKS],
            z_sums: [[0.0; BLOCK_PIXELS]; BLOCKS],
        },
    };

    /// Makes the pixels in `lanes` fresh, and the others finished.
    pub(crate) fn clear(&mut self, lanes: &PixelMask) {
        self.color.iter_mut().for_each(clear_sums);
        self.covered = [0; BLOCKS];
        for (block, &lanes) in self.transmittance.iter_mut().zip(lanes) {
            if lanes == ALL_LANES {
                *block = [1.0; BLOCK_PIXELS];
                continue;
            }
            for (lane, t) in block.iter_mut().enumerate() {
                *t = if lanes >> lane & 1 == 1 { 1.0 } else { UNTOUCHED };
            }
        }
    }

    /// Makes the sums of depths fresh.
    pub(crate) fn clear_means(&mut self) {
        self.means.iter_mut().for_each(clear_sums);
        clear_sums(&mut self.tracked.z_sums);
    }

    /// The mean depth variable of a block's lanes, weighted by contributions; undefined where nothing is covered.
    pub(crate) fn mean_z(&self, block: usize) -> [f32; BLOCK_PIXELS] {
        let (tracked, [_, weights]) = (&self.tracked, &self.means);
        std::array::from_fn(|lane| {
            let weight = weights[block][lane];
            // An alpha that underflows weighs nothing.
            if weight > 0.0 { tracked.z_sums[block][lane] / weight } else { tracked.median_z[block][lane] }
        })
    }

    /// The expected and the median depth of a block's lanes; zero where nothing is covered.
    pub(crate) fn depths(&self, block: usize, unit: DepthEncoding) -> [[f32; BLOCK_PIXELS]; 2] {
        let mut out = [[0.0; BLOCK_PIXELS]; 2];
        let [depths, weights] = &self.means;
        for lane in 0..BLOCK_PIXELS {
            if self.covered[block] >> lane & 1 == 0 {
                continue;
            }
            let median = unit.decode(self.median[block][lane]);
            let weight = weights[block][lane];
            // An alpha that underflows weighs nothing.
            let mean = depths[block][lane] / weight;
            out[0][lane] = if weight > 0.0 { mean } else { median };
            out[1][lane] = median;
        }
        out
    }

    /// The premultiplied colour and coverage (C, 1 - T) of a block's lanes.
    #[inline(always)]
    pub(crate) fn fragments<S: Simd>(&self, simd: S, block: usize) -> [f32x16<S>; 4] {
        let [r, g, b] = &self.color;
        let load = |lanes: &[f32; BLOCK_PIXELS]| f32x16::from_slice(simd, lanes);
        let rest = load(&self.transmittance[block]).abs();
        [load(&r[block]), load(&g[block]), load(&b[block]), f32x16::splat(simd, 1.0) - rest]
    }

    /// A bit for each block that has a pixel that is not finished and has more than a transmittance.
    #[inline(always)]
    pub(crate) fn open_blocks<S: Simd>(&self, simd: S, transmittance: TransmittanceBits) -> u64 {
        let least = i32x16::splat(simd, transmittance.0);
        let mut open = 0;
        for (block, lanes) in self.transmittance.iter().enumerate() {
            let lanes: i32x16<S> = f32x16::from_slice(simd, lanes).bitcast();
            open |= u64::from(lanes.simd_gt(least).any_true()) << block;
        }
        open
    }

    /// Finds the pixels that some Gaussian contributed to, from what it left of their transmittance: no alpha is so
    /// small that it leaves that as it was, since low floors are for wider sums.
    #[inline(always)]
    pub(crate) fn find_covered<S: Simd>(&mut self, simd: S) {
        for (covered, lanes) in self.covered.iter_mut().zip(&self.transmittance) {
            let seen = f32x16::from_slice(simd, lanes).abs().simd_lt(1.0);
            *covered |= seen.to_bitmask() as u32;
        }
    }

    /// The number of rows with a pixel that is not finished.
    pub(crate) fn open_rows(&self) -> u8 {
        let open = |&y: &usize| {
            (0..TILE).any(|x| {
                let (block, lane) = block_and_lane(x, y);
                self.transmittance[block][lane].is_sign_positive()
            })
        };
        (0..TILE).filter(open).count() as u8
    }

    /// Pixels that are finished or were not to be touched.
    pub(crate) fn finished(&self) -> PixelMask {
        let mut finished = [0; BLOCKS];
        for (finished, lanes) in finished.iter_mut().zip(&self.transmittance) {
            for (lane, t) in lanes.iter().enumerate() {
                *finished |= u32::from(t.is_sign_negative()) << lane;
            }
        }
        finished
    }

    /// Finds the floors of a block's pixels: that of the draw, unless they are finished.
    #[inline(always)]
    pub(crate) fn find_neg_log2_floors<S: Simd>(&mut self, simd: S, block: usize, neg_log2_floor: f32) {
        let t = f32x16::from_slice(simd, &self.transmittance[block]);
        let open = t.bitcast::<i32x16<S>>().simd_ge(i32x16::splat(simd, 0));
        let neg_log2_floor = f32x16::splat(simd, neg_log2_floor);
        let none = f32x16::splat(simd, f32::NEG_INFINITY);
        open.select(neg_log2_floor, none).store_slice(&mut self.neg_log2_floors[block]);
    }

    /// The pixels of a block that are not finished.
    pub(crate) fn open_lanes(&self, block: usize) -> u32 {
        let lanes = self.transmittance[block].iter().enumerate();
        lanes.fold(0, |open, (lane, t)| open | u32::from(t.is_sign_positive()) << lane)
    }
}
