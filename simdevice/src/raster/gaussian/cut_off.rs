//! Cut-offs: the shapes outside which Gaussians do not contribute, whatever their alpha, pixel by pixel in binary64.

use super::grid::{BLOCK_PIXELS, BLOCK_X, BLOCK_Y, LANE_X_64, LANE_Y_64};
use crate::gaussian::BinnedDraw;
use crate::gaussian::splats::splat::Splat;
use crate::gaussian::splats::surfel::Surfel;
use crate::gaussian::view::cut_off::TileCutOff;
use crate::state::gaussian::GaussianCutOff;
use fearless_simd::{Simd, f64x8, prelude::*};

/// A block of a tile.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockPlace {
    /// The tile's upper left pixel.
    pub(crate) corner: [u32; 2],
    /// The block's number in it.
    pub(crate) block: usize,
}

/// The cut-off of a draw.
#[derive(Clone, Copy, Debug)]
pub(crate) enum CutOff {
    /// An ellipse, of so much of `u^2 + v^2`.
    Ellipse(f64),
    Tiles(TileCutOff),
}

impl CutOff {
    /// The cut-off of a draw, if it has one.
    pub(crate) fn of(draw: &BinnedDraw) -> Option<Self> {
        let footprint = &draw.state.footprint;
        if footprint.cut_off == GaussianCutOff::Ellipse {
            let deviations = f64::from(footprint.deviations);
            let unit2 = 0.5 / std::f64::consts::LN_2;
            return Some(Self::Ellipse(deviations * deviations * unit2));
        }
        TileCutOff::of(&draw.state, draw.viewport_corner).map(Self::Tiles)
    }

    /// The lanes of a block, in the tile at `corner`, whose pixels' centres lie within the cut-off of a Gaussian, a bit each.
    #[inline(always)]
    pub(crate) fn lanes<S: Simd>(&self, simd: S, splat: &Splat, surfel: Option<&Surfel>, place: BlockPlace) -> u64 {
        let BlockPlace { corner, block } = place;
        let middle = [f64::from(corner[0]) + BLOCK_X[block], f64::from(corner[1]) + BLOCK_Y[block]];
        match self {
            Self::Ellipse(most) => {
                let low = half_within(simd, splat, middle, *most, 0);
                low | half_within(simd, splat, middle, *most, 8) << 8
            }
            Self::Tiles(cut_off) => {
                let of_volume = || cut_off.tiles(splat.mean, splat.factor, splat.log2_opacity);
                let tiles = surfel.map_or_else(of_volume, |surfel| surfel.tiles);
                (0..BLOCK_PIXELS).fold(0, |bits, lane| {
                    let centre = [middle[0] + LANE_X_64[lane], middle[1] + LANE_Y_64[lane]];
                    let is_within = [0, 1].into_iter().all(|axis| {
                        let [first, end] = tiles[axis];
                        (first..end).contains(&cut_off.tile_of(axis, centre[axis]))
                    });
                    bits | u64::from(is_within) << lane
                })
            }
        }
    }

    /// The negated logarithm of the alpha floor beyond which a Gaussian of an opacity is cut off everywhere, if there is one.
    pub(crate) fn neg_log2_floor(&self, log2_opacity: f32) -> f32 {
        match self {
            Self::Ellipse(most) => (most - f64::from(log2_opacity)) as f32,
            Self::Tiles(_) => f32::INFINITY,
        }
    }
}

/// A bit for each of eight of a block's lanes, from number `first` on, with at most so much of `u^2 + v^2`. `middle` is the block's.
#[inline(always)]
fn half_within<S: Simd>(simd: S, splat: &Splat, middle: [f64; 2], most: f64, first: usize) -> u64 {
    let [a, b, c] = splat.factor;
    let dx = f64x8::from_slice(simd, &LANE_X_64[first..first + 8]) + middle[0] - splat.mean[0];
    let dy = f64x8::from_slice(simd, &LANE_Y_64[first..first + 8]) + middle[1] - splat.mean[1];
    let (u, v) = (dx * a, dx * b + dy * c);
    (u * u + v * v).simd_le(most).to_bitmask()
}
