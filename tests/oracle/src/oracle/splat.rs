//! A projected Gaussian, and step 6: its alpha at a pixel centre.

use super::OracleState;
use super::compensation::CompensatedOpacity;
use super::cut_off::{Place, is_cut};
use super::error_model::ErrorModel;
use super::own_axes::OwnAxes;
use super::panorama;
use super::surfel::Surfel;

/// A Gaussian after projection, as step 6 needs it.
#[derive(Clone, Copy, Debug)]
pub struct Splat {
    /// Its place in primitive order.
    pub index: usize,
    /// Centre in pixels from the viewport's upper left corner, not clamped to it.
    pub mean: [f64; 2],
    /// Covariance `xx, xy, yy` in px^2, low-pass filter included.
    pub covariance: [f64; 3],
    /// Its determinant, evaluated without cancellation.
    pub determinant: f64,
    /// The number of pixels after which the picture repeats to the right and to the left, or infinity.
    pub period: f64,
    /// The factor with which the quadratic form is evaluated.
    pub cholesky: Cholesky,
    /// Opacity, after compensation if the state asks for it.
    pub opacity: f64,
    /// Opacity after compensation, which a cut-off may know.
    pub compensated: CompensatedOpacity,
    /// Colour, at least 0.
    pub color: [f64; 3],
    /// The value by which it is sorted, rounded to binary32 unless the rules are others.
    pub key: f64,
    /// The depth variable, rounded to binary32. (With vertex-shader projection the depth, rounded so.)
    pub z: f32,
    /// The depth variable, rounded to binary32: with vertex-shader projection w.
    pub distance: f32,
    /// The depth of its centre, of which a pixel has a mean; zero until somebody asks for that.
    pub depth: f64,
    /// The possible error of that depth beyond binary64's.
    pub depth_error: f64,
    /// Its disc in camera axes, if it is a disc.
    pub surfel: Option<Surfel>,
    /// The source of its depths along rays.
    pub own_axes: OwnAxes,
    /// True if the key is within its own error of the midpoint of two keys.
    pub key_undecidable: bool,
    /// The products that the depth variable of perspective is a sum of, but for the eye's: Gaussians that have the same have
    /// the same key, whatever is rounded.
    pub key_terms: [f64; 3],
    /// True if its mean may lie beyond the fold of the lens, so that it may be drawn or not.
    pub may_be_folded: bool,
    /// The bound on the error of a binary32 implementation for this Gaussian.
    pub error: ErrorModel,
}

/// Lower triangular factor of a 2x2 covariance, pivoted on its larger diagonal element.
#[derive(Clone, Copy, Debug)]
pub struct Cholesky {
    /// True if y comes first.
    pub swapped: bool,
    /// The factor's elements `l11, l21, l22`.
    pub l: [f64; 3],
}

impl Cholesky {
    /// Factors `[xx, xy, yy]`. The last pivot comes from the determinant, not from a difference.
    pub(super) fn new([xx, xy, yy]: [f64; 3], determinant: f64) -> Self {
        let swapped = yy > xx;
        let larger = if swapped { yy } else { xx };
        let l11 = larger.sqrt();
        Self { swapped, l: [l11, xy / l11, (determinant / larger).sqrt()] }
    }

    /// `q = d^T S^-1 d` as a sum of two squares, and `w = S^-1 d`.
    pub fn solve(&self, d: [f64; 2]) -> (f64, [f64; 2]) {
        let [l11, l21, l22] = self.l;
        let (first, second) = if self.swapped { (d[1], d[0]) } else { (d[0], d[1]) };
        let y1 = first / l11;
        let y2 = (second - l21 * y1) / l22;
        let w2 = y2 / l22;
        let w1 = (y1 - l21 * w2) / l11;
        let w = if self.swapped { [w2, w1] } else { [w1, w2] };
        (y1 * y1 + y2 * y2, w)
    }
}

/// Alpha of a Gaussian at a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Alpha {
    /// Step 6's value, ceiling applied.
    pub value: f64,
    /// The bound on the distance of a binary32 implementation from it.
    pub error: f64,
    /// True if the Gaussian is cut off there.
    pub is_cut: bool,
    /// True if that could be decided otherwise.
    pub cut_undecidable: bool,
}

impl Alpha {
    const NOTHING: Self = Self { value: 0.0, error: 0.0, is_cut: false, cut_undecidable: false };

    /// Returns true if it is cut off for certain.
    pub fn is_certainly_cut(&self) -> bool {
        self.is_cut && !self.cut_undecidable
    }
}

impl Splat {
    /// Reports whether the key is certainly another Gaussian's, too.
    pub(super) fn has_key_of(&self, other: &Self) -> bool {
        self.key_terms == other.key_terms && self.key == other.key
    }

    /// Step 6 at the centre of pixel (x, y).
    pub fn alpha(&self, x: u32, y: u32, state: &OracleState) -> Alpha {
        let dx = f64::from(x) + 0.5 - self.mean[0];
        let Some(dx) = panorama::nearest(dx, self.period) else {
            return Alpha::NOTHING;
        };
        let d = [dx, f64::from(y) + 0.5 - self.mean[1]];
        let (q, relative) = match &self.surfel {
            Some(surfel) => surfel.distance([f64::from(x) + 0.5, f64::from(y) + 0.5]),
            None => {
                let (q, w) = self.cholesky.solve(d);
                (q, self.error.alpha(w, q))
            }
        };
        let centre = [f64::from(x) + 0.5, f64::from(y) + 0.5];
        let of_disc = self.surfel.and_then(|surfel| Some((surfel.mean, surfel.rectangle?)));
        let (mean, covariance) = match of_disc {
            Some((middle, [xx, yy])) => (middle, [xx, 0.0, yy]),
            None => ([centre[0] - d[0], centre[1] - d[1]], self.covariance),
        };
        let place = Place {
            centre,
            mean,
            covariance,
            compensated: self.compensated,
            q,
            error: relative,
            rounding: *self.error.rounding(),
        };
        let (is_cut, cut_undecidable) = is_cut(&place, state);
        let cut_undecidable = cut_undecidable || self.may_be_folded;
        let whole = Alpha { is_cut, cut_undecidable, ..Alpha::NOTHING };
        let unclamped = self.opacity * (-0.5 * q).exp();
        let error = unclamped * relative;
        let ceiling = f64::from(state.alpha_ceiling);
        if unclamped - error > ceiling {
            Alpha { value: ceiling, error: 0.0, ..whole }
        } else if unclamped > ceiling {
            Alpha { value: ceiling, error, ..whole }
        } else {
            Alpha { value: unclamped, error, ..whole }
        }
    }
}
