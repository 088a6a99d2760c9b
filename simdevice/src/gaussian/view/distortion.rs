//! Lens distortion: the map from a place in the picture that an ideal lens gives to that of a real one, its derivative,
//! and the fold beyond which a lens shows nothing. Places are for focal lengths of 1, relative to the principal point.

use crate::state::gaussian::{Distortion, DistortionModel};

/// The greatest distance from the principal point at which a fold is searched for. A picture shows nothing there.
const GREATEST_RADIUS: f64 = 1e12;

/// The number of coefficients of the polynomials here, the constant one included.
const COEFFICIENTS: usize = 7;

/// A polynomial, by its coefficients from the constant one on.
type Polynomial = [f64; COEFFICIENTS];

/// A 2x2 matrix, by rows.
type Matrix = [[f64; 2]; 2];

/// A lens that distorts, in binary64.
#[derive(Clone, Debug)]
pub(crate) struct Lens {
    model: DistortionModel,
    /// The polynomial that multiplies places, in the square of the radius, and the one that divides them.
    numerator: Polynomial,
    denominator: Polynomial,
    tangential: [f64; 2],
    thin_prism: [f64; 4],
    /// The square of the radius at which the lens folds; infinite if it does not.
    fold: f64,
}

/// A place after distortion, with the derivative there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Distorted {
    pub(crate) place: [f64; 2],
    /// The derivative of the place by the place before.
    pub(crate) derivative: Matrix,
}

/// The value of a function and its derivative.
#[derive(Clone, Copy, Debug)]
struct Slope {
    value: f64,
    derivative: f64,
}

impl Lens {
    pub(crate) fn new(distortion: &Distortion) -> Self {
        let k = distortion.radial.map(f64::from);
        let (numerator, denominator) = match distortion.model {
            DistortionModel::Rational => {
                ([1.0, k[0], k[1], k[2], 0.0, 0.0, 0.0], [1.0, k[3], k[4], k[5], 0.0, 0.0, 0.0])
            }
            DistortionModel::Polynomial | DistortionModel::PolynomialFirst => {
                ([1.0, k[0], k[1], k[2], k[3], k[4], k[5]], [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
            }
            DistortionModel::FieldOfView | DistortionModel::Division => {
                ([k[0], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 7])
            }
        };
        let fold = match distortion.model {
            DistortionModel::FieldOfView => f64::INFINITY,
            DistortionModel::Division if k[0] > 0.0 => 0.25 / k[0],
            DistortionModel::Division => f64::INFINITY,
            _ => first_not_positive(&growth(&numerator, &denominator)).min(first_not_positive(&denominator)),
        };
        Self {
            model: distortion.model,
            numerator,
            denominator,
            tangential: distortion.tangential.map(f64::from),
            thin_prism: distortion.thin_prism.map(f64::from),
            fold,
        }
    }

    /// The radius at which the lens folds; infinite if it does not.
    pub(crate) fn fold(&self) -> f64 {
        self.fold.sqrt()
    }

    /// True if a place of the ideal picture lies before the fold.
    pub(crate) fn shows(&self, [u, v]: [f64; 2]) -> bool {
        u * u + v * v < self.fold
    }

    /// Distorts a place. It is NaN at and beyond the fold.
    pub(crate) fn distort(&self, place: [f64; 2]) -> Distorted {
        if !self.shows(place) {
            return Distorted { place: [f64::NAN; 2], derivative: [[f64::NAN; 2]; 2] };
        }
        let radial = self.radial(place);
        let is_first = self.model == DistortionModel::PolynomialFirst;
        let lateral = self.lateral(if is_first { radial.place } else { place });
        let own = if is_first { product(lateral.derivative, radial.derivative) } else { lateral.derivative };
        Distorted {
            place: [0, 1].map(|axis| radial.place[axis] + lateral.place[axis]),
            derivative: [0, 1].map(|row| [0, 1].map(|column| radial.derivative[row][column] + own[row][column])),
        }
    }

    /// The factor by which slopes up to `greatest` widen, so that they bound what this lens shows where an ideal one
    /// shows places up to there: at least 1, and infinite if nothing bounds it.
    pub(crate) fn widening(&self, greatest: f64) -> f64 {
        let reaches = |radius: f64| {
            let distorted = radius * self.factor(radius * radius).value;
            distorted >= greatest || distorted.is_nan()
        };
        let end = self.fold().min(GREATEST_RADIUS);
        if self.fold == f64::INFINITY && !reaches(end) {
            return f64::INFINITY;
        }
        (first(0.0, end, reaches) / greatest).max(1.0)
    }

    /// The radial part at a place.
    fn radial(&self, [u, v]: [f64; 2]) -> Distorted {
        let Slope { value, derivative } = self.factor(u * u + v * v);
        let mixed = 2.0 * u * v * derivative;
        Distorted {
            place: [u * value, v * value],
            derivative: [[value + 2.0 * u * u * derivative, mixed], [mixed, value + 2.0 * v * v * derivative]],
        }
    }

    /// The tangential part and the thin prism's at a place, which are added to the radial one.
    fn lateral(&self, [u, v]: [f64; 2]) -> Distorted {
        let ([p1, p2], [s1, s2, s3, s4]) = (self.tangential, self.thin_prism);
        let square = u * u + v * v;
        let (x_slope, y_slope) = (s1 + 2.0 * s2 * square, s3 + 2.0 * s4 * square);
        let mixed = 2.0 * (p1 * u + p2 * v);
        Distorted {
            place: [
                2.0 * p1 * u * v + p2 * (square + 2.0 * u * u) + square * (s1 + s2 * square),
                p1 * (square + 2.0 * v * v) + 2.0 * p2 * u * v + square * (s3 + s4 * square),
            ],
            derivative: [
                [2.0 * p1 * v + 6.0 * p2 * u + 2.0 * u * x_slope, mixed + 2.0 * v * x_slope],
                [mixed + 2.0 * u * y_slope, 6.0 * p1 * v + 2.0 * p2 * u + 2.0 * v * y_slope],
            ],
        }
    }

    /// The factor of the radial part by the square of the radius.
    fn factor(&self, square: f64) -> Slope {
        let coefficient = self.numerator[0];
        match self.model {
            DistortionModel::Polynomial | DistortionModel::PolynomialFirst => evaluate(&self.numerator, square),
            DistortionModel::Rational => {
                let (n, d) = (evaluate(&self.numerator, square), evaluate(&self.denominator, square));
                let derivative = (n.derivative * d.value - n.value * d.derivative) / (d.value * d.value);
                Slope { value: n.value / d.value, derivative }
            }
            DistortionModel::FieldOfView => field_of_view(coefficient, square),
            DistortionModel::Division => {
                let root = (1.0 - 4.0 * coefficient * square).sqrt();
                let sum = 1.0 + root;
                Slope { value: 2.0 / sum, derivative: 4.0 * coefficient / (root * sum * sum) }
            }
        }
    }
}

/// The least argument of the arcus tangent that is taken as it is. Below, its series has all digits.
const LEAST_ARGUMENT: f64 = 1e-4;

/// The factor atan(2 r tan(omega / 2)) / (r omega) by the square of the radius r.
fn field_of_view(omega: f64, square: f64) -> Slope {
    let steepness = 2.0 * libm::tan(0.5 * omega);
    let x = steepness * square.sqrt();
    // The quotient q of atan(x) and x, and its derivative by x, divided by x.
    let (quotient, slope) = if x < LEAST_ARGUMENT {
        (1.0 - x * x / 3.0, -2.0 / 3.0)
    } else {
        let quotient = libm::atan(x) / x;
        (quotient, (1.0 / (1.0 + x * x) - quotient) / (x * x))
    };
    let scale = steepness / omega;
    Slope { value: scale * quotient, derivative: scale * 0.5 * steepness * steepness * slope }
}

fn product(a: Matrix, b: Matrix) -> Matrix {
    [0, 1].map(|row| [0, 1].map(|column| a[row][0] * b[0][column] + a[row][1] * b[1][column]))
}

/// A polynomial and its derivative at `x`, by Horner's scheme.
fn evaluate(polynomial: &Polynomial, x: f64) -> Slope {
    let start = Slope { value: 0.0, derivative: 0.0 };
    polynomial.iter().rev().fold(start, |sum, coefficient| Slope {
        derivative: sum.derivative * x + sum.value,
        value: sum.value * x + coefficient,
    })
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

/// The least positive number at which a polynomial, which is positive at 0, is not positive; infinite if there is none up to
/// the square of the greatest radius.
fn first_not_positive(polynomial: &Polynomial) -> f64 {
    let end = GREATEST_RADIUS * GREATEST_RADIUS;
    let mut turns = turning_points(polynomial, end);
    turns.push(end);
    let mut low = 0.0;
    for high in turns {
        // The polynomial only rises or only falls from turn to turn.
        if evaluate(polynomial, high).value <= 0.0 {
            return first(low, high, |x| evaluate(polynomial, x).value <= 0.0);
        }
        low = high;
    }
    f64::INFINITY
}

/// The numbers in (0, `end`) at which the derivative of a polynomial changes its sign, ascending.
fn turning_points(polynomial: &Polynomial, end: f64) -> Vec<f64> {
    let mut derivatives = [*polynomial; COEFFICIENTS];
    for order in 1..COEFFICIENTS {
        derivatives[order] = differentiate(&derivatives[order - 1]);
    }
    // The roots of a derivative separate those of the derivative before it.
    let mut roots = Vec::new();
    for derivative in derivatives[1..].iter().rev() {
        let is_positive = |x: f64| evaluate(derivative, x).value > 0.0;
        let mut found = Vec::with_capacity(COEFFICIENTS);
        let mut low = 0.0;
        for high in roots.into_iter().chain([end]) {
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

fn differentiate(polynomial: &Polynomial) -> Polynomial {
    std::array::from_fn(|power| match polynomial.get(power + 1) {
        Some(coefficient) => coefficient * (power + 1) as f64,
        None => 0.0,
    })
}

/// The least number in (`low`, `high`] of which `holds` is true, if it holds from one number on.
fn first(mut low: f64, mut high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    while let Some(middle) = between(low, high) {
        if holds(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

/// The number in the middle of the numbers between two that are not negative; `None` if there is none between. Such
/// numbers ascend as their bits do.
fn between(low: f64, high: f64) -> Option<f64> {
    let (low, high) = (low.to_bits(), high.to_bits());
    (high > low + 1).then(|| f64::from_bits(low + (high - low) / 2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MODELS: [DistortionModel; 5] = [
        DistortionModel::Rational,
        DistortionModel::Polynomial,
        DistortionModel::PolynomialFirst,
        DistortionModel::FieldOfView,
        DistortionModel::Division,
    ];

    fn lens(model: DistortionModel, radial: [f32; 6]) -> Lens {
        Lens::new(&Distortion { model, radial, tangential: [0.0; 2], thin_prism: [0.0; 4] })
    }

    /// A lens of a model with all of its coefficients.
    fn strange_lens(model: DistortionModel) -> Lens {
        let is_plain = matches!(model, DistortionModel::FieldOfView | DistortionModel::Division);
        let distortion = Distortion {
            model,
            radial: [0.2, -0.05, 0.01, 0.03, -0.004, 0.0002],
            tangential: [0.002, -0.003],
            thin_prism: [0.004, -0.001, -0.002, 0.0005],
        };
        if is_plain { lens(model, [0.2, 0.0, 0.0, 0.0, 0.0, 0.0]) } else { Lens::new(&distortion) }
    }

    proptest! {
        #[gaurast_runner::test]
        fn the_derivative_is_that_of_the_place(u in -0.9..0.9f64, v in -0.5..0.5f64) {
            let step = 1e-6;
            for model in MODELS {
                let lens = strange_lens(model);
                let found = lens.distort([u, v]).derivative;
                let ends = |by: [f64; 2]| {
                    let (ahead, behind) = (lens.distort([u + by[0], v + by[1]]), lens.distort([u - by[0], v - by[1]]));
                    [0, 1].map(|axis| (ahead.place[axis] - behind.place[axis]) / (2.0 * step))
                };
                let (by_u, by_v) = (ends([step, 0.0]), ends([0.0, step]));
                for ([along_u, along_v], (by_u, by_v)) in found.into_iter().zip(by_u.into_iter().zip(by_v)) {
                    prop_assert!((along_u - by_u).abs() < 1e-8, "{model:?} {u} {v}: {found:?}");
                    prop_assert!((along_v - by_v).abs() < 1e-8, "{model:?} {u} {v}: {found:?}");
                }
            }
        }

        #[gaurast_runner::test]
        fn places_grow_up_to_the_fold_and_no_farther(k in prop::array::uniform6(-0.5..0.5f32)) {
            for model in [DistortionModel::Rational, DistortionModel::Polynomial] {
                let lens = lens(model, k);
                let end = lens.fold().min(3.0);
                let radius = |r: f64| r * lens.factor(r * r).value;
                let steps = (1..=200).map(|step| end * f64::from(step) / 200.0);
                let mut last = 0.0;
                for r in steps.filter(|r| *r < lens.fold()) {
                    prop_assert!(radius(r) > last, "{model:?} {k:?} at {r} of {end}");
                    last = radius(r);
                }
                if lens.fold() < 1e3 {
                    let denominator = evaluate(&lens.denominator, lens.fold).value;
                    let slope = evaluate(&growth(&lens.numerator, &lens.denominator), lens.fold).value;
                    prop_assert!(denominator.min(slope).abs() < 1e-6 * lens.fold.powi(6).max(1.0), "{model:?} {k:?}");
                }
            }
        }
    }

    #[gaurast_runner::test]
    fn folds_are_where_they_are_by_hand() {
        let of = |model, radial| lens(model, radial).fold();
        // 1 - 3 s / 3 = 0 at s = 1.
        let third = -1.0 / 3.0;
        assert!((of(DistortionModel::Polynomial, [third, 0.0, 0.0, 0.0, 0.0, 0.0]) - 1.0).abs() < 1e-7);
        assert_eq!(of(DistortionModel::Polynomial, [0.1, 0.0, 0.0, 0.0, 0.0, 0.0]), f64::INFINITY);
        // A pole at s = 4.
        assert!((of(DistortionModel::Rational, [0.0, 0.0, 0.0, -0.25, 0.0, 0.0]) - 2.0).abs() < 1e-12);
        assert_eq!(of(DistortionModel::Division, [0.25, 0.0, 0.0, 0.0, 0.0, 0.0]), 1.0);
        assert_eq!(of(DistortionModel::Division, [-0.25, 0.0, 0.0, 0.0, 0.0, 0.0]), f64::INFINITY);
        assert_eq!(of(DistortionModel::FieldOfView, [0.9, 0.0, 0.0, 0.0, 0.0, 0.0]), f64::INFINITY);
        let folded = lens(DistortionModel::Polynomial, [third, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert!(folded.shows([0.6, 0.79]) && !folded.shows([0.6, 0.81]));
        assert!(folded.distort([0.0, 1.01]).place[0].is_nan());
    }

    #[gaurast_runner::test]
    fn a_division_is_undone_by_dividing() {
        for k in [-0.3f32, 0.2] {
            let distorted = lens(DistortionModel::Division, [k, 0.0, 0.0, 0.0, 0.0, 0.0]).distort([0.4, -0.7]).place;
            let square = distorted[0] * distorted[0] + distorted[1] * distorted[1];
            let scale = 1.0 + f64::from(k) * square;
            assert!((distorted[0] / scale - 0.4).abs() < 1e-15 && (distorted[1] / scale + 0.7).abs() < 1e-15);
        }
    }

    #[gaurast_runner::test]
    fn a_field_of_view_is_an_angle() {
        let lens = lens(DistortionModel::FieldOfView, [1.2, 0.0, 0.0, 0.0, 0.0, 0.0]);
        // atan(tan(omega / 2)) / omega.
        let place = lens.distort([0.5, 0.0]).place;
        assert!((place[0] - 0.5).abs() < 1e-15, "{place:?}");
        let slope = |at: f64| lens.distort([at, 0.0]);
        let (near, far) = (slope(0.5e-4), slope(1e-4));
        assert!((near.derivative[0][0] - far.derivative[0][0]).abs() < 1e-7);
    }

    #[gaurast_runner::test]
    fn slopes_widen_where_a_lens_sees_more() {
        let barrel = lens(DistortionModel::FieldOfView, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let wide = barrel.widening(1.2);
        assert!(wide > 1.5, "{wide}");
        assert!((barrel.distort([1.2 * wide, 0.0]).place[0] - 1.2).abs() < 1e-12);
        assert_eq!(barrel.widening(2.0), f64::INFINITY);
        let pincushion = lens(DistortionModel::Polynomial, [0.3, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(pincushion.widening(1.2), 1.0);
    }
}
