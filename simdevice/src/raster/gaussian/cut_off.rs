//! Cut-offs: the shapes outside which Gaussians do not contribute, whatever their alpha. Everything is binary64.

use super::grid::{BLOCK_PIXELS, BLOCK_X, BLOCK_Y, LANE_X_64, LANE_Y_64};
use crate::gaussian::BinnedDraw;
use crate::gaussian::splat::Splat;
use crate::state::gaussian::GaussianCutOff;

/// Pixels along a side of the tiles that cut-offs are rounded to.
const CUT_TILE: f64 = 16.0;

/// The least square of half the difference of a covariance's eigenvalues, in px^4, that a square is found of.
const LEAST_SPREAD: f64 = 0.1;

/// The cut-off of a draw.
#[derive(Clone, Copy, Debug)]
pub(super) struct CutOff {
    shape: Shape,
    /// Standard deviations.
    deviations: f64,
    /// The upper left corner of the viewport's area, from which tiles count.
    corner: [f64; 2],
}

#[derive(Clone, Copy, Debug)]
enum Shape {
    Ellipse,
    TileSquare,
    TileRectangle,
}

impl CutOff {
    /// The cut-off of a draw, if it has one.
    pub(super) fn of(draw: &BinnedDraw) -> Option<Self> {
        let footprint = &draw.state.footprint;
        let shape = match footprint.cut_off {
            GaussianCutOff::None => return None,
            GaussianCutOff::Ellipse => Shape::Ellipse,
            GaussianCutOff::TileSquare => Shape::TileSquare,
            GaussianCutOff::TileRectangle => Shape::TileRectangle,
        };
        Some(Self {
            shape,
            deviations: footprint.deviations.into(),
            corner: draw.viewport_corner,
        })
    }

    /// The lanes of a block, in the tile at `corner`, whose pixels' centres lie within the cut-off of a Gaussian, a bit each.
    pub(super) fn lanes(&self, splat: &Splat, corner: [u32; 2], block: usize) -> u32 {
        let middle = [
            f64::from(corner[0]) + BLOCK_X[block],
            f64::from(corner[1]) + BLOCK_Y[block],
        ];
        let centres = |lane: usize| [middle[0] + LANE_X_64[lane], middle[1] + LANE_Y_64[lane]];
        let lanes = 0..BLOCK_PIXELS;
        let bits = |within: &dyn Fn([f64; 2]) -> bool| {
            lanes.fold(0, |bits, lane| {
                bits | u32::from(within(centres(lane))) << lane
            })
        };
        if matches!(self.shape, Shape::Ellipse) {
            let [a, b, c] = splat.factor;
            // The factor's squares are q / (2 ln 2).
            let most = self.deviations * self.deviations * (0.5 / std::f64::consts::LN_2);
            return bits(&|centre| {
                let [dx, dy] = [0, 1].map(|axis| centre[axis] - splat.mean[axis]);
                let (u, v) = (a * dx, b * dx + c * dy);
                u * u + v * v <= most
            });
        }
        let tiles = self.tiles(splat);
        bits(&|centre| {
            [0, 1].into_iter().all(|axis| {
                let tile = ((centre[axis] - self.corner[axis]) / CUT_TILE).floor();
                let [first, end] = tiles[axis];
                first <= tile && tile < end
            })
        })
    }

    /// The first tile, and the one after the last, along x and y.
    fn tiles(&self, splat: &Splat) -> [[f64; 2]; 2] {
        let [xx, xy, yy] = covariance(splat.factor);
        let from_corner = [0, 1].map(|axis| splat.mean[axis] - self.corner[axis]);
        match self.shape {
            // Pixel centres are whole numbers there, and a side that ends within a pixel has all of it.
            Shape::TileSquare => {
                let half_difference = 0.5 * (xx - yy);
                let spread = half_difference * half_difference + xy * xy;
                let greatest = 0.5 * (xx + yy) + spread.max(LEAST_SPREAD).sqrt();
                let radius = (self.deviations * greatest.sqrt()).ceil();
                from_corner.map(|mean| {
                    let mean = mean - 0.5;
                    [
                        ((mean - radius) / CUT_TILE).floor(),
                        ((mean + radius + (CUT_TILE - 1.0)) / CUT_TILE).floor(),
                    ]
                })
            }
            Shape::Ellipse | Shape::TileRectangle => {
                let radii = [xx, yy].map(|variance| (self.deviations * variance.sqrt()).ceil());
                [0, 1].map(|axis| {
                    let (mean, radius) = (from_corner[axis], radii[axis]);
                    [
                        ((mean - radius) / CUT_TILE).floor(),
                        ((mean + radius) / CUT_TILE).ceil(),
                    ]
                })
            }
        }
    }
}

/// The covariance xx, xy, yy in px^2 whose conic has this scaled Cholesky factor.
fn covariance([a, b, c]: [f64; 3]) -> [f64; 3] {
    let unit2 = 0.5 / std::f64::consts::LN_2;
    let xx = unit2 / (a * a);
    let slope = -b / c;
    // The determinant is xx unit^2 / c^2.
    [xx, slope * xx, unit2 / (c * c) + slope * slope * xx]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_covariance_comes_back_from_its_factor(
            xx in 0.3..400.0f64, yy in 0.3..400.0f64, correlation in -0.999..0.999f64,
        ) {
            let xy = correlation * (xx * yy).sqrt();
            let determinant = xx * yy - xy * xy;
            let unit = (0.5 / std::f64::consts::LN_2).sqrt();
            let vertical = (xx / determinant).sqrt() * unit;
            let back = covariance([unit / xx.sqrt(), -(xy / xx) * vertical, vertical]);
            for (back, given) in back.into_iter().zip([xx, xy, yy]) {
                prop_assert!((back - given).abs() <= 1e-9 * (xx + yy), "{back} {given}");
            }
        }
    }
}
