//! Cut-offs in whole tiles: which tiles of 16x16 pixels a Gaussian is drawn in, whatever its alpha. Where they are the device's
//! own tiles, its lists leave the others out, and pixels need no test.

use super::camera::period;
use crate::limits::TILE_SIZE;
use crate::state::Viewport;
use crate::state::gaussian::{Camera, GaussianCutOff, GaussianState};
use std::f64::consts::LN_2;

/// Pixels along a side of the tiles that cut-offs are rounded to.
pub(crate) const CUT_TILE: f64 = 16.0;

/// The least square of half the difference of a covariance's eigenvalues, in px^4, that a square is found of.
const LEAST_SPREAD: f64 = 0.1;

/// A cut-off in tiles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileCutOff {
    /// Tiles of a square, not of a rectangle.
    is_square: bool,
    /// Standard deviations.
    deviations: f64,
    /// The compensation that makes the deviations fewer, if one does.
    compensation: Option<Compensation>,
    /// The upper left corner of the viewport's area, from which tiles count.
    corner: [f64; 2],
}

/// The compensation of opacity for the low-pass filter, which some cut-offs know whether or not it is drawn.
#[derive(Clone, Copy, Debug)]
struct Compensation {
    /// True if the opacity that is drawn is compensated already.
    is_drawn: bool,
    /// The low-pass variance in px^2.
    low_pass: f64,
    /// The least ratio of determinants.
    least_ratio: f64,
    /// The logarithm of the alpha floor.
    log2_floor: f64,
}

impl Compensation {
    /// The deviations at which the alpha of a Gaussian, after compensation, reaches the floor; none if it is below it at the
    /// mean. The covariance is the one after the filter, in px^2.
    fn reach(&self, [xx, xy, yy]: [f64; 3], log2_opacity: f32) -> Option<f64> {
        let mut log2_range = f64::from(log2_opacity) - self.log2_floor;
        if !self.is_drawn {
            let before = (xx - self.low_pass) * (yy - self.low_pass) - xy * xy;
            let ratio = (before / (xx * yy - xy * xy)).max(self.least_ratio);
            log2_range += 0.5 * libm::log2(ratio);
        }
        (log2_range >= 0.0).then(|| (2.0 * LN_2 * log2_range).sqrt())
    }
}

impl TileCutOff {
    /// The cut-off of a state, if it is one in tiles.
    pub(crate) fn of(state: &GaussianState, viewport_corner: [f64; 2]) -> Option<Self> {
        let footprint = &state.footprint;
        let (is_square, knows_compensation) = match footprint.cut_off {
            GaussianCutOff::TileSquare => (true, false),
            GaussianCutOff::TileRectangle => (false, false),
            GaussianCutOff::TileRectangleCompensated => (false, state.alpha_floor > 0.0),
            GaussianCutOff::None | GaussianCutOff::Ellipse => return None,
        };
        let compensation = knows_compensation.then(|| Compensation {
            is_drawn: state.opacity_compensated,
            low_pass: state.low_pass_variance.into(),
            least_ratio: footprint.compensation_floor.into(),
            log2_floor: libm::log2(state.alpha_floor.into()),
        });
        Some(Self { is_square, deviations: footprint.deviations.into(), compensation, corner: viewport_corner })
    }

    /// True if its tiles are the device's.
    pub(crate) fn is_in_device_tiles(&self) -> bool {
        let whole = |corner: f64| corner % CUT_TILE == 0.0;
        f64::from(TILE_SIZE) == CUT_TILE && self.corner.into_iter().all(whole)
    }

    /// The tile of a pixel's centre along an axis.
    pub(crate) fn tile_of(&self, axis: usize, centre: f64) -> f64 {
        libm::floor((centre - self.corner[axis]) / CUT_TILE)
    }

    /// The first tile, and the one after the last, along x and y, of a Gaussian with a mean, in framebuffer pixels, the scaled
    /// Cholesky factor of its conic, and the logarithm of its opacity.
    pub(crate) fn tiles(&self, mean: [f64; 2], factor: [f64; 3], log2_opacity: f32) -> [[f64; 2]; 2] {
        let [xx, xy, yy] = covariance(factor);
        let from_corner = [0, 1].map(|axis| mean[axis] - self.corner[axis]);
        if self.is_square {
            // Pixel centres are whole numbers there, and a side that ends within a pixel has all of it.
            let half_difference = 0.5 * (xx - yy);
            let spread = half_difference * half_difference + xy * xy;
            let greatest = 0.5 * (xx + yy) + spread.max(LEAST_SPREAD).sqrt();
            let radius = libm::ceil(self.deviations * greatest.sqrt());
            return from_corner.map(|mean| {
                let mean = mean - 0.5;
                [libm::floor((mean - radius) / CUT_TILE), libm::floor((mean + radius + (CUT_TILE - 1.0)) / CUT_TILE)]
            });
        }
        let halves = [xx, yy].map(f64::sqrt);
        let Some(compensation) = &self.compensation else {
            return self.rectangle(mean, halves);
        };
        compensation.reach([xx, xy, yy], log2_opacity).map_or([[0.0; 2]; 2], |reach| {
            let deviations = self.deviations.min(reach);
            Self { deviations, ..*self }.rectangle(mean, halves)
        })
    }

    /// The first tile, and the one after the last, along x and y, of a rectangle about a place in framebuffer pixels. `halves` are
    /// half its sides for one standard deviation.
    pub(crate) fn rectangle(&self, middle: [f64; 2], halves: [f64; 2]) -> [[f64; 2]; 2] {
        [0, 1].map(|axis| {
            let (middle, radius) = (middle[axis] - self.corner[axis], libm::ceil(self.deviations * halves[axis]));
            [libm::floor((middle - radius) / CUT_TILE), libm::ceil((middle + radius) / CUT_TILE)]
        })
    }

    /// The same tiles, numbered as the device's, which the cut-off's own must be.
    pub(crate) fn device_tiles(&self, tiles: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
        [0, 1].map(|axis| {
            let first = self.corner[axis] / CUT_TILE;
            tiles[axis].map(|tile| tile + first)
        })
    }
}

/// The cut-off that lists of tiles see to alone: one in the device's own tiles, of pictures that do not repeat.
pub(crate) fn list_cut_off(state: &GaussianState, camera: &Camera, viewport: &Viewport) -> Option<TileCutOff> {
    let corner = [viewport.x, viewport.y].map(f64::from);
    TileCutOff::of(state, corner).filter(|cut_off| cut_off.is_in_device_tiles() && period(camera).is_none())
}

/// The covariance xx, xy, yy in px^2 whose conic has this scaled Cholesky factor.
fn covariance([a, b, c]: [f64; 3]) -> [f64; 3] {
    let unit2 = 0.5 / LN_2;
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
        #[gaurast_runner::test]
        fn a_covariance_comes_back_from_its_factor(
            xx in 0.3..400.0f64, yy in 0.3..400.0f64, correlation in -0.999..0.999f64,
        ) {
            let xy = correlation * (xx * yy).sqrt();
            let determinant = xx * yy - xy * xy;
            let unit = (0.5 / LN_2).sqrt();
            let vertical = (xx / determinant).sqrt() * unit;
            let back = covariance([unit / xx.sqrt(), -(xy / xx) * vertical, vertical]);
            for (back, given) in back.into_iter().zip([xx, xy, yy]) {
                prop_assert!((back - given).abs() <= 1e-9 * (xx + yy), "{back} {given}");
            }
        }
    }
}
