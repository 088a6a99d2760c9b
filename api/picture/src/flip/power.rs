//! Powers in binary32, in operations that compilers make vectors of. They are the same at every SIMD level.

use std::f32::consts::LN_2;

/// A sum with this rounds a number below 2^22 to a whole one, which is in the low bits.
pub(super) const WHOLE: f32 = 12_582_912.0;

/// The least number whose powers are not taken for zero.
const LEAST: f32 = 1e-30;

/// `base` to the power of `exponent`, within 1e-6 of it. Zero for bases of at most 1e-30.
#[inline(always)]
pub(super) fn power(base: f32, exponent: f32) -> f32 {
    let power = exp2(exponent * log2(base.max(LEAST)));
    if base > LEAST { power } else { 0.0 }
}

/// The base-2 logarithm of a normal number above zero.
#[inline(always)]
fn log2(value: f32) -> f32 {
    // The value is 2^whole times a part from 3/4 to 3/2.
    let bits = value.to_bits() as i32;
    let whole = bits.wrapping_sub(0x3f40_0000) >> 23;
    let part = f32::from_bits(bits.wrapping_sub(whole << 23) as u32);
    let t = (part - 1.0) / (part + 1.0);
    let t2 = t * t;
    let series = 1.0 + t2 * (1.0 / 3.0 + t2 * (1.0 / 5.0 + t2 * (1.0 / 7.0 + t2 * (1.0 / 9.0))));
    whole as f32 + (2.0 / LN_2) * t * series
}

/// 2 to the power of a number below 128; zero below -126.
#[inline(always)]
fn exp2(value: f32) -> f32 {
    let clamped = value.clamp(-126.0, 127.0);
    let rounded = clamped + WHOLE;
    let x = (clamped - (rounded - WHOLE)) * LN_2;
    let series = 1.0 / 24.0 + x * (1.0 / 120.0 + x * (1.0 / 720.0 + x * (1.0 / 5040.0)));
    let part = 1.0 + x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * series)));
    let whole = rounded.to_bits().wrapping_sub(WHOLE.to_bits());
    let scale = f32::from_bits(whole.wrapping_add(127) << 23);
    if value >= -126.0 { part * scale } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_those_of_the_standard_library() {
        for step in 0..100_000 {
            let base = 250.0 * (step as f32 / 1e5).powi(4);
            for exponent in [0.7, 1.0 / 3.0, 0.25, 1.0] {
                let (found, expected) = (power(base, exponent), f64::from(base).powf(f64::from(exponent)));
                let error = (f64::from(found) - expected).abs();
                assert!(error <= 1e-6 * expected + 1e-9, "{base} {exponent}: {found} {expected}");
            }
        }
        assert_eq!(power(0.0, 0.7), 0.0);
    }
}
