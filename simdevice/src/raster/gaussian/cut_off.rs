//! Cut-offs: the shapes outside which Gaussians do not contribute, whatever their alpha, pixel by pixel in binary64.

use super::grid::{BLOCK_PIXELS, BLOCK_X, BLOCK_Y, LANE_X_64, LANE_Y_64};
use crate::gaussian::BinnedDraw;
use crate::gaussian::splats::splat::Splat;
use crate::gaussian::view::cut_off::TileCutOff;
use crate::state::gaussian::GaussianCutOff;

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
    pub(crate) fn lanes(&self, splat: &Splat, corner: [u32; 2], block: usize) -> u32 {
        let middle = [f64::from(corner[0]) + BLOCK_X[block], f64::from(corner[1]) + BLOCK_Y[block]];
        let bits = |is_within: &dyn Fn([f64; 2]) -> bool| {
            (0..BLOCK_PIXELS).fold(0, |bits, lane| {
                let centre = [middle[0] + LANE_X_64[lane], middle[1] + LANE_Y_64[lane]];
                bits | u32::from(is_within(centre)) << lane
            })
        };
        match self {
            Self::Ellipse(most) => {
                let [a, b, c] = splat.factor;
                bits(&|centre| {
                    let [dx, dy] = [0, 1].map(|axis| centre[axis] - splat.mean[axis]);
                    let (u, v) = (a * dx, b * dx + c * dy);
                    u * u + v * v <= *most
                })
            }
            Self::Tiles(cut_off) => {
                let tiles = cut_off.tiles(splat.mean, splat.factor);
                bits(&|centre| {
                    [0, 1].into_iter().all(|axis| {
                        let [first, end] = tiles[axis];
                        (first..end).contains(&cut_off.tile_of(axis, centre[axis]))
                    })
                })
            }
        }
    }
}
