//! The extended unified camera model, COLMAP's EUCM, as the polynomial of a fisheye.
//!
//! Khomutenko, Garcia, Martinet, "An Enhanced Unified Camera Model", 2016. A point at the angle t from the axis is at
//! sin t / (alpha sqrt(beta sin^2 t + cos^2 t) + (1 - alpha) cos t) from the principal point, for a focal length of 1.

use std::f64::consts::PI;

use crate::{Distortion, DistortionModel};

/// The coefficients of a polynomial.
const COUNT: usize = 6;

/// The greatest angle that is looked at.
const GREATEST_ANGLE: f64 = 0.95 * PI;

/// The angles at which the radius is looked at.
const STEPS: usize = 4096;

/// The model's parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct UnifiedLens {
    pub(super) alpha: f64,
    pub(super) beta: f64,
}

/// A polynomial in place of a lens.
pub(super) struct FittedLens {
    pub(super) distortion: Distortion,
    /// The greatest difference of the radius, for a focal length of 1.
    pub(super) error: f64,
}

impl UnifiedLens {
    /// The distance from the principal point of a point at `angle` from the axis; infinite where there is none.
    fn radius(&self, angle: f64) -> f64 {
        let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
        let length = (self.beta * sine * sine + cosine * cosine).sqrt();
        let depth = self.alpha * length + (1.0 - self.alpha) * cosine;
        if depth > 0.0 { sine / depth } else { f64::INFINITY }
    }

    /// The angle from which on the radius exceeds `reach` or no longer grows.
    fn greatest_angle(&self, reach: f64) -> f64 {
        let angle = |step: usize| GREATEST_ANGLE * step as f64 / STEPS as f64;
        let grows = |step: &usize| {
            let (before, after) = (self.radius(angle(step - 1)), self.radius(angle(*step)));
            before < reach && after > before && after.is_finite()
        };
        let steps = (1..=STEPS).take_while(grows).count();
        angle(steps.max(1))
    }

    /// The polynomial that has the lens's radius at the Chebyshev points of the angles up to that of `reach`, the greatest radius
    /// in the picture.
    pub(super) fn fitted(&self, reach: f64) -> FittedLens {
        let greatest = self.greatest_angle(reach);
        // In x, the square of the angle's share of the greatest one, the factor of the angle is 1 + x q(x).
        let nodes: [f64; COUNT] =
            std::array::from_fn(|index| 0.5 + 0.5 * libm::cos(PI * (index as f64 + 0.5) / COUNT as f64));
        let values = nodes.map(|x| {
            let angle = greatest * x.sqrt();
            (self.radius(angle) / angle - 1.0) / x
        });
        let mut scale = 1.0;
        let radial = interpolated(nodes, values).map(|coefficient| {
            scale *= greatest * greatest;
            coefficient / scale
        });
        let distortion = Distortion { model: DistortionModel::Polynomial, radial, ..Distortion::default() };
        let difference = |step: usize| {
            let angle = greatest * step as f64 / STEPS as f64;
            let place = distortion.distort([angle, 0.0]).map_or(f64::INFINITY, |place| place[0]);
            (place - self.radius(angle)).abs()
        };
        // At the greatest angle itself, the polynomial may fold.
        FittedLens { distortion, error: (0..STEPS).map(difference).fold(0.0, f64::max) }
    }
}

/// The coefficients of the polynomial, from the constant one on, that has `values` at `nodes`: Newton's divided differences.
fn interpolated(nodes: [f64; COUNT], values: [f64; COUNT]) -> [f64; COUNT] {
    let mut differences = values;
    for order in 1..COUNT {
        for index in (order..COUNT).rev() {
            differences[index] = (differences[index] - differences[index - 1]) / (nodes[index] - nodes[index - order]);
        }
    }
    let mut polynomial = [0.0; COUNT];
    for (node, difference) in nodes.into_iter().zip(differences).rev() {
        // The polynomial times x - node, plus the difference.
        let shifted: [f64; COUNT] = std::array::from_fn(|power| if power == 0 { 0.0 } else { polynomial[power - 1] });
        polynomial = std::array::from_fn(|power| shifted[power] - node * polynomial[power]);
        polynomial[0] += difference;
    }
    polynomial
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_through_points_is_that_polynomial() {
        let nodes = [0.1, 0.3, 0.35, 0.6, 0.8, 0.95];
        let expected = [1.0, -2.0, 0.5, 3.0, -1.5, 0.25];
        let values = nodes.map(|x: f64| expected.iter().rev().fold(0.0, |sum, c| sum * x + c));
        for (found, expected) in interpolated(nodes, values).into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }

    #[test]
    fn radii_are_those_of_projections_that_the_model_contains() {
        // With alpha of 0 it is a pinhole, with alpha of 1 and beta of 1 orthographic, with alpha of a half stereographic.
        let of = |alpha, beta| move |angle| UnifiedLens { alpha, beta }.radius(angle);
        for angle in [0.1, 0.5, 1.2_f64] {
            assert!((of(0.0, 1.0)(angle) - angle.tan()).abs() < 1e-12);
            assert!((of(1.0, 1.0)(angle) - angle.sin()).abs() < 1e-12);
            assert!((of(0.5, 1.0)(angle) - 2.0 * (angle / 2.0).tan()).abs() < 1e-12);
        }
    }

    #[test]
    fn polynomials_are_close_to_the_lens_in_the_picture() {
        for (alpha, beta, reach) in
            [(0.6, 1.1, 1.5), (0.8, 1.3, 1.05), (0.3, 0.8, 1.2), (0.9, 0.6, 1.4), (0.1, 1.0, 1.0)]
        {
            let lens = UnifiedLens { alpha, beta };
            let fitted = lens.fitted(reach);
            assert!(fitted.error < 2e-5, "{alpha} {beta}: {}", fitted.error);
            assert!(lens.radius(lens.greatest_angle(reach)) >= reach, "{alpha} {beta}");
        }
    }

    #[test]
    fn a_fold_in_the_picture_is_kept() {
        // sin t, which turns at a right angle.
        let fitted = UnifiedLens { alpha: 1.0, beta: 1.0 }.fitted(2.0);
        assert!((fitted.distortion.fold() - PI / 2.0).abs() < 1e-3, "{}", fitted.distortion.fold());
        assert!(fitted.error < 1e-6, "{}", fitted.error);
    }
}
