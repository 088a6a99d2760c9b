//! Lenses that distort: where they fold, how far they widen the bounds of slopes, and what kernels read of them.

use gaurast::vk::{GaussianCameraDistortionGAURAST as Distortion, GaussianDistortionModelGAURAST as Model};

use crate::cameras::Camera;
use crate::pair::{Pair, pair};

/// The number of coefficients of the polynomials here, the constant one included.
const COEFFICIENTS: usize = 7;

/// A polynomial, by its coefficients from the constant one on.
type Polynomial = [f64; COEFFICIENTS];

/// The square of the greatest distance from the principal point at which a fold is searched for.
const GREATEST_SQUARE: f64 = 1e24;

/// A lens as kernels read it: `shaders/set.glsl`.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Lens {
    /// The square of the radius at which it folds, or the greatest number.
    fold: Pair,
    /// 2 tan(omega / 2), and its quotient by omega, of a field of view.
    steepness: Pair,
    scale: Pair,
    /// The factor of a pinhole's bounds of slopes, or the greatest number.
    widening: Pair,
    /// 0 without distortion; otherwise one more than Vulkan's number of the model.
    model: u32,
    radial: [f32; 6],
    tangential: [f32; 2],
    thin_prism: [f32; 4],
    unused: u32,
}

/// A number for kernels, which have no infinite ones here.
fn bounded(value: f64) -> Pair {
    if value < f64::from(f32::MAX) { pair(value) } else { [f32::MAX, 0.0] }
}

/// Reports whether a lens distorts.
pub(crate) fn distorts(lens: &Distortion<'_>) -> bool {
    let coefficients = lens.radial.iter().chain(&lens.tangential).chain(&lens.thin_prism);
    coefficients.into_iter().any(|coefficient| *coefficient != 0.0)
}

impl Lens {
    /// The lens of a camera whose viewport has a size in pixels.
    pub(crate) fn new(distortion: &Distortion<'_>, camera: &Camera, size: [f32; 2]) -> Self {
        let radial = Radial::new(distortion);
        // The distance of the farthest corner of the bounds of slopes.
        let farthest = [0, 1].map(|axis| {
            let [focal, center] = [camera.focal_length[axis], camera.principal_point[axis]].map(f64::from);
            let (size, beyond) = (f64::from(size[axis]), 0.15 * f64::from(size[axis]) / focal);
            (center / focal + beyond).abs().max(((size - center) / focal + beyond).abs())
        });
        let steepness = 2.0 * (0.5 * f64::from(distortion.radial[0])).tan();
        Self {
            fold: bounded(radial.fold),
            steepness: pair(steepness),
            scale: pair(steepness / f64::from(distortion.radial[0])),
            widening: bounded(radial.widening(farthest[0].hypot(farthest[1]))),
            model: distortion.model.as_raw().cast_unsigned() + 1,
            radial: distortion.radial,
            tangential: distortion.tangential,
            thin_prism: distortion.thin_prism,
            unused: 0,
        }
    }
}

/// The radial part of a lens.
struct Radial {
    model: Model,
    first: f64,
    numerator: Polynomial,
    denominator: Polynomial,
    /// The square of the radius at which the lens folds; infinite if it does not.
    fold: f64,
}

impl Radial {
    fn new(distortion: &Distortion<'_>) -> Self {
        let [a, b, c, d, e, f] = distortion.radial.map(f64::from);
        let (numerator, denominator) = match distortion.model {
            Model::RATIONAL => ([1.0, a, b, c, 0.0, 0.0, 0.0], [1.0, d, e, f, 0.0, 0.0, 0.0]),
            _ => ([1.0, a, b, c, d, e, f], [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        };
        let fold = match distortion.model {
            Model::FIELD_OF_VIEW => f64::INFINITY,
            Model::DIVISION if a > 0.0 => 0.25 / a,
            Model::DIVISION => f64::INFINITY,
            _ => first_not_positive(&growth(&numerator, &denominator)).min(first_not_positive(&denominator)),
        };
        Self { model: distortion.model, first: a, numerator, denominator, fold }
    }

    /// The distorted radius.
    fn radius(&self, radius: f64) -> f64 {
        let square = radius * radius;
        match self.model {
            Model::FIELD_OF_VIEW => (2.0 * radius * (0.5 * self.first).tan()).atan() / self.first,
            Model::DIVISION => 2.0 * radius / (1.0 + (1.0 - 4.0 * self.first * square).sqrt()),
            _ => radius * value(&self.numerator, square) / value(&self.denominator, square),
        }
    }

    /// The factor by which slopes up to a greatest one widen: at least 1, and infinite if nothing bounds them.
    fn widening(&self, greatest: f64) -> f64 {
        let reaches = |radius: f64| {
            let distorted = self.radius(radius);
            distorted >= greatest || distorted.is_nan()
        };
        let end = self.fold.min(GREATEST_SQUARE).sqrt();
        if self.fold == f64::INFINITY && !reaches(end) {
            return f64::INFINITY;
        }
        (first(0.0, end, reaches) / greatest).max(1.0)
    }
}

fn value(polynomial: &Polynomial, x: f64) -> f64 {
    polynomial.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

/// The polynomial whose sign is that of the derivative of r n(r^2) / d(r^2) by r, in r^2, where d is positive:
/// n d + 2 s (n' d - n d').
fn growth(n: &Polynomial, d: &Polynomial) -> Polynomial {
    let mut sum = [0.0; COEFFICIENTS];
    for (i, a) in n.iter().enumerate() {
        for (j, b) in d.iter().enumerate().take(COEFFICIENTS - i) {
            sum[i + j] += a * b * (1.0 + 2.0 * (i as f64 - j as f64));
        }
    }
    sum
}

/// The least positive number at which a polynomial, which is positive at 0, is not positive; infinite if there is none.
fn first_not_positive(polynomial: &Polynomial) -> f64 {
    let mut low = 0.0;
    // It only rises or only falls from one turning point to the next.
    for high in turning_points(polynomial).into_iter().chain([GREATEST_SQUARE]) {
        if value(polynomial, high) <= 0.0 {
            return first(low, high, |x| value(polynomial, x) <= 0.0);
        }
        low = high;
    }
    f64::INFINITY
}

/// The positive numbers at which the derivative of a polynomial changes its sign, ascending.
fn turning_points(polynomial: &Polynomial) -> Vec<f64> {
    let mut derivatives = [*polynomial; COEFFICIENTS];
    for order in 1..COEFFICIENTS {
        let before = derivatives[order - 1];
        derivatives[order] = std::array::from_fn(|power| {
            before.get(power + 1).map_or(0.0, |coefficient| coefficient * (power + 1) as f64)
        });
    }
    // The roots of a derivative separate those of the derivative before it.
    let mut roots: Vec<f64> = Vec::new();
    for derivative in derivatives[1..].iter().rev() {
        let is_positive = |x: f64| value(derivative, x) > 0.0;
        let mut found = Vec::new();
        let mut low = 0.0;
        for high in roots.into_iter().chain([GREATEST_SQUARE]) {
            let sign = is_positive(low);
            if is_positive(high) != sign {
                found.push(first(low, high, |x| is_positive(x) != sign));
            }
            low = high;
        }
        roots = found;
    }
    roots
}

/// The least number from one to another of which `holds` is true, if it holds from one number on. Neither is negative, so that they
/// ascend as their bits do.
fn first(low: f64, high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (low.to_bits(), high.to_bits());
    while high > low + 1 {
        let middle = low + (high - low) / 2;
        *(if holds(f64::from_bits(middle)) { &mut high } else { &mut low }) = middle;
    }
    f64::from_bits(high)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn radial(model: Model, radial: [f32; 6]) -> Radial {
        Radial::new(&Distortion::default().model(model).radial(radial))
    }

    #[test]
    fn folds_are_where_they_are_by_hand() {
        let of = |model, k: [f32; 6]| radial(model, k).fold.sqrt();
        // 1 - s = 0.
        assert!((of(Model::POLYNOMIAL, [-1.0 / 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]) - 1.0).abs() < 1e-7);
        assert_eq!(of(Model::POLYNOMIAL, [0.1, 0.0, 0.0, 0.0, 0.0, 0.0]), f64::INFINITY);
        // A pole at s = 4.
        assert!((of(Model::RATIONAL, [0.0, 0.0, 0.0, -0.25, 0.0, 0.0]) - 2.0).abs() < 1e-12);
        assert_eq!(of(Model::DIVISION, [0.25, 0.0, 0.0, 0.0, 0.0, 0.0]), 1.0);
        assert_eq!(of(Model::DIVISION, [-0.25, 0.0, 0.0, 0.0, 0.0, 0.0]), f64::INFINITY);
        assert_eq!(of(Model::FIELD_OF_VIEW, [0.9, 0.0, 0.0, 0.0, 0.0, 0.0]), f64::INFINITY);
    }

    #[test]
    fn slopes_widen_where_a_lens_sees_more() {
        let barrel = radial(Model::FIELD_OF_VIEW, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let wide = barrel.widening(1.2);
        assert!((barrel.radius(1.2 * wide) - 1.2).abs() < 1e-12, "{wide}");
        assert_eq!(barrel.widening(2.0), f64::INFINITY);
        assert_eq!(radial(Model::POLYNOMIAL, [0.3, 0.0, 0.0, 0.0, 0.0, 0.0]).widening(1.2), 1.0);
    }

    #[test]
    fn a_lens_without_coefficients_is_none() {
        assert!(!distorts(&Distortion::default()));
        assert!(distorts(&Distortion::default().thin_prism([0.0, 0.0, 0.0, 1e-9])));
    }
}
