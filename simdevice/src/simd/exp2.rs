//! Powers of two, 16 at a time: by a table and a short polynomial on processors that look up words in vectors,
//! otherwise by a longer polynomial.

use crate::simd::{bits_of, floats_of};
use fearless_simd::{Simd, f32x16, prelude::*};

/// A polynomial fitted to 2^f for f in [-1/2, 1/2], highest power first. Its relative error is 9.2e-8.
#[allow(clippy::approx_constant, reason = "the coefficients are fitted; one comes near ln 2")]
pub(crate) const POWER_OF_TWO: [f32; 6] = [0.001_326_472_7, 0.009_671_513, 0.055_507_336, 0.240_222_42, 0.693_147, 1.0];

/// A polynomial with fewer terms for powers of two.
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
        by_polynomial(simd, x, &self.coefficients)
    }
}

/// 2 to the power of `-x`, for `x` between -126 and 126; undefined elsewhere. The error is at most 1.95 ulp with the
/// table of 32 words, 1.35 ulp with that of 8, and 2.1 ulp with the polynomial (measured).
#[inline(always)]
pub(crate) fn exp2_of_negated<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    match devmem::places(simd.level()) {
        Some(32) => by_table(simd, x, &THIRTY_SECONDS),
        Some(8) => by_table(simd, x, &EIGHTHS),
        _ => by_polynomial(simd, x, &POWER_OF_TWO),
    }
}

/// The table and the polynomial for powers of two: the table has powers of fractions `j / PLACES`, and the polynomial
/// interpolates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Table<const PLACES: usize, const TERMS: usize> {
    /// The bits of 2^(j/PLACES) for each j, minus j times the exponent's unit divided by `PLACES`.
    pub(crate) words: [u32; PLACES],
    /// A polynomial fitted to (2^f - 1) / f for |f| up to half of 1/PLACES, highest power first.
    pub(crate) growth: [f32; TERMS],
}

/// The table of 8 words. The relative error of the polynomial for 2^f is 2.7e-8.
pub(crate) const EIGHTHS: Table<8, 3> = Table {
    words: [0x3f80_0000, 0x3f7b_95c2, 0x3f78_37f0, 0x3f75_fed7, 0x3f75_04f3, 0x3f75_672a, 0x3f77_44fd, 0x3f7a_c0c7],
    growth: [0.055_496_22, 0.240_257_65, 0.693_147_24],
};

/// The table of 32 words. The relative error of the polynomial for 2^f is 5.4e-8.
pub(crate) const THIRTY_SECONDS: Table<32, 2> = Table {
    words: [
        0x3f80_0000,
        0x3f7e_cd87,
        0x3f7d_aac3,
        0x3f7c_980f,
        0x3f7b_95c2,
        0x3f7a_a43a,
        0x3f79_c3d3,
        0x3f78_f4f0,
        0x3f78_37f0,
        0x3f77_8d3a,
        0x3f76_f532,
        0x3f76_7043,
        0x3f75_fed7,
        0x3f75_a15b,
        0x3f75_583f,
        0x3f75_23f6,
        0x3f75_04f3,
        0x3f74_fbaf,
        0x3f75_08a4,
        0x3f75_2c4d,
        0x3f75_672a,
        0x3f75_b9be,
        0x3f76_248c,
        0x3f76_a81e,
        0x3f77_44fd,
        0x3f77_fbb8,
        0x3f78_ccdf,
        0x3f79_b907,
        0x3f7a_c0c7,
        0x3f7b_e4ba,
        0x3f7d_257d,
        0x3f7e_83b3,
    ],
    growth: [0.240_226_49, 0.693_157_3],
};

/// 2 to the power of `-x = n + j / PLACES + f`, by a table. It takes no more instructions than the long polynomial, and
/// its chain of dependent instructions is shorter.
#[inline(always)]
fn by_table<S: Simd, const PLACES: usize, const TERMS: usize>(
    simd: S,
    x: f32x16<S>,
    table: &Table<PLACES, TERMS>,
) -> f32x16<S> {
    let constant = |value| f32x16::splat(simd, value);
    // Adding 1.5 * 2^23 / PLACES rounds to multiples of 1/PLACES, whose number is then in the low bits.
    let shifter = constant(12_582_912.0 / PLACES as f32);
    let shifted = shifter - x;
    let f = (shifter - shifted) - x;
    let parts = bits_of(shifted);
    let word = devmem::look_up(simd, &table.words, parts);
    let power = floats_of(word + (parts << (23 - PLACES.ilog2())));
    let mut growth = constant(table.growth[0]);
    for &coefficient in &table.growth[1..] {
        growth = growth.mul_add(f, constant(coefficient));
    }
    (power * f).mul_add(growth, power)
}

/// 2 to the power of `-x = n + f` with `f` in [-1/2, 1/2], by a polynomial for 2^f.
#[inline(always)]
fn by_polynomial<S: Simd, const TERMS: usize>(simd: S, x: f32x16<S>, coefficients: &[f32; TERMS]) -> f32x16<S> {
    let constant = |value| f32x16::splat(simd, value);
    // Adding 1.5 * 2^23 rounds to an integer, which is then in the low bits.
    let shifter = constant(12_582_912.0);
    let shifted = shifter - x;
    let f = (shifter - shifted) - x;
    let mut p = constant(coefficients[0]);
    for &coefficient in &coefficients[1..] {
        p = p.mul_add(f, constant(coefficient));
    }
    let exponent = bits_of(shifted) << 23;
    floats_of(bits_of(p) + exponent)
}
