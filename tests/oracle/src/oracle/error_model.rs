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
//! # Relaxed
//!
//! With [`PrecisionClass::Relaxed`] the projection is in binary32 as well. Let `S` be the length of the vector of sums of
//! magnitudes that the centre relative to the eye is a difference of, `|A||p| + |b| + |e|`, and `h = 1 + S / z` the
//! *nearness*. Each of its components is wrong by a few u S, a direction and the Jacobian relatively by a few u h, and the
//! mean by a few u of `M_i`: the picture's side, the principal point, the mean itself, and `|j_i| S`. Constants are larger,
//! for Vulkan grants 2.5 ulp to a division, 2 to an inverse root, and 3 + 2 |x| to a power of two. Colours come from a
//! direction that is wrong by u h. What errors of alpha and of colours make of a pixel's colour is their sum over its
//! Gaussians, each times T.
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

/// A precision class of the extension.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PrecisionClass {
    /// Positions, projection and covariances in binary64 or an equivalent, the rest in binary32.
    #[default]
    Full,
    /// binary32 throughout.
    Relaxed,
}

/// The roundings that [`PrecisionClass::Relaxed`] grants, in units of roundoff.
pub mod relaxed {
    /// Relative error of alpha for every Gaussian, in place of [`FIXED`](super::FIXED).
    pub const FIXED: f64 = 256.0;
    /// Roundings of lengths in the picture, in place of [`GEOMETRY`](super::GEOMETRY), of which a Gaussian's nearness is a factor.
    pub const GEOMETRY: f64 = 32.0;
    /// Roundings of a mean, of its magnitudes.
    pub const PLACE: f64 = 16.0;
    /// Roundings of a depth variable, of the magnitudes that it is a sum of.
    pub const DEPTH: f64 = 8.0;
    /// Roundings of a colour, of the magnitudes that it is a sum of.
    pub const COLOR: f64 = 64.0;
    /// Roundings of a determinant, of its products, where a vertex shader gives the covariance.
    pub const DETERMINANT: f64 = 8.0;
    /// Roundings of a depth, of its magnitudes.
    pub const MAPPING: f64 = 8.0;
}

/// The roundings of a Gaussian's projection.
#[derive(Clone, Copy, Debug)]
pub struct Rounding {
    /// The possible error of the mean, in units of roundoff and pixels.
    pub place: [f64; 2],
    /// The possible error of a sigma point, in the same units; 0 without the unscented transform.
    pub points: [f64; 2],
    /// The factor by which the direction to the Gaussian has more roundings than one that is not a difference: 1, or with
    /// [`PrecisionClass::Relaxed`] more where the eye and the centre are much farther from the origin than from each other.
    pub nearness: f64,
    /// The possible error of the depth variable beyond binary64's.
    pub depth: f64,
    /// The possible relative error of the determinant, in units of roundoff, where it is a difference of products.
    pub determinant: f64,
    /// The possible error of the colour beyond the contract's, per unit of the greatest colour.
    pub color: f64,
    /// The class.
    pub class: PrecisionClass,
}

impl Rounding {
    /// The roundings of [`PrecisionClass::Full`].
    pub const FULL: Self = Self {
        place: [GEOMETRY; 2],
        points: [0.0; 2],
        nearness: 1.0,
        depth: 0.0,
        determinant: 0.0,
        color: 0.0,
        class: PrecisionClass::Full,
    };

    /// Relative roundings of lengths in the picture, in units of roundoff.
    pub fn of_lengths(&self) -> f64 {
        match self.class {
            PrecisionClass::Full => GEOMETRY,
            PrecisionClass::Relaxed => relaxed::GEOMETRY * self.nearness,
        }
    }

    /// The relative error of alpha that is allowed for every Gaussian, in units of roundoff.
    pub fn fixed(&self) -> f64 {
        match self.class {
            PrecisionClass::Full => FIXED,
            PrecisionClass::Relaxed => relaxed::FIXED,
        }
    }
}

/// The part of the model that belongs to one Gaussian.
#[derive(Clone, Copy, Debug)]
pub struct ErrorModel {
    /// `b_0, b_1` of the module's documentation, in px.
    spread: [f64; 2],
    /// The part that is the same for all pixels, in units of roundoff.
    fixed: f64,
    rounding: Rounding,
}

impl ErrorModel {
    /// The model of a Gaussian: `spread` is `b_0, b_1`; `area` is `|m0 x m1|` if opacity is compensated.
    pub(super) fn new(spread: [f64; 2], opacity: f64, area: Option<f64>, rounding: Rounding) -> Self {
        let folded = if opacity > 0.0 { 2.0 * opacity.log2().abs() } else { 0.0 };
        let compensation = area.map_or(0.0, |area| rounding.of_lengths() * spread[0] * spread[1] / area);
        Self { spread, fixed: rounding.fixed() + folded + compensation, rounding }
    }

    /// The roundings of the Gaussian's projection.
    pub(super) fn rounding(&self) -> &Rounding {
        &self.rounding
    }

    /// Bound on the relative error of alpha, at most 1, with `w = S^-1 d` and `q = d . w`.
    pub fn alpha(&self, w: [f64; 2], q: f64) -> f64 {
        let root = q.sqrt();
        let of_lengths = self.rounding.of_lengths();
        let Rounding { place, points, .. } = self.rounding;
        let part = |i: usize| w[i].abs() * ((of_lengths * self.spread[i] + points[i]) * root + place[i]);
        let of_determinant = 0.5 * q * self.rounding.determinant;
        (UNIT_ROUNDOFF * (self.fixed + part(0) + part(1) + of_determinant)).min(1.0)
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
