//! Operations of floats that are rounded, or chosen, in the same way at every SIMD level and on every machine.
//!
//! Rust's own floor, ceiling, remainder and the like call the C library on processors without an instruction for them,
//! and its minimum and maximum leave the sign of zero open. `docs/arithmetic.md` lists what each operation means.

#![allow(clippy::disallowed_methods, reason = "instructions where the level has them")]

use fearless_simd::{Simd, f32x16, i32x16, prelude::*};

type F<S> = f32x16<S>;

/// The smaller number: `a` if it is less, `b` if the two are equal, and the other one if one is NaN.
#[inline(always)]
pub fn least<T: Copy + PartialOrd>(a: T, b: T) -> T {
    if a < b || is_nan(b) { a } else { b }
}

/// The larger number: `a` if it is greater, `b` if the two are equal, and the other one if one is NaN.
#[inline(always)]
pub fn greatest<T: Copy + PartialOrd>(a: T, b: T) -> T {
    if a > b || is_nan(b) { a } else { b }
}

#[inline(always)]
fn is_nan<T: PartialOrd>(value: T) -> bool {
    value.partial_cmp(&value).is_none()
}

/// True if a level has instructions that round to an integer and that round a multiplication and addition once. All
/// have but SSE2.
#[inline(always)]
pub fn has_instructions<S: Simd>(simd: S) -> bool {
    #[cfg(target_arch = "x86_64")]
    let has = matches!(simd.level(), fearless_simd::Level::Avx2(_) | fearless_simd::Level::Avx512(_));
    #[cfg(not(target_arch = "x86_64"))]
    let has = !simd.level().is_fallback();
    has
}

/// Numbers from this magnitude on are integers.
const NO_FRACTION: f32 = 8_388_608.0;

/// `rounded` with the sign of `a`; `a` itself where it is an integer by its magnitude, or NaN.
#[inline(always)]
fn or_integer<S: Simd>(a: F<S>, rounded: F<S>) -> F<S> {
    let has_fraction = a.abs().simd_lt(F::splat(a.simd, NO_FRACTION));
    has_fraction.select(rounded.copysign(a), a)
}

/// The integer part of numbers below 2^31, without the sign of zero.
#[inline(always)]
fn integer_part<S: Simd>(a: F<S>) -> F<S> {
    F::float_from(i32x16::truncate_from(a))
}

/// The integer part.
#[inline(always)]
pub fn trunc<S: Simd>(a: F<S>) -> F<S> {
    if has_instructions(a.simd) {
        return a.trunc();
    }
    or_integer(a, integer_part(a))
}

/// The next integer at or below.
#[inline(always)]
pub fn floor<S: Simd>(a: F<S>) -> F<S> {
    if has_instructions(a.simd) {
        return a.floor();
    }
    let (whole, zero) = (integer_part(a), F::splat(a.simd, 0.0));
    or_integer(a, whole - whole.simd_gt(a).select(F::splat(a.simd, 1.0), zero))
}

/// The next integer at or above.
#[inline(always)]
pub fn ceil<S: Simd>(a: F<S>) -> F<S> {
    if has_instructions(a.simd) {
        return a.ceil();
    }
    let (whole, zero) = (integer_part(a), F::splat(a.simd, 0.0));
    or_integer(a, whole + whole.simd_lt(a).select(F::splat(a.simd, 1.0), zero))
}

/// The nearest integer, halves to even.
#[inline(always)]
pub fn round_ties_even<S: Simd>(a: F<S>) -> F<S> {
    if has_instructions(a.simd) {
        return a.round_ties_even();
    }
    // At this magnitude binary32 has no bits for a fraction.
    let a_positive = a.abs();
    or_integer(a, (a_positive + NO_FRACTION) - NO_FRACTION)
}

/// Defines a function of one binary64, for kernels that run lane by lane.
macro_rules! rounding64 {
    ($(#[doc = $doc:literal] $name:ident, $instruction:path, $library:path;)+) => {
        $(
            #[doc = $doc]
            #[inline(always)]
            pub fn $name<S: Simd>(simd: S, a: f64) -> f64 {
                if has_instructions(simd) { $instruction(a) } else { $library(a) }
            }
        )+
    };
}

rounding64! {
    /// The next integer at or below.
    floor64, f64::floor, libm::floor;
    /// The next integer at or above.
    ceil64, f64::ceil, libm::ceil;
    /// The integer part.
    trunc64, f64::trunc, libm::trunc;
    /// The nearest integer, halves to even.
    round_ties_even64, f64::round_ties_even, libm::rint;
}

/// `a - floor(a)`.
#[inline(always)]
pub fn fract64<S: Simd>(simd: S, a: f64) -> f64 {
    a - floor64(simd, a)
}

/// `a * b + c`, rounded once.
#[inline(always)]
pub fn mul_add64<S: Simd>(simd: S, a: f64, b: f64, c: f64) -> f64 {
    if has_instructions(simd) { a.mul_add(b, c) } else { libm::fma(a, b, c) }
}
