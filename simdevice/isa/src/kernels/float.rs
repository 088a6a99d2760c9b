//! Operations of floats that are rounded, or chosen, in the same way at every SIMD level and on every machine.
//!
//! Rust's own floor, ceiling, remainder and the like call the C library on processors without an instruction for them,
//! and its minimum and maximum leave the sign of zero open. `docs/arithmetic.md` lists what each operation means.

#![allow(clippy::disallowed_methods, reason = "instructions where the level has them")]

use fearless_simd::{Simd, f32x16, i32x16, prelude::*};

/// A vector of binary32 numbers.
pub trait Floats<S: Simd>: SimdFloat<S, Element = f32> {}

impl<S: Simd, F: SimdFloat<S, Element = f32>> Floats<S> for F {}

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
fn or_integer<S: Simd, F: Floats<S>>(a: F, rounded: F) -> F {
    let has_fraction = a.abs().simd_lt(F::splat(a.token(), NO_FRACTION));
    has_fraction.select(rounded.copysign(a), a)
}

/// The nearest integer, halves to even, of numbers without a sign below [`NO_FRACTION`].
#[inline(always)]
fn nearest<S: Simd, F: Floats<S>>(positive: F) -> F {
    // At this magnitude binary32 has no bits for a fraction.
    (positive + NO_FRACTION) - NO_FRACTION
}

/// The integer part.
#[inline(always)]
pub fn trunc<S: Simd>(a: f32x16<S>) -> f32x16<S> {
    if has_instructions(a.simd) {
        return a.trunc();
    }
    or_integer(a, f32x16::float_from(i32x16::truncate_from(a)))
}

/// The next integer at or below.
#[inline(always)]
pub fn floor<S: Simd, F: Floats<S>>(a: F) -> F {
    let simd = a.token();
    if has_instructions(simd) {
        return a.floor();
    }
    let whole = nearest(a.abs()).copysign(a);
    or_integer(a, whole - whole.simd_gt(a).select(F::splat(simd, 1.0), F::splat(simd, 0.0)))
}

/// The next integer at or above.
#[inline(always)]
pub fn ceil<S: Simd, F: Floats<S>>(a: F) -> F {
    let simd = a.token();
    if has_instructions(simd) {
        return a.ceil();
    }
    let whole = nearest(a.abs()).copysign(a);
    or_integer(a, whole + whole.simd_lt(a).select(F::splat(simd, 1.0), F::splat(simd, 0.0)))
}

/// The nearest integer, halves to even.
#[inline(always)]
pub fn round_ties_even<S: Simd, F: Floats<S>>(a: F) -> F {
    if has_instructions(a.token()) {
        return a.round_ties_even();
    }
    or_integer(a, nearest(a.abs()))
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
