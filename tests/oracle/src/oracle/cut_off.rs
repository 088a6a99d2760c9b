//! Cut-offs: the shapes outside which a Gaussian does not contribute, whatever its alpha.
//!
//! Each is a comparison that binary32 may decide otherwise near the shape's edge. Granted are 16 units of roundoff of the
//! radius before it is rounded up, as many of the magnitudes that a side of a box is a sum of, and the error that alpha has,
//! of the ellipse.

use super::compensation::CompensatedOpacity;
use super::error_model::{PrecisionClass, Rounding, UNIT_ROUNDOFF};
use super::{OracleCutOff, OracleState};

/// Pixels along a tile's side.
const TILE: f64 = 16.0;

/// The least square of half the difference of the eigenvalues that a square is found of, in px^4.
const LEAST_SPREAD: f64 = 0.1;

/// Relative roundings of radii and sides.
const ROUNDINGS: f64 = 16.0;

/// The place of a pixel's centre about a Gaussian.
pub(super) struct Place {
    /// The centre, in pixels from the corner of the viewport.
    pub(super) centre: [f64; 2],
    /// The mean of the Gaussian, or of its copy that counts there.
    pub(super) mean: [f64; 2],
    /// The covariance xx, xy, yy.
    pub(super) covariance: [f64; 3],
    /// The opacity of the Gaussian after compensation.
    pub(super) compensated: CompensatedOpacity,
    /// The quadratic form there.
    pub(super) q: f64,
    /// The relative error of alpha there.
    pub(super) error: f64,
    /// The roundings of its projection.
    pub(super) rounding: Rounding,
}

impl Place {
    /// The relative error of radii.
    fn of_radius(&self) -> f64 {
        UNIT_ROUNDOFF
            * match self.rounding.class {
                PrecisionClass::Full => ROUNDINGS,
                PrecisionClass::Relaxed => ROUNDINGS.max(self.rounding.of_lengths()),
            }
    }

    /// The error of a side of a box: `magnitude` is the sum of what it is a sum of.
    fn of_side(&self, axis: usize, magnitude: f64) -> f64 {
        let rounded = ROUNDINGS * UNIT_ROUNDOFF * magnitude;
        match self.rounding.class {
            PrecisionClass::Full => rounded,
            PrecisionClass::Relaxed => rounded + UNIT_ROUNDOFF * self.rounding.place[axis],
        }
    }
}

/// Tells if a Gaussian is cut off at a pixel, and if that could be decided otherwise.
pub(super) fn is_cut(place: &Place, state: &OracleState) -> (bool, bool) {
    let k = f64::from(state.cut_off_deviations);
    match state.cut_off {
        OracleCutOff::None => (false, false),
        OracleCutOff::Ellipse => {
            let most = k * k;
            // An error of the exponent q / 2 is a relative one of alpha.
            let near = (place.q - most).abs() <= 2.0 * place.error + place.of_radius() * most;
            (place.q > most, near)
        }
        OracleCutOff::TileSquare | OracleCutOff::TileRectangle | OracleCutOff::TileRectangleCompensated => {
            let is_within = |slack: f64| {
                let Some(boxed) = boxed(place, state, slack) else {
                    return false;
                };
                [0, 1].iter().all(|&axis| {
                    let tile = (place.centre[axis] / TILE).floor();
                    let [first, end] = boxed[axis];
                    first <= tile && tile < end
                })
            };
            (!is_within(0.0), is_within(-1.0) != is_within(1.0))
        }
    }
}

/// The standard deviations of a box, none if nothing is drawn, of an opacity that is greater by `slack` times its error.
fn deviations(place: &Place, state: &OracleState, slack: f64) -> Option<f64> {
    let k = f64::from(state.cut_off_deviations);
    let floor = f64::from(state.alpha_floor);
    if state.cut_off != OracleCutOff::TileRectangleCompensated || floor == 0.0 {
        return Some(k);
    }
    let CompensatedOpacity { value, error } = place.compensated;
    let above = value * (1.0 + slack * error) / floor;
    (above >= 1.0).then(|| k.min((2.0 * above.ln()).sqrt()))
}

/// The first tile and the one after the last along x and y, of a box whose sides are moved out by `slack` times their error; none
/// if nothing is drawn.
fn boxed(place: &Place, state: &OracleState, slack: f64) -> Option<[[f64; 2]; 2]> {
    let k = deviations(place, state, slack)?;
    let [xx, xy, yy] = place.covariance;
    let radius = |variance: f64| (k * variance.sqrt() * (1.0 + slack * place.of_radius())).ceil();
    let side = |axis: usize, mean: f64, radius: f64| slack * place.of_side(axis, mean.abs() + radius + TILE);
    if state.cut_off == OracleCutOff::TileSquare {
        // The longer axis of the ellipse; pixel centres are whole numbers.
        let half_difference = 0.5 * (xx - yy);
        let spread = (half_difference * half_difference + xy * xy).max(LEAST_SPREAD);
        let radius = radius(0.5 * (xx + yy) + spread.sqrt());
        return Some([0, 1].map(|axis| {
            let mean = place.mean[axis] - 0.5;
            let slack = side(axis, mean, radius);
            [((mean - radius - slack) / TILE).floor(), ((mean + radius + slack + (TILE - 1.0)) / TILE).floor()]
        }));
    }
    Some([0, 1].map(|axis| {
        let (mean, radius) = (place.mean[axis], radius([xx, yy][axis]));
        let slack = side(axis, mean, radius);
        [((mean - radius - slack) / TILE).floor(), ((mean + radius + slack) / TILE).ceil()]
    }))
}
