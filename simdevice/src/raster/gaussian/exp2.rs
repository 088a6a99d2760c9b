//! Powers of two, 16 at a time.

use crate::lanes::{bits_of, floats_of};
use fearless_simd::{Simd, f32x16, prelude::*};

/// A polynomial fitted to 2^f for f in [-1/2, 1/2], highest power first; relative error 9.2e-8.
#[allow(
    clippy::approx_constant,
    reason = "the coefficients are fitted; one comes near ln 2"
)]
pub(super) const POWER_OF_TWO: [f32; 6] = [
    0.001_326_472_7,
    0.009_671_513,
    0.055_507_336,
    0.240_222_42,
    0.693_147,
    1.0,
];

/// 2 to the power of `-x`, for `x` between -126 and 126; elsewhere the result means nothing. Error: at most 1.9 ulp with
/// fused multiply-add, 2.1 ulp without (measured).
///
/// `-x = n + f` with `f` in [-1/2, 1/2], and 2^f is [`POWER_OF_TWO`].
#[inline(always)]
pub(super) fn exp2_of_negated<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    let constant = |value| f32x16::splat(simd, value);
    // Adding 1.5 * 2^23 rounds to an integer, which then stands in the low bits.
    let shifter = constant(12_582_912.0);
    let shifted = shifter - x;
    let f = (shifter - shifted) - x;
    let [first, rest @ ..] = POWER_OF_TWO;
    let mut p = constant(first);
    for coefficient in rest {
        p = p.mul_add(f, constant(coefficient));
    }
    let exponent = bits_of(shifted) << 23;
    floats_of(bits_of(p) + exponent)
}
