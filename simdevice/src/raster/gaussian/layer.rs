//! What Gaussian mode accumulates for a tile's pixels, or for one sample of each.

use super::{BLOCKS, LANES, TILE};
use crate::format::depth::DepthEncoding;
use crate::limits::TILE_SIZE;
use crate::raster::tile::place;
use crate::state::Rect;
use fearless_simd::{Simd, f32x16, i32x16, prelude::*};

/// Accumulated colour and transmittance of a tile's pixels, or of one sample of each.
///
/// Arrays are indexed by block, row by row, then by pixel of the block in the order of [`place`].
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Layer {
    pub(super) color: [[[f32; LANES]; BLOCKS]; 3],
    /// Transmittance; negative where the pixel is finished, [`UNTOUCHED`] where it is not to be touched.
    pub(super) transmittance: [[f32; LANES]; BLOCKS],
    /// In the fast kernel, how far alphas may fall at each pixel; where it is finished, none falls so little.
    pub(super) most_fall: [[f32; LANES]; BLOCKS],
    /// Bit `lane` of entry `block` tells that some Gaussian contributed.
    pub(super) covered: [u32; BLOCKS],
    /// The median depth as the attachment holds it, where covered, if the draw writes depth.
    pub(super) median: [[u32; LANES]; BLOCKS],
    /// The sums of weighted depths and of weights, if a fragment program reads their ratio.
    pub(super) means: [[[f32; LANES]; BLOCKS]; 2],
}

/// What no layer leaves anything of, neither more nor less than a floor.
const UNTOUCHED: f32 = f32::NEG_INFINITY;

/// A transmittance that is compared with pixels': its bits, which as integers are in the order of what they stand for, and
/// less than zero where a pixel is finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Light(i32);

/// Every pixel that is not finished has more.
pub(super) const ANY_LIGHT: Light = Light(-1);

impl Light {
    /// A transmittance; with none at all, a pixel whose own is zero is not finished yet.
    pub(super) fn of(transmittance: f32) -> Self {
        if transmittance > 0.0 {
            Self(transmittance.to_bits() as i32)
        } else {
            ANY_LIGHT
        }
    }
}

/// Lanes by block.
pub(super) type Lanes = [u32; BLOCKS];

/// Every lane of a block.
pub(super) const ALL_LANES: u32 = (1 << LANES) - 1;

/// The block of a pixel of a tile, and the lane in it.
pub(super) fn block_and_lane(x: usize, y: usize) -> (usize, usize) {
    let place = place(x, y);
    (place / LANES % BLOCKS, place % LANES)
}

impl Layer {
    pub(super) const EMPTY: Self = Self {
        color: [[[0.0; LANES]; BLOCKS]; 3],
        transmittance: [[1.0; LANES]; BLOCKS],
        most_fall: [[0.0; LANES]; BLOCKS],
        covered: [0; BLOCKS],
        median: [[0; LANES]; BLOCKS],
        means: [[[0.0; LANES]; BLOCKS]; 2],
    };

    /// Makes the pixels in `lanes` fresh, and the others finished.
    pub(super) fn clear(&mut self, lanes: &Lanes) {
        self.color = [[[0.0; LANES]; BLOCKS]; 3];
        self.covered = [0; BLOCKS];
        for (block, &lanes) in self.transmittance.iter_mut().zip(lanes) {
            if lanes == ALL_LANES {
                *block = [1.0; LANES];
                continue;
            }
            for (lane, t) in block.iter_mut().enumerate() {
                *t = if lanes >> lane & 1 == 1 {
                    1.0
                } else {
                    UNTOUCHED
                };
            }
        }
    }

    /// Makes the sums of depths fresh.
    pub(super) fn clear_means(&mut self) {
        self.means = [[[0.0; LANES]; BLOCKS]; 2];
    }

    /// The expected and the median depth of a block's lanes; zero where nothing is covered.
    pub(super) fn depths(&self, block: usize, unit: DepthEncoding) -> [[f32; LANES]; 2] {
        let mut out = [[0.0; LANES]; 2];
        let [depths, weights] = &self.means;
        for lane in 0..LANES {
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
    pub(super) fn fragments<S: Simd>(&self, simd: S, block: usize) -> [f32x16<S>; 4] {
        let [r, g, b] = &self.color;
        let load = |lanes: &[f32; LANES]| f32x16::from_slice(simd, lanes);
        let rest = load(&self.transmittance[block]).abs();
        [
            load(&r[block]),
            load(&g[block]),
            load(&b[block]),
            f32x16::splat(simd, 1.0) - rest,
        ]
    }

    /// Bit `block` tells that a pixel of the block is not finished and has more than some light.
    #[inline(always)]
    pub(super) fn open_blocks<S: Simd>(&self, simd: S, Light(light): Light) -> u64 {
        let light = i32x16::splat(simd, light);
        let mut open = 0;
        for (block, lanes) in self.transmittance.iter().enumerate() {
            let lanes: i32x16<S> = f32x16::from_slice(simd, lanes).bitcast();
            open |= u64::from(lanes.simd_gt(light).any_true()) << block;
        }
        open
    }

    /// Finds the pixels that some Gaussian contributed to, from what it left of their transmittance: no alpha is so small that
    /// it leaves that as it was, since low floors are for wider sums.
    #[inline(always)]
    pub(super) fn find_covered<S: Simd>(&mut self, simd: S) {
        for (covered, lanes) in self.covered.iter_mut().zip(&self.transmittance) {
            let seen = f32x16::from_slice(simd, lanes).abs().simd_lt(1.0);
            *covered |= seen.to_bitmask() as u32;
        }
    }

    /// How many rows have a pixel that is not finished.
    pub(super) fn open_rows(&self) -> u8 {
        let open = |&y: &usize| {
            (0..TILE).any(|x| {
                let (block, lane) = block_and_lane(x, y);
                self.transmittance[block][lane].is_sign_positive()
            })
        };
        (0..TILE).filter(open).count() as u8
    }

    /// Pixels that are finished or were not to be touched.
    pub(super) fn finished(&self) -> Lanes {
        let mut finished = [0; BLOCKS];
        for (finished, lanes) in finished.iter_mut().zip(&self.transmittance) {
            for (lane, t) in lanes.iter().enumerate() {
                *finished |= u32::from(t.is_sign_negative()) << lane;
            }
        }
        finished
    }
}

/// How many pixels `lanes` has.
pub(super) fn count(lanes: &Lanes) -> u32 {
    lanes.iter().map(|lanes| lanes.count_ones()).sum()
}

/// The pixels of `bounds` in the tile at `corner`.
pub(super) fn lanes_within(bounds: Rect, corner: [u32; 2]) -> Lanes {
    let tile = Rect {
        x: corner[0] as i32,
        y: corner[1] as i32,
        width: TILE_SIZE,
        height: TILE_SIZE,
    };
    let inside = bounds.intersect(tile);
    if [inside.width, inside.height] == [TILE_SIZE; 2] {
        return [ALL_LANES; BLOCKS];
    }
    let mut lanes = [0; BLOCKS];
    if inside.is_empty() {
        return lanes;
    }
    let first = [inside.x as u32 - corner[0], inside.y as u32 - corner[1]];
    for y in first[1]..first[1] + inside.height {
        for x in first[0]..first[0] + inside.width {
            let (block, lane) = block_and_lane(x as usize, y as usize);
            lanes[block] |= 1 << lane;
        }
    }
    lanes
}
