//! Powers of two, 16 at a time: exact ones by a table of eight words and a short polynomial, approximate ones by a polynomial
//! alone. All levels compute the same bits.

use crate::simd::{bits_of, floats_of};
use fearless_simd::{Simd, f32x16, prelude::*};
use isa::float::FusedMultiply;

/// A polynomial with few terms for powers of two.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Powers<const TERMS: usize> {
    /// The coefficients, highest power first, fitted to 2^f for f in [-1/2, 1/2] for the least relative error.
    pub(crate) coefficients: [f32; TERMS],
    /// A bound of the results' relative error, rounding included.
    pub(crate) error: f32,
}

/// The polynomial of degree 3.
pub(crate) const CUBIC: Powers<4> =
    Powers { coefficients: [0.055_171_67, 0.242_611_13, 0.693_260_97, 0.999_928_06], error: 7.6e-5 };

/// The polynomial of degree 2.
pub(crate) const QUADRATIC: Powers<3> = Powers { coefficients: [0.238_428_94, 0.703_448, 1.000_443_1], error: 1.73e-3 };

impl<const TERMS: usize> Powers<TERMS> {
    /// The result of [`exp2_of_negated`] with this polynomial, for `x` up to 125.9. At the end of the range it may be
    /// slightly less than a normal number. Fast kernels have no floor so low.
    #[inline(always)]
    pub(crate) fn of_negated<S: Simd>(&self, simd: S, x: f32x16<S>) -> f32x16<S> {
        let constant = |value| f32x16::splat(simd, value);
        // Adding 1.5 * 2^23 rounds to an integer, which is then in the low bits.
        let shifter = constant(12_582_912.0);
        let shifted = shifter - x;
        let f = (shifter - shifted) - x;
        let mut p = constant(self.coefficients[0]);
        for &coefficient in &self.coefficients[1..] {
            p = p.fused_add(f, constant(coefficient));
        }
        let exponent = bits_of(shifted) << 23;
        floats_of(bits_of(p) + exponent)
    }
}

/// The words of the table.
const EIGHTHS: usize = 8;

/// The bits of 2^(j/8) for each j, minus j times an eighth of the exponent's unit.
pub(crate) const POWERS_OF_EIGHTHS: [u32; EIGHTHS] =
    [0x3f80_0000, 0x3f7b_95c2, 0x3f78_37f0, 0x3f75_fed7, 0x3f75_04f3, 0x3f75_672a, 0x3f77_44fd, 0x3f7a_c0c7];

/// A polynomial fitted to (2^f - 1) / f for |f| up to 1/16, highest power first. Its relative error for 2^f is 2.7e-8.
pub(crate) const GROWTH: [f32; 3] = [0.055_496_22, 0.240_257_65, 0.693_147_24];

/// 2 to the power of `-x`, for `x` between -126 and 126; undefined elsewhere. The error is at most 1.35 ulp (measured).
///
/// The power of `-x = n + j / 8 + f` is 2^(n + j / 8), by a table, times 2^f, by a polynomial. At AVX2 that takes no more
/// instructions than a polynomial of degree 5 without a table, and its chain of dependent instructions is shorter.
#[inline(always)]
pub(crate) fn exp2_of_negated<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    let constant = |value| f32x16::splat(simd, value);
    // Adding 1.5 * 2^23 / 8 rounds to multiples of 1/8, whose number is then in the low bits.
    let shifter = constant(12_582_912.0 / EIGHTHS as f32);
    let shifted = shifter - x;
    let f = (shifter - shifted) - x;
    let parts = bits_of(shifted);
    let word = devmem::look_up(simd, &POWERS_OF_EIGHTHS, parts);
    let power = floats_of(word + (parts << (23 - EIGHTHS.ilog2())));
    let mut growth = constant(GROWTH[0]);
    for coefficient in &GROWTH[1..] {
        growth = growth.fused_add(f, constant(*coefficient));
    }
    (power * f).fused_add(growth, power)
}
