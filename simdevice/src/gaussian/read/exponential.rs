//! Exponential functions of many numbers in binary64, for values that are rounded to binary32.
//!
//! The functions have no branches, so that neighbouring numbers overlap. Their errors are bounded by [`ERROR`]; where that is
//! not enough to round a value, another function gives it (Ziv's rounding test). So the values do not depend on these functions.

/// A bound of the relative error of [`fast_exp`], [`fast_exp_m1`], and of a few operations on their values.
const ERROR: f64 = 1.0 / (1_u64 << 48) as f64;

/// The numbers that are rounded at once.
const AT_ONCE: usize = 16;

/// The greatest argument. The exponential function of it is above all numbers of binary32, and that of its negative rounds to 0.
const GREATEST: f64 = 200.0;

/// A number that rounds a sum with it to a whole number, of which the sum's lowest bits are the two's complement.
const WHOLE: f64 = 1.5 * (1_u64 << 52) as f64;

/// The natural logarithm of 2: a part whose product with a whole number below 2^20 is exact, and the rest.
const LN_2: [f64; 2] = [f64::from_bits(0x3FE6_2E42_FEE0_0000), 1.908_214_929_270_587_7e-10];

/// The coefficients of the series of `exp(x) - 1`, from that of `x^13` down to that of `x^2`.
const SERIES: [f64; 12] = {
    let mut series = [0.0; 12];
    let (mut factorial, mut power) = (1.0, 2);
    while power <= 13 {
        factorial *= power as f64;
        series[13 - power] = 1.0 / factorial;
        power += 1;
    }
    series
};

/// A power of 2, and `exp(x) - 1` of the rest of an argument.
struct Reduced {
    power: f64,
    rest: f64,
}

#[inline(always)]
fn reduce(x: f64) -> Reduced {
    let x = x.clamp(-GREATEST, GREATEST);
    let sum = x * std::f64::consts::LOG2_E + WHOLE;
    let whole = sum - WHOLE;
    let rest = (x - whole * LN_2[0]) - whole * LN_2[1];
    let series = SERIES.iter().skip(1).fold(SERIES[0], |sum, coefficient| sum * rest + coefficient);
    Reduced {
        power: f64::from_bits((sum.to_bits() << 52).wrapping_add(1.0_f64.to_bits())),
        rest: rest * rest * series + rest,
    }
}

/// The exponential function. Beyond [`GREATEST`] only its rounded value holds.
#[inline(always)]
pub(super) fn fast_exp(x: f64) -> f64 {
    let Reduced { power, rest } = reduce(x);
    power * rest + power
}

/// The exponential function less 1, of a number that is not negative. Beyond [`GREATEST`] only its rounded value holds.
#[inline(always)]
pub(super) fn fast_exp_m1(x: f64) -> f64 {
    let Reduced { power, rest } = reduce(x);
    power * rest + (power - 1.0)
}

/// Rounds values to binary32: those of `fast`, whose relative errors are at most [`ERROR`], or those of `exact`, where the error
/// may change the rounded value.
#[inline(always)]
pub(super) fn round_all(numbers: &[f64], out: &mut [f32], fast: impl Fn(f64) -> f64, exact: impl Fn(f64) -> f32) {
    let (groups, rest) = numbers.as_chunks::<AT_ONCE>();
    let (out_groups, out_rest) = out.as_chunks_mut::<AT_ONCE>();
    for (numbers, out) in groups.iter().zip(out_groups) {
        let (mut low, mut high) = ([0.0_f32; AT_ONCE], [0.0_f32; AT_ONCE]);
        for lane in 0..AT_ONCE {
            let value = fast(numbers[lane]);
            low[lane] = (value * (1.0 - ERROR)) as f32;
            high[lane] = (value * (1.0 + ERROR)) as f32;
        }
        // Unequal for NaN, too.
        if low != high {
            for lane in 0..AT_ONCE {
                if low[lane] != high[lane] {
                    low[lane] = exact(numbers[lane]);
                }
            }
        }
        *out = low;
    }
    for (out, number) in out_rest.iter_mut().zip(rest) {
        *out = exact(*number);
    }
}
