//! The precision that Vulkan requires of floating-point results ("Precision of Individual Operations").
//!
//! An error bound in units in the last place is modelled by an interval. A precision that is inherited from a formula
//! is modelled by evaluating the formula over intervals, each step with its own error. The result is the interval
//! around the true value that reaches as far as the farther end. An operation outside its domain, or whose formula may
//! give NaN, permits any result, which is `None`.

use super::types::Kind;

/// A floating-point format.
#[derive(Clone, Copy, Debug)]
pub struct Format {
    /// Bits of the significand after the point.
    digits: i32,
    /// The exponent of the least normal number.
    least: i32,
    /// The exponent of the largest number.
    most: i32,
    /// The error of exponential functions at 0, in units in the last place.
    exp_base: f64,
    /// The absolute error of logarithms near 1.
    log_error: f64,
    /// The absolute error of sines and cosines.
    sine_error: f64,
    /// The error of arc tangents, in units in the last place.
    atan_ulps: f64,
}

/// Half precision.
pub const HALF: Format = Format {
    digits: 10,
    least: -14,
    most: 15,
    exp_base: 1.0,
    log_error: 1.0 / 128.0,
    sine_error: 1.0 / 128.0,
    atan_ulps: 5.0,
};

/// Single precision.
pub const SINGLE: Format = Format {
    digits: 23,
    least: -126,
    most: 127,
    exp_base: 3.0,
    log_error: 1.0 / (1 << 21) as f64,
    sine_error: 1.0 / 2048.0,
    atan_ulps: 4096.0,
};

/// The requirement on double precision in these tests. The specification has no table for it. It is six bits less than
/// the format has, so that the rounding of the models, which are in double precision too, has no effect.
pub const DOUBLE: Format = Format {
    digits: 46,
    least: -1022,
    most: 1023,
    exp_base: 3.0,
    log_error: 1e-12,
    sine_error: 1e-12,
    atan_ulps: 4096.0,
};

/// The format of a float kind.
pub fn format(kind: Kind) -> Format {
    match kind {
        Kind::F16 => HALF,
        Kind::F32 => SINGLE,
        _ => DOUBLE,
    }
}

/// The numbers from `low` to `high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The lower end.
    pub low: f64,
    /// The upper end.
    pub high: f64,
}

/// An interval, or `None` if the result is undefined.
pub type Maybe = Option<Interval>;

/// The interval of one number.
pub fn exactly(value: f64) -> Interval {
    Interval { low: value, high: value }
}

/// A power of two, at least the least positive double.
fn power(exponent: i32) -> f64 {
    // `powi` computes negative powers by division, which would overflow to infinity.
    let exponent = exponent.max(-1074);
    2f64.powi(exponent / 2) * 2f64.powi(exponent - exponent / 2)
}

fn hull(values: &[f64]) -> Maybe {
    let mut all = exactly(*values.first()?);
    for value in values {
        if value.is_nan() {
            return None;
        }
        all = Interval { low: all.low.min(*value), high: all.high.max(*value) };
    }
    Some(all)
}

/// The range of a function that is monotone in each operand, from its values at the corners.
fn corners(a: Interval, b: Interval, function: impl Fn(f64, f64) -> f64) -> Maybe {
    hull(&[function(a.low, b.low), function(a.low, b.high), function(a.high, b.low), function(a.high, b.high)])
}

impl Interval {
    fn has(self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    /// The negated numbers.
    pub fn negated(self) -> Self {
        Self { low: -self.high, high: -self.low }
    }

    fn widened(self, low: f64, high: f64) -> Self {
        Self { low: self.low - low, high: self.high + high }
    }
}

impl Format {
    /// The unit in the last place of a number.
    pub fn ulp(self, value: f64) -> f64 {
        let size = value.abs();
        if size == 0.0 || !size.is_finite() {
            let exponent = if size == 0.0 { self.least } else { self.most };
            return power(exponent - self.digits);
        }
        let mut exponent = ((size.to_bits() >> 52) as i32 - 1023).max(self.least);
        // Below a power of two the numbers are closer together.
        if exponent > self.least && size == 2f64.powi(exponent) {
            exponent -= 1;
        }
        power(exponent.min(self.most) - self.digits)
    }

    /// The largest number.
    pub fn largest(self) -> f64 {
        (2.0 - 2f64.powi(-self.digits)) * 2f64.powi(self.most)
    }

    fn ulps(self, exact: Interval, count: impl Fn(f64) -> f64) -> Interval {
        exact.widened(count(exact.low) * self.ulp(exact.low), count(exact.high) * self.ulp(exact.high))
    }

    /// The possible results of a correctly rounded operation: the neighbouring numbers of the format on either side.
    pub fn rounded(self, exact: Interval) -> Interval {
        let grid = |value: f64| {
            let ulp = self.ulp(value * (1.0 + f64::EPSILON));
            (value / ulp, ulp)
        };
        let down = |value: f64| match grid(value) {
            (steps, ulp) if steps.is_finite() => steps.floor() * ulp,
            _ => value,
        };
        let up = |value: f64| match grid(value) {
            (steps, ulp) if steps.is_finite() => steps.ceil() * ulp,
            _ => value,
        };
        let mut all = Interval { low: down(exact.low), high: up(exact.high) };
        if all.high > self.largest() {
            all.high = f64::INFINITY;
        }
        if all.low < -self.largest() {
            all.low = f64::NEG_INFINITY;
        }
        all
    }

    /// `a + b`.
    pub fn add(self, a: Interval, b: Interval) -> Maybe {
        corners(a, b, |a, b| a + b).map(|it| self.rounded(it))
    }

    /// `a - b`.
    pub fn sub(self, a: Interval, b: Interval) -> Maybe {
        self.add(a, b.negated())
    }

    /// `a b`.
    pub fn mul(self, a: Interval, b: Interval) -> Maybe {
        corners(a, b, |a, b| a * b).map(|it| self.rounded(it))
    }

    /// `a / b`: 2.5 units in the last place for divisors that are neither tiny nor huge.
    pub fn div(self, a: Interval, b: Interval) -> Maybe {
        let (least, most) = (2f64.powi(self.least), 2f64.powi(-self.least));
        let fits = |value: f64| (least..=most).contains(&value.abs());
        if b.has(0.0) || !fits(b.low) || !fits(b.high) {
            return None;
        }
        corners(a, b, |a, b| a / b).map(|it| self.ulps(it, |_| 2.5))
    }

    /// The sum of the products of components.
    pub fn dot(self, a: &[Interval], b: &[Interval]) -> Maybe {
        // Any order of the additions is allowed, so each addition is rounded as the largest partial sum is.
        let mut sum = exactly(0.0);
        let mut largest = 0f64;
        for (a, b) in a.iter().zip(b) {
            let product = self.mul(*a, *b)?;
            sum = corners(sum, product, |a, b| a + b)?;
            largest += product.low.abs().max(product.high.abs());
        }
        let slack = self.ulp(largest) * a.len().saturating_sub(1) as f64;
        Some(self.rounded(sum.widened(slack, slack)))
    }

    /// `1 / sqrt(x)`: 2 units in the last place.
    pub fn inverse_sqrt(self, x: Interval) -> Maybe {
        (x.low > 0.0).then_some(())?;
        let exact = hull(&[x.low.sqrt().recip(), x.high.sqrt().recip()])?;
        Some(self.ulps(exact, |_| 2.0))
    }

    /// `sqrt(x)`, from `1 / inverse_sqrt(x)`.
    pub fn sqrt(self, x: Interval) -> Maybe {
        if x == exactly(0.0) {
            return Some(x);
        }
        if x.low == 0.0 {
            let high = self.sqrt(exactly(x.high))?.high;
            return Some(Interval { low: 0.0, high });
        }
        self.div(exactly(1.0), self.inverse_sqrt(x)?)
    }

    fn exponential(self, x: Interval, function: fn(f64) -> f64) -> Maybe {
        let error = |x: f64| (self.exp_base + 2.0 * x.abs()) * self.ulp(function(x));
        let exact = hull(&[function(x.low), function(x.high)])?;
        (x.low.is_finite() && x.high.is_finite()).then_some(())?;
        Some(exact.widened(error(x.low), error(x.high)))
    }

    /// `e^x`.
    pub fn exp(self, x: Interval) -> Maybe {
        self.exponential(x, f64::exp)
    }

    /// `2^x`.
    pub fn exp2(self, x: Interval) -> Maybe {
        self.exponential(x, f64::exp2)
    }

    fn logarithm(self, x: Interval, function: fn(f64) -> f64) -> Maybe {
        (x.low > 0.0 && x.high.is_finite()).then_some(())?;
        let error = |x: f64| match x {
            0.5..=2.0 => self.log_error,
            _ => 3.0 * self.ulp(function(x)),
        };
        let exact = hull(&[function(x.low), function(x.high)])?;
        Some(exact.widened(error(x.low), error(x.high)))
    }

    /// The natural logarithm.
    pub fn log(self, x: Interval) -> Maybe {
        self.logarithm(x, f64::ln)
    }

    /// The binary logarithm.
    pub fn log2(self, x: Interval) -> Maybe {
        self.logarithm(x, f64::log2)
    }

    fn sine(self, x: f64, function: fn(f64) -> f64) -> Maybe {
        (x.abs() <= std::f64::consts::PI).then_some(())?;
        Some(exactly(function(x)).widened(self.sine_error, self.sine_error))
    }

    /// The sine, from -pi to pi.
    pub fn sin(self, x: f64) -> Maybe {
        self.sine(x, f64::sin)
    }

    /// The cosine, from -pi to pi.
    pub fn cos(self, x: f64) -> Maybe {
        self.sine(x, f64::cos)
    }

    /// The angle of (x, y), for intervals within a quadrant.
    pub fn atan2(self, y: Interval, x: Interval) -> Maybe {
        // GLSL leaves the result undefined if both are zero or either is infinite.
        let finite = [y.low, y.high, x.low, x.high].iter().all(|it| it.is_finite());
        (finite && !(y.has(0.0) && x.has(0.0))).then_some(())?;
        // The branch cut: on the negative x axis both signs of pi are possible.
        if y.has(0.0) && x.low < 0.0 {
            let far = std::f64::consts::PI + self.atan_ulps * self.ulp(std::f64::consts::PI);
            return Some(Interval { low: -far, high: far });
        }
        let exact = corners(y, x, f64::atan2)?;
        Some(self.ulps(exact, |_| self.atan_ulps))
    }

    /// The interval around the true result that a formula's interval permits.
    pub fn inherited(self, truth: f64, formula: Maybe) -> Maybe {
        let formula = formula?;
        let error = (truth - formula.low).abs().max((truth - formula.high).abs());
        (truth.is_finite() && !error.is_nan()).then_some(())?;
        // The formula's own ends are included again, because the widened ends are rounded here.
        Some(Interval { low: formula.low.min(truth - error), high: formula.high.max(truth + error) })
    }

    /// True if a result is within an interval. In place of a value above the largest number, infinity or the largest
    /// number is accepted.
    pub fn permits(self, interval: Interval, found: f64) -> bool {
        let largest = self.largest();
        interval.has(found)
            || (interval.high > largest && (found == f64::INFINITY || found == largest))
            || (interval.low < -largest && (found == f64::NEG_INFINITY || found == -largest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_in_the_last_place() {
        assert_eq!(SINGLE.ulp(1.5), f64::from(f32::EPSILON));
        assert_eq!(SINGLE.ulp(1.0), f64::from(f32::EPSILON) / 2.0);
        assert_eq!(SINGLE.ulp(0.0), f64::from(f32::from_bits(1)));
        assert_eq!(HALF.ulp(3.0), 2f64.powi(-9));
        assert_eq!(SINGLE.largest(), f64::from(f32::MAX));
        assert_eq!(HALF.largest(), 65504.0);
    }

    #[test]
    fn rounding_gives_both_neighbours() {
        let third = SINGLE.rounded(exactly(1.0 / 3.0));
        assert_eq!(third.high, f64::from(1.0f32 / 3.0));
        assert_eq!(third.low, f64::from((1.0f32 / 3.0).next_down()));
        assert_eq!(SINGLE.rounded(exactly(0.25)), exactly(0.25));
        assert_eq!(SINGLE.rounded(exactly(1e39)).high, f64::INFINITY);
    }

    #[test]
    fn inherited_intervals_reach_as_far_on_both_sides() {
        let formula = Some(Interval { low: 0.5, high: 1.25 });
        let found = SINGLE.inherited(1.0, formula).unwrap();
        assert_eq!((found.low, found.high), (0.5, 1.5));
        assert_eq!(SINGLE.inherited(1.0, None), None);
        assert_eq!(SINGLE.div(exactly(1.0), exactly(0.0)), None);
    }
}
