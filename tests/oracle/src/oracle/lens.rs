//! Lens distortion: the map from an ideal place in the picture, for focal lengths of 1 and relative to the principal point,
//! to the distorted one.
//!
//! The formulas are written once, for dual numbers, which carry the derivative along.
//!
//! # The fold
//!
//! A Gaussian is drawn if the radius of its mean's ideal place is less than that of the fold, the first place where a
//! polynomial is not positive. It is found by steps that cannot pass it: from `s` on the polynomial stays positive for as
//! long as its Taylor series does with the worst signs. Near a root the steps shrink. A polynomial that only touches 0
//! there may be taken for one that crosses it, or not; a mean beyond such a place is undecidable, as is one that is very
//! near a fold.

use gaurast::vk::{GaussianCameraDistortionGAURAST, GaussianDistortionModelGAURAST as Model};
use std::ops::{Add, Div, Mul};

/// A lens, as `VkGaussianCameraDistortionGAURAST` holds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleLens {
    model: Model,
    /// k1 to k6.
    radial: [f32; 6],
    /// p1 and p2.
    tangential: [f32; 2],
    /// s1 to s4.
    thin_prism: [f32; 4],
    fold: Fold,
}

/// The distance from the principal point, relative to the fold's, within which nothing is required.
const FOLD_ERROR: f64 = 1e-9;

/// The square of the greatest radius at which there may be a fold.
const GREATEST_SQUARE: f64 = 1e24;

/// The radii of a lens's fold: of the least at which it may be, and of the least at which it certainly is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fold {
    /// The least radius at which it may be.
    pub least: f64,
    /// The least radius at which it certainly is.
    pub greatest: f64,
}

/// A number with its derivatives by u and v.
#[derive(Clone, Copy, Debug)]
struct Dual {
    value: f64,
    by: [f64; 2],
}

impl Dual {
    fn constant(value: f32) -> Self {
        Self { value: value.into(), by: [0.0; 2] }
    }

    /// A function of it, by the function's value and derivative.
    fn map(self, value: f64, derivative: f64) -> Self {
        Self { value, by: self.by.map(|by| derivative * by) }
    }

    fn scaled(self, factor: f64) -> Self {
        self.map(factor * self.value, factor)
    }

    fn times(self, other: Self) -> Self {
        let by = [0, 1].map(|i| self.by[i] * other.value + self.value * other.by[i]);
        Self { value: self.value * other.value, by }
    }
}

impl Add for Dual {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, by: [0, 1].map(|i| self.by[i] + other.by[i]) }
    }
}

impl Mul for Dual {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        self.times(other)
    }
}

impl Div for Dual {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let square = other.value * other.value;
        self * other.map(1.0 / other.value, -1.0 / square)
    }
}

impl OracleLens {
    /// The lens of a camera's structure; `None` if its coefficients are all 0.
    pub fn new(distortion: &GaussianCameraDistortionGAURAST<'_>) -> Option<Self> {
        let &GaussianCameraDistortionGAURAST { model, radial, tangential, thin_prism, .. } = distortion;
        let mut all = radial.iter().chain(&tangential).chain(&thin_prism);
        let distorts = all.any(|coefficient| *coefficient != 0.0);
        distorts.then(|| Self { model, radial, tangential, thin_prism, fold: fold(model, radial.map(f64::from)) })
    }

    /// The structure that a camera chains.
    pub fn to_vulkan(&self) -> GaussianCameraDistortionGAURAST<'static> {
        GaussianCameraDistortionGAURAST::default()
            .model(self.model)
            .radial(self.radial)
            .tangential(self.tangential)
            .thin_prism(self.thin_prism)
    }

    /// The distorted place of an ideal one, and its derivatives: the rows are those of u' and v'.
    pub fn distort(&self, [u, v]: [f64; 2]) -> ([f64; 2], [[f64; 2]; 2]) {
        let ideal = [Dual { value: u, by: [1.0, 0.0] }, Dual { value: v, by: [0.0, 1.0] }];
        let factor = self.factor(square(ideal));
        let scaled = ideal.map(|part| part * factor);
        let from = if self.model == Model::POLYNOMIAL_FIRST { scaled } else { ideal };
        let beside = self.tangential_and_prism(from);
        let sums = [scaled[0] + beside[0], scaled[1] + beside[1]];
        (sums.map(|sum| sum.value), sums.map(|sum| sum.by))
    }

    fn tangential_and_prism(&self, [u, v]: [Dual; 2]) -> [Dual; 2] {
        let [p1, p2] = self.tangential.map(Dual::constant);
        let [s1, s2, s3, s4] = self.thin_prism.map(Dual::constant);
        let s = square([u, v]);
        [
            (p1 * u * v).scaled(2.0) + p2 * (s + (u * u).scaled(2.0)) + s1 * s + s2 * s * s,
            p1 * (s + (v * v).scaled(2.0)) + (p2 * u * v).scaled(2.0) + s3 * s + s4 * s * s,
        ]
    }

    /// The factor of the radial part.
    fn factor(&self, s: Dual) -> Dual {
        let k = self.radial.map(Dual::constant);
        let one = Dual::constant(1.0);
        let polynomial = |k: &[Dual]| one + k.iter().rev().fold(Dual::constant(0.0), |sum, &k| s * (k + sum));
        match self.model {
            Model::POLYNOMIAL | Model::POLYNOMIAL_FIRST => polynomial(&k),
            Model::FIELD_OF_VIEW => {
                let steepness = 2.0 * (0.5 * k[0].value).tan();
                // The quotient of atan(x) and x, of the square of x.
                let square = steepness * steepness * s.value;
                let x = square.sqrt();
                // Its series near 0, where the derivative's terms cancel.
                let (quotient, derivative) = if square < 1e-4 {
                    let powers = [0, 1, 2, 3].map(|n: i32| (-square).powi(n));
                    (
                        powers[0] + powers[1] / 3.0 + powers[2] / 5.0 + powers[3] / 7.0,
                        -(powers[0] / 3.0 + 2.0 * powers[1] / 5.0 + 3.0 * powers[2] / 7.0),
                    )
                } else {
                    (x.atan() / x, (1.0 / (1.0 + square) - x.atan() / x) / (2.0 * square))
                };
                let scale = steepness / k[0].value;
                s.map(scale * quotient, scale * derivative * steepness * steepness)
            }
            Model::DIVISION => {
                let under = one + (k[0] * s).scaled(-4.0);
                let root = under.value.sqrt();
                Dual::constant(2.0) / (one + under.map(root, 0.5 / root))
            }
            _ => polynomial(&k[..3]) / polynomial(&k[3..]),
        }
    }

    /// The radial part of a radius.
    fn radius(&self, radius: f64) -> f64 {
        radius * self.factor(Dual { value: radius * radius, by: [0.0; 2] }).value
    }

    /// The fold.
    pub fn fold(&self) -> Fold {
        self.fold
    }

    /// The factor by which the bounds of a pinhole's slopes widen, whose corner that is the farthest from the principal
    /// point has a distance of `corner`.
    pub fn widening(&self, corner: f64) -> f64 {
        let fold = self.fold().least;
        let reaches = |radius: f64| self.radius(radius) >= corner;
        // Doubled until the radial part is as great, or the lens folds.
        let mut high = corner.min(fold);
        while high < fold && !reaches(high) {
            if high > 1e12 {
                return f64::INFINITY;
            }
            high = (2.0 * high).min(fold);
        }
        let mut low = 0.0;
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            *(if reaches(middle) { &mut high } else { &mut low }) = middle;
        }
        (high / corner).max(1.0)
    }
}

fn fold(model: Model, k: [f64; 6]) -> Fold {
    let squares = match model {
        Model::FIELD_OF_VIEW => [f64::INFINITY; 2],
        Model::DIVISION if k[0] <= 0.0 => [f64::INFINITY; 2],
        Model::DIVISION => [0.25 / k[0]; 2],
        Model::POLYNOMIAL | Model::POLYNOMIAL_FIRST => {
            // The derivative of r + k1 r^3 + k2 r^5 + ...
            let derivative = [1.0, 3.0 * k[0], 5.0 * k[1], 7.0 * k[2], 9.0 * k[3], 11.0 * k[4], 13.0 * k[5]];
            first_not_positive(&derivative)
        }
        _ => {
            let (above, below) = ([1.0, k[0], k[1], k[2]], [1.0, k[3], k[4], k[5]]);
            // The numerator of the derivative of r a(r^2) / b(r^2): a b + 2 s (a' b - a b').
            let mut derivative = [0.0; 7];
            for (i, a) in above.into_iter().enumerate() {
                for (j, b) in below.into_iter().enumerate() {
                    derivative[i + j] += (1.0 + 2.0 * i as f64 - 2.0 * j as f64) * a * b;
                }
            }
            let (grows, has_pole) = (first_not_positive(&derivative), first_not_positive(&below));
            [0, 1].map(|end| grows[end].min(has_pole[end]))
        }
    };
    let [least, greatest] = squares.map(f64::sqrt);
    Fold { least: least * (1.0 - FOLD_ERROR), greatest: greatest * (1.0 + FOLD_ERROR) }
}

fn square([u, v]: [Dual; 2]) -> Dual {
    u * u + v * v
}

/// The least positive number at which a polynomial (coefficients from the constant one on, which is positive) may be not
/// positive, and the least at which it certainly is not; infinite if there is none.
fn first_not_positive(polynomial: &[f64]) -> [f64; 2] {
    let mut at = 0.0;
    while at < GREATEST_SQUARE {
        let taylor = shifted(polynomial, at);
        let stays_positive = |step: f64| {
            let rest = taylor[1..].iter().rev().fold(0.0, |sum, coefficient| step * (sum + coefficient.abs()));
            taylor[0] > rest
        };
        // The longest step, to within a half.
        let mut step = 1.0f64.max(at);
        while !stays_positive(step) {
            step *= 0.5;
            if step <= 1e-12 * at.max(1e-9) {
                let beyond = at * (1.0 + FOLD_ERROR);
                let crosses = shifted(polynomial, beyond)[0] < 0.0;
                return [at, if crosses { beyond } else { f64::INFINITY }];
            }
        }
        at += step;
    }
    [f64::INFINITY; 2]
}

/// The coefficients of a polynomial of x as one of x - `at`.
fn shifted(polynomial: &[f64], at: f64) -> Vec<f64> {
    let mut coefficients = polynomial.to_vec();
    for start in 0..coefficients.len() {
        for index in (start..coefficients.len() - 1).rev() {
            coefficients[index] += at * coefficients[index + 1];
        }
    }
    coefficients
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lens(model: Model, radial: [f32; 6]) -> OracleLens {
        OracleLens::new(&GaussianCameraDistortionGAURAST::default().model(model).radial(radial)).unwrap()
    }

    #[test]
    fn derivatives_are_differences() {
        let models = [
            (Model::RATIONAL, [0.2, -0.05, 0.01, 0.03, -0.004, 0.0002]),
            (Model::POLYNOMIAL, [0.2, -0.05, 0.01, 0.03, -0.004, 0.0002]),
            (Model::POLYNOMIAL_FIRST, [0.2, -0.05, 0.01, 0.03, -0.004, 0.0002]),
            (Model::FIELD_OF_VIEW, [0.9, 0.0, 0.0, 0.0, 0.0, 0.0]),
            (Model::DIVISION, [-0.3, 0.0, 0.0, 0.0, 0.0, 0.0]),
        ];
        let step = 1e-6;
        for (model, radial) in models {
            let mut lens = lens(model, radial);
            if model.as_raw() < 3 {
                (lens.tangential, lens.thin_prism) = ([0.002, -0.003], [0.004, -0.001, -0.002, 0.0005]);
            }
            for [u, v] in [[0.3, -0.4], [0.001, 0.002], [-0.6, 0.1]] {
                let (_, by) = lens.distort([u, v]);
                for (axis, [along_u, along_v]) in by.into_iter().enumerate() {
                    let by_u =
                        (lens.distort([u + step, v]).0[axis] - lens.distort([u - step, v]).0[axis]) / (2.0 * step);
                    let by_v =
                        (lens.distort([u, v + step]).0[axis] - lens.distort([u, v - step]).0[axis]) / (2.0 * step);
                    assert!((along_u - by_u).abs() < 1e-8 && (along_v - by_v).abs() < 1e-8, "{model:?} {u} {v}");
                }
            }
        }
    }

    #[test]
    fn folds_are_where_they_are_by_hand() {
        let near = |fold: Fold, expected: f64| {
            fold.least <= expected && expected <= fold.greatest && fold.greatest - fold.least < 1e-7
        };
        // 1 - s = 0.
        let fold = lens(Model::POLYNOMIAL, [-1.0 / 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]).fold();
        assert!((fold.least - 1.0).abs() < 1e-7 && fold.greatest - fold.least < 1e-7, "{fold:?}");
        // A pole at s = 4.
        let fold = lens(Model::RATIONAL, [0.0, 0.0, 0.0, -0.25, 0.0, 0.0]).fold();
        assert!(near(fold, 2.0), "{fold:?}");
        assert!(near(lens(Model::DIVISION, [0.25, 0.0, 0.0, 0.0, 0.0, 0.0]).fold(), 1.0));
        let none = lens(Model::POLYNOMIAL, [0.1, 0.02, 0.0, 0.0, 0.0, 0.0]).fold();
        assert_eq!(none.least, f64::INFINITY);
    }

    #[test]
    fn a_polynomial_that_touches_zero_leaves_what_is_beyond_undecidable() {
        // (s - 1)^2 (1 + s).
        let [least, greatest] = first_not_positive(&[1.0, -1.0, -1.0, 1.0]);
        assert!((least - 1.0).abs() < 1e-5, "{least}");
        assert_eq!(greatest, f64::INFINITY);
    }

    #[test]
    fn slopes_widen_where_a_lens_sees_more() {
        let barrel = lens(Model::FIELD_OF_VIEW, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let wide = barrel.widening(1.2);
        assert!((barrel.distort([1.2 * wide, 0.0]).0[0] - 1.2).abs() < 1e-12);
        assert_eq!(barrel.widening(2.0), f64::INFINITY);
        assert_eq!(lens(Model::POLYNOMIAL, [0.3, 0.0, 0.0, 0.0, 0.0, 0.0]).widening(1.2), 1.0);
    }
}
