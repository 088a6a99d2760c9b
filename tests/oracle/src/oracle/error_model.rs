//! A bound on the distance of a correct binary32 implementation from binary64.
//!
//! The model tells which comparisons cannot be required of such an implementation. It is a first-order bound in the
//! unit roundoff u = 2^-24, per Gaussian and pixel. It is small if the Gaussian is well conditioned.
//!
//! # Alpha
//!
//! Let `S = M M^T + lowPass I` with rows `m0`, `m1` of M, `L` its Cholesky factor, `y = L^-1 d`,
//! `q = |y|^2` and `w = S^-1 d = L^-T y`. An error of the exponent `q / 2` is a relative error of
//! alpha.
//! - *M.* Row i is a product of the Jacobian's row `j_i`, two rotations and the scales, each
//!   rounded; the rounding error of a row of norm `|j_i|` is multiplied by the scales, so
//!   `|dm_i| <= c u |j_i| max(s)`. Since `dS = dM M^T + M dM^T`,
//!   `|d(q/2)| = |(dM^T w) . (M^T w)| <= c u (sum_i |w_i| |j_i| max(s)) sqrt(q)`, for
//!   `|M^T w|^2 <= w^T S w = q`.
//! - *L.* Elements have a relative error of a few u, and row i has the norm `sqrt(S_ii)`. In the
//!   same way `|d(q/2)| <= c u (sum_i |w_i| sqrt(S_ii)) sqrt(q)`; forward substitution is backward
//!   stable and adds the same form.
//! - *d.* Each component is rounded once, `|d_i| <= sqrt(S_ii) sqrt(q)`, and the mean's fraction
//!   may be held in binary32, below one pixel: `|d(q/2)| <= u sum_i |w_i| (sqrt(S_ii) sqrt(q) + 1)`.
//!
//! With `b_i = sqrt((|j_i| max(s))^2 + lowPass) >= sqrt(S_ii)` their sum is
//! `c u sum_i |w_i| (b_i sqrt(q) + 1)`, c = [`GEOMETRY`]. The other errors do not depend on the
//! geometry. The first is [`FIXED`] u = 2.9e-6, for the rounding of the exponent, the exponential, and
//! a few products, or for a row recurrence of eight steps in place of the exponential. (The sum above
//! is at least `q`, so it covers the rounding of `q / 2`.) The second is `2 u |log2 o|`, since the
//! exponent may contain the logarithm of the opacity. Opacity compensation multiplies by `|m0 x m1| / sqrt(det S)`,
//! whose relative error is `c u b_0 b_1 / |m0 x m1|`.
//!
//! # Transmittance
//!
//! `T' = T (1 - alpha)` has an absolute error bound:
//! `E' = E (1 - alpha) + T (error of alpha) + 2 u T'`. It grows with the number of layers, and
//! fast if alpha is near one. A clamped alpha has no error.

/// Unit roundoff of binary32.
pub const UNIT_ROUNDOFF: f64 = 1.0 / 16_777_216.0;

/// Relative error of alpha, in units of roundoff, that is allowed for every Gaussian.
pub const FIXED: f64 = 48.0;

/// Number of roundings allowed for the projected covariance and the quadratic form.
pub const GEOMETRY: f64 = 8.0;

/// The part of the model that belongs to one Gaussian.
#[derive(Clone, Copy, Debug)]
pub struct ErrorModel {
    /// `b_0, b_1` of the module's documentation, in px.
    spread: [f64; 2],
    /// The part that is the same for all pixels, in units of roundoff.
    fixed: f64,
}

impl ErrorModel {
    /// The model of a Gaussian: `spread` is `b_0, b_1`; `area` is `|m0 x m1|` if opacity is compensated.
    pub(super) fn new(spread: [f64; 2], opacity: f64, area: Option<f64>) -> Self {
        let folded = if opacity > 0.0 { 2.0 * opacity.log2().abs() } else { 0.0 };
        let compensation = area.map_or(0.0, |area| GEOMETRY * spread[0] * spread[1] / area);
        Self { spread, fixed: FIXED + folded + compensation }
    }

    /// Bound on the relative error of alpha, at most 1, with `w = S^-1 d` and `q = d . w`.
    pub fn alpha(&self, w: [f64; 2], q: f64) -> f64 {
        let root = q.sqrt();
        let geometry = w[0].abs() * (self.spread[0] * root + 1.0) + w[1].abs() * (self.spread[1] * root + 1.0);
        (UNIT_ROUNDOFF * (self.fixed + GEOMETRY * geometry)).min(1.0)
    }

    /// Bound on [`ErrorModel::alpha`] over all pixels whose quadratic form is at most `q`.
    ///
    /// `|w_i| <= sqrt((S^-1)_ii q)`, and the inverse of `S` has `S_yy / det S` and
    /// `S_xx / det S` on its diagonal.
    pub(super) fn alpha_up_to(&self, q: f64, covariance: [f64; 3], determinant: f64) -> f64 {
        let [xx, _, yy] = covariance;
        let w = [yy, xx].map(|opposite| (opposite / determinant * q).sqrt());
        self.alpha(w, q)
    }
}

/// A transmittance and the bound on its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transmittance {
    /// The binary64 value.
    pub value: f64,
    /// The bound on the distance of a binary32 implementation from it.
    pub error: f64,
}

impl Transmittance {
    /// The transmittance in front of the first Gaussian.
    pub const ONE: Self = Self { value: 1.0, error: 0.0 };

    /// The transmittance behind a layer of `alpha`, which is known to within `alpha_error`.
    pub fn behind(self, alpha: f64, alpha_error: f64) -> Self {
        let value = self.value * (1.0 - alpha);
        Self { value, error: self.error * (1.0 - alpha) + self.value * alpha_error + 2.0 * UNIT_ROUNDOFF * value }
    }
}
