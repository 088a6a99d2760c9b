//! The distortion of a lens.

use std::fmt::{self, Display, Formatter};

use gaurast::vk::{GaussianCameraDistortionGAURAST, GaussianDistortionModelGAURAST};
use serde::{Deserialize, Serialize};

/// The square of the greatest radius at which a fold is looked for. No picture reaches it.
const GREATEST_SQUARE: f64 = 1e24;

/// The least argument whose arcus tangent is computed. Below, its series has all digits.
const LEAST_ARGUMENT: f64 = 1e-4;

/// The form of a lens's distortion.
///
/// The projection model of a camera gives a point an ideal place (u, v) at the distance r from the principal point, for focal
/// lengths of 1: (x / z, y / z) for a pinhole, the angle from the axis times the direction for a fisheye. The distorted place
/// takes its place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DistortionModel {
    /// (u, v) times (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6), and the tangential and thin prism parts
    /// of (u, v): OpenCV's.
    #[default]
    Rational,
    /// (u, v) times 1 + k1 r^2 + ... + k6 r^12, and the tangential and thin prism parts of (u, v): OpenCV's fisheye.
    Polynomial,
    /// (u, v) times 1 + k1 r^2 + ... + k6 r^12, and the tangential and thin prism parts of that: Aria's Fisheye624.
    PolynomialFirst,
    /// (u, v) times atan(2 r tan(omega / 2)) / (r omega), where omega is the first radial coefficient: Devernay and Faugeras's.
    FieldOfView,
    /// The place whose quotient by 1 + k r^2, of its own r, is (u, v), where k is the first radial coefficient: Fitzgibbon's.
    Division,
}

impl DistortionModel {
    /// The model's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rational => "rational",
            Self::Polynomial => "polynomial",
            Self::PolynomialFirst => "polynomial first",
            Self::FieldOfView => "field of view",
            Self::Division => "division",
        }
    }

    fn to_vulkan(self) -> GaussianDistortionModelGAURAST {
        match self {
            Self::Rational => GaussianDistortionModelGAURAST::RATIONAL,
            Self::Polynomial => GaussianDistortionModelGAURAST::POLYNOMIAL,
            Self::PolynomialFirst => GaussianDistortionModelGAURAST::POLYNOMIAL_FIRST,
            Self::FieldOfView => GaussianDistortionModelGAURAST::FIELD_OF_VIEW,
            Self::Division => GaussianDistortionModelGAURAST::DIVISION,
        }
    }
}

/// The distortion of a lens. An ideal lens has coefficients of 0 alone. Displayed as the other ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(default)]
pub struct Distortion {
    /// The form.
    pub model: DistortionModel,
    /// k1 to k6; omega in radians of a field of view, and k of a division, are the first.
    pub radial: [f64; 6],
    /// p1 and p2: 2 p1 u v + p2 (r^2 + 2 u^2) is added to u, and p1 (r^2 + 2 v^2) + 2 p2 u v to v.
    pub tangential: [f64; 2],
    /// s1 to s4: s1 r^2 + s2 r^4 is added to u, and s3 r^2 + s4 r^4 to v.
    pub thin_prism: [f64; 4],
}

impl Distortion {
    /// Returns true if the lens is ideal.
    pub fn is_none(&self) -> bool {
        self.coefficients().all(|(_, coefficient)| coefficient == 0.0)
    }

    /// The coefficients with their names.
    fn coefficients(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let radial = match self.model {
            DistortionModel::FieldOfView => ["omega", "k2", "k3", "k4", "k5", "k6"],
            DistortionModel::Division => ["k", "k2", "k3", "k4", "k5", "k6"],
            _ => ["k1", "k2", "k3", "k4", "k5", "k6"],
        };
        let radial = radial.into_iter().zip(self.radial);
        let tangential = ["p1", "p2"].into_iter().zip(self.tangential);
        radial.chain(tangential).chain(["s1", "s2", "s3", "s4"].into_iter().zip(self.thin_prism))
    }

    /// Returns true if the coefficients are finite in binary32, and the model has all that are not 0.
    pub fn is_valid(&self) -> bool {
        let is_alone = self.coefficients().skip(1).all(|(_, coefficient)| coefficient == 0.0);
        let fits = match self.model {
            DistortionModel::Rational | DistortionModel::Polynomial | DistortionModel::PolynomialFirst => true,
            DistortionModel::FieldOfView => is_alone && (0.0..std::f64::consts::PI).contains(&self.radial[0]),
            DistortionModel::Division => is_alone,
        };
        fits && self.coefficients().all(|(_, coefficient)| (coefficient as f32).is_finite())
    }

    /// The fold: the least r at which a greater r no longer moves the radial part of the place outwards, or at which a
    /// denominator is 0. Infinite if there is none. Nothing at or beyond it is in the picture.
    pub fn fold(&self) -> f64 {
        let [k1, k2, k3, k4, k5, k6] = self.radial;
        match self.model {
            DistortionModel::Rational => fold_of_quotient(&[1.0, k1, k2, k3], &[1.0, k4, k5, k6]),
            DistortionModel::Polynomial | DistortionModel::PolynomialFirst => {
                fold_of_quotient(&[1.0, k1, k2, k3, k4, k5, k6], &[1.0])
            }
            DistortionModel::Division if k1 > 0.0 => 0.5 / k1.sqrt(),
            DistortionModel::Division | DistortionModel::FieldOfView => f64::INFINITY,
        }
    }

    /// The distorted place of an ideal one. None at and beyond the fold.
    pub fn distort(&self, ideal: [f64; 2]) -> Option<[f64; 2]> {
        let square = ideal[0] * ideal[0] + ideal[1] * ideal[1];
        if square.sqrt() >= self.fold() {
            return None;
        }
        let factor = self.factor(square);
        let radial = ideal.map(|part| part * factor);
        let is_first = self.model == DistortionModel::PolynomialFirst;
        let lateral = self.lateral(if is_first { radial } else { ideal });
        Some([radial[0] + lateral[0], radial[1] + lateral[1]])
    }

    /// The factor of the radial part by the square of r.
    fn factor(&self, square: f64) -> f64 {
        let [k1, k2, k3, k4, k5, k6] = self.radial;
        match self.model {
            DistortionModel::Rational => value(&[1.0, k1, k2, k3], square) / value(&[1.0, k4, k5, k6], square),
            DistortionModel::Polynomial | DistortionModel::PolynomialFirst => {
                value(&[1.0, k1, k2, k3, k4, k5, k6], square)
            }
            DistortionModel::FieldOfView => {
                let steepness = 2.0 * libm::tan(k1 / 2.0);
                let x = steepness * square.sqrt();
                let quotient = if x < LEAST_ARGUMENT { 1.0 - x * x / 3.0 } else { libm::atan(x) / x };
                steepness / k1 * quotient
            }
            DistortionModel::Division => 2.0 / (1.0 + (1.0 - 4.0 * k1 * square).sqrt()),
        }
    }

    /// The tangential and the thin prism part.
    fn lateral(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let ([p1, p2], [s1, s2, s3, s4]) = (self.tangential, self.thin_prism);
        let square = u * u + v * v;
        [
            2.0 * p1 * u * v + p2 * (square + 2.0 * u * u) + square * (s1 + s2 * square),
            p1 * (square + 2.0 * v * v) + 2.0 * p2 * u * v + square * (s3 + s4 * square),
        ]
    }

    /// The distortion as a Vulkan structure, to be chained to that of a camera.
    pub fn to_vulkan(&self) -> GaussianCameraDistortionGAURAST<'static> {
        GaussianCameraDistortionGAURAST::default()
            .model(self.model.to_vulkan())
            .radial(self.radial.map(|k| k as f32))
            .tangential(self.tangential.map(|p| p as f32))
            .thin_prism(self.thin_prism.map(|s| s as f32))
    }
}

impl Display for Distortion {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let parts = self.coefficients().filter(|(_, coefficient)| *coefficient != 0.0);
        let parts: Vec<String> = parts.map(|(name, coefficient)| format!("{name} = {coefficient}")).collect();
        formatter.write_str(&parts.join(", "))
    }
}

/// The fold of r n(r^2) / d(r^2), where both polynomials are 1 at 0.
fn fold_of_quotient(numerator: &[f64], denominator: &[f64]) -> f64 {
    // The derivative by r, times d^2, in r^2: n d + 2 r^2 (n' d - n d').
    let mut growth = vec![0.0; numerator.len() + denominator.len() - 1];
    for (i, n) in numerator.iter().enumerate() {
        for (j, d) in denominator.iter().enumerate() {
            growth[i + j] += n * d * (1.0 + 2.0 * (i as f64 - j as f64));
        }
    }
    let first = |polynomial: &[f64]| sign_changes(polynomial).first().copied().unwrap_or(f64::INFINITY);
    first(&growth).min(first(denominator)).sqrt()
}

/// The value of a polynomial, of coefficients from the constant one on.
fn value(polynomial: &[f64], x: f64) -> f64 {
    polynomial.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

/// The numbers above 0 from which on a polynomial is positive or no longer is, ascending.
fn sign_changes(polynomial: &[f64]) -> Vec<f64> {
    if polynomial.len() < 2 {
        return Vec::new();
    }
    let derivative: Vec<f64> =
        polynomial.iter().enumerate().skip(1).map(|(power, coefficient)| coefficient * power as f64).collect();
    // Between the places where the derivative changes its sign, the polynomial only rises or only falls.
    let mut changes = Vec::new();
    let mut low = 0.0;
    for high in sign_changes(&derivative).into_iter().chain([GREATEST_SQUARE]) {
        let is_positive = value(polynomial, low) > 0.0;
        if (value(polynomial, high) > 0.0) != is_positive {
            changes.push(bisected(low, high, |x| (value(polynomial, x) > 0.0) == is_positive));
        }
        low = high;
    }
    changes
}

/// The number up to which `holds` is true, which it is at `low` and not at `high`.
fn bisected(mut low: f64, mut high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    loop {
        let middle = low + (high - low) / 2.0;
        if middle <= low || middle >= high {
            return high;
        }
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn radial(model: DistortionModel, coefficients: &[f64]) -> Distortion {
        let mut radial = [0.0; 6];
        radial[..coefficients.len()].copy_from_slice(coefficients);
        Distortion { model, radial, ..Distortion::default() }
    }

    #[test]
    fn folds_are_where_they_are_by_hand() {
        let of = |model, coefficients: &[f64]| radial(model, coefficients).fold();
        // r - r^3 / 3 turns at 1, r - r^7 / 7 too.
        assert!((of(DistortionModel::Polynomial, &[-1.0 / 3.0]) - 1.0).abs() < 1e-12);
        assert!((of(DistortionModel::Rational, &[0.0, 0.0, -1.0 / 7.0]) - 1.0).abs() < 1e-12);
        assert_eq!(of(DistortionModel::PolynomialFirst, &[0.1, 0.0, 0.2]), f64::INFINITY);
        // r / (1 + r^2) turns at 1; r / (1 - r^2 / 4) has a pole at 2.
        assert!((of(DistortionModel::Rational, &[0.0, 0.0, 0.0, 1.0]) - 1.0).abs() < 1e-12);
        assert!((of(DistortionModel::Rational, &[0.0, 0.0, 0.0, -0.25]) - 2.0).abs() < 1e-12);
        // It falls from 1 on, although it rises again: r (1 - r^2 + 9 r^4 / 20 ...) has two turns.
        let twice = radial(DistortionModel::Polynomial, &[-1.0, 0.4]);
        let slope = |r: f64| 1.0 - 3.0 * r * r + 2.0 * r * r * r * r;
        assert!(slope(twice.fold()).abs() < 1e-12 && twice.fold() < 0.8);
        assert_eq!(of(DistortionModel::Division, &[0.25]), 1.0);
        assert_eq!(of(DistortionModel::Division, &[-0.25]), f64::INFINITY);
        assert_eq!(of(DistortionModel::FieldOfView, &[0.9]), f64::INFINITY);
        let folded = radial(DistortionModel::Polynomial, &[-1.0 / 3.0]);
        assert!(folded.distort([0.6, 0.79]).is_some() && folded.distort([0.6, 0.81]).is_none());
    }

    #[test]
    fn small_radii_of_a_field_of_view_are_its_limit() {
        let lens = radial(DistortionModel::FieldOfView, &[1.2]);
        let at = |r: f64| lens.distort([r, 0.0]).expect("no fold")[0] / r;
        assert!((at(0.5e-4) - at(1e-3)).abs() < 1e-5);
        assert!((lens.distort([0.5, 0.0]).expect("no fold")[0] - 0.5).abs() < 1e-15);
    }

    #[test]
    fn models_have_coefficients_of_their_own() {
        let two = Distortion { tangential: [0.1, 0.0], ..radial(DistortionModel::Division, &[0.1]) };
        assert!(!two.is_valid());
        assert!(Distortion { model: DistortionModel::Rational, ..two }.is_valid());
        assert!(!radial(DistortionModel::FieldOfView, &[3.2]).is_valid());
        assert!(!radial(DistortionModel::Rational, &[1e39]).is_valid());
        assert!(radial(DistortionModel::FieldOfView, &[0.9]).is_valid());
    }

    #[test]
    fn a_lens_is_displayed_by_its_coefficients() {
        let lens = Distortion { tangential: [0.0, 0.25], ..radial(DistortionModel::Rational, &[-0.5]) };
        assert_eq!(lens.to_string(), "k1 = -0.5, p2 = 0.25");
        assert_eq!(radial(DistortionModel::FieldOfView, &[0.5]).to_string(), "omega = 0.5");
        let vulkan = lens.to_vulkan();
        assert_eq!((vulkan.radial[0], vulkan.tangential), (-0.5, [0.0, 0.25]));
    }
}
