//! Powers in binary32, the same at every SIMD level.

use std::f32::consts::LN_2;

use fearless_simd::{Simd, f32x16, i32x16, prelude::*};

/// A sum with this rounds a number below 2^22 to a whole one, which is in the low bits.
pub(super) const WHOLE: f32 = 12_582_912.0;

/// The least number whose powers are not taken for zero.
const LEAST: f32 = 1e-30;

/// Bases to the power of exponents, within 1e-6 of them. Zero for bases of at most 1e-30.
#[inline(always)]
pub(super) fn power<S: Simd>(simd: S, base: f32x16<S>, exponent: f32x16<S>) -> f32x16<S> {
    let least = f32x16::splat(simd, LEAST);
    let power = exp2(simd, exponent * log2(simd, base.max(least)));
    base.simd_gt(least).select(power, f32x16::splat(simd, 0.0))
}

/// The base-2 logarithms of normal numbers above zero.
#[inline(always)]
fn log2<S: Simd>(simd: S, value: f32x16<S>) -> f32x16<S> {
    // A value is 2^whole times a part from 3/4 to 3/2.
    let bits: i32x16<S> = value.bitcast();
    let whole = (bits - i32x16::splat(simd, 0x3f40_0000)) >> 23;
    let part: f32x16<S> = (bits - (whole << 23)).bitcast();
    let t = (part - 1.0) / (part + 1.0);
    let t2 = t * t;
    let mut series = f32x16::splat(simd, 1.0 / 9.0);
    for coefficient in [1.0 / 7.0, 1.0 / 5.0, 1.0 / 3.0, 1.0] {
        series = t2 * series + coefficient;
    }
    f32x16::float_from(whole) + t * (2.0 / LN_2) * series
}

/// 2 to the power of numbers below 128; zero below -126.
#[inline(always)]
fn exp2<S: Simd>(simd: S, value: f32x16<S>) -> f32x16<S> {
    let least = f32x16::splat(simd, -126.0);
    let clamped = value.max(least).min(f32x16::splat(simd, 127.0));
    let rounded = clamped + WHOLE;
    let x = (clamped - (rounded - WHOLE)) * LN_2;
    let mut series = f32x16::splat(simd, 1.0 / 5040.0);
    for coefficient in [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0] {
        series = x * series + coefficient;
    }
    let whole = rounded.bitcast::<i32x16<S>>() - i32x16::splat(simd, WHOLE.to_bits() as i32 - 127);
    let scale: f32x16<S> = (whole << 23).bitcast();
    value.simd_ge(least).select(series * scale, f32x16::splat(simd, 0.0))
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    #[test]
    fn powers_are_those_of_the_standard_library() {
        let powers = |base: f32, exponent: f32| -> [f32; 16] {
            dispatch!(Level::new(), simd => {
                let (base, exponent) = (f32x16::splat(simd, base), f32x16::splat(simd, exponent));
                power(simd, base, exponent).into()
            })
        };
        for step in 0..100_000 {
            let base = 250.0 * (step as f32 / 1e5).powi(4);
            for exponent in [0.7, 1.0 / 3.0, 0.25, 1.0] {
                let (found, expected) = (powers(base, exponent)[step % 16], f64::from(base).powf(f64::from(exponent)));
                let error = (f64::from(found) - expected).abs();
                assert!(error <= 1e-6 * expected + 1e-9, "{base} {exponent}: {found} {expected}");
            }
        }
        assert_eq!(powers(0.0, 0.7), [0.0; 16]);
    }
}
