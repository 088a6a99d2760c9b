//! Operations of floats that are rounded, or chosen, in the same way at every SIMD level and on every machine.
//!
//! Rust's own floor, ceiling, remainder and the like call the C library on processors without an instruction for them,
//! and its minimum and maximum leave the sign of zero open. `docs/arithmetic.md` lists what each operation means.

#![allow(clippy::disallowed_methods, reason = "instructions where the level has them")]

use fearless_simd::{Simd, f32x4, f32x16, i32x4, i32x16, prelude::*};

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

/// Products of floats that are added to or subtracted from, and rounded once.
pub trait FusedMultiply<S: Simd>: Floats<S> {
    /// `self * b + c`, rounded once.
    #[inline(always)]
    fn fused_add(self, b: Self, c: Self) -> Self {
        let simd = self.token();
        if has_instructions(simd) {
            return self.mul_add_precise(b, c);
        }
        let mut lanes = self;
        fuse(simd, lanes.as_mut_slice(), b.as_slice(), c.as_slice());
        lanes
    }

    /// `self * b - c`, rounded once.
    #[inline(always)]
    fn fused_sub(self, b: Self, c: Self) -> Self {
        self.fused_add(b, -c)
    }
}

impl<S: Simd, F: Floats<S>> FusedMultiply<S> for F {}

/// Makes `a * b + c` of each lane of `a`, rounded once without an instruction for it. It takes many instructions, which are
/// here once, and not in each kernel.
#[inline(never)]
fn fuse<S: Simd>(simd: S, a: &mut [f32], b: &[f32], c: &[f32]) {
    for ((a, b), c) in a.chunks_exact_mut(4).zip(b.chunks_exact(4)).zip(c.chunks_exact(4)) {
        fuse4(f32x4::from_slice(simd, a), f32x4::from_slice(simd, b), f32x4::from_slice(simd, c)).store_slice(a);
    }
}

/// `a * b + c` by way of binary64, in which the product is exact and a sum of zero too. Rounding the sum a second time gives
/// another result only if the sum is in the middle of two floats, or has fewer bits because it is denormal: then
/// `mul_add_precise` rounds to odd first.
#[inline(always)]
fn fuse4<S: Simd>(a: f32x4<S>, b: f32x4<S>, c: f32x4<S>) -> f32x4<S> {
    /// The bits of a binary64 number's lower half that are not in a float, and their value in the middle of two floats.
    const REST: i32 = 0x1fff_ffff;
    const MIDDLE: i32 = 0x1000_0000;
    /// The upper half of 2^-126, the smallest number that is not denormal, and one more.
    const NORMAL: i32 = 0x3810_0001;
    let ((a_low, a_high), (b_low, b_high), (c_low, c_high)) = (a.widen(), b.widen(), c.widen());
    let (low, high) = (a_low * b_low + c_low, a_high * b_high + c_high);
    let (low_bits, high_bits) = (low.bitcast::<i32x4<S>>(), high.bitcast::<i32x4<S>>());
    let is_middle = (low_bits.unzip_low(high_bits) & REST).simd_eq(MIDDLE);
    let magnitude = low_bits.unzip_high(high_bits) & i32::MAX;
    let is_denormal = magnitude.simd_gt(0) & magnitude.simd_lt(NORMAL);
    if (is_middle | is_denormal).any_true() { a.mul_add_precise(b, c) } else { low.narrow(high) }
}

/// `a * b + c`, rounded once.
#[inline(always)]
pub fn mul_add64<S: Simd>(simd: S, a: f64, b: f64, c: f64) -> f64 {
    if has_instructions(simd) { a.mul_add(b, c) } else { libm::fma(a, b, c) }
}
