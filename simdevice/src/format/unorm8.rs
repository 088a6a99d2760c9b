//! Conversions between bytes and numbers from 0 to 1, 16 words at a time.

use crate::simd::bits_of;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, f32x16, i32x8, i32x16, mask32x16, u32x8, u32x16};
use isa::float::{self, FusedMultiply};

/// 1/255 as the sum of a number of 16 bits, whose product with a code is exact, and the rest. The sum of the two
/// products rounds as the quotient does.
const INV_255: [f32; 2] = {
    let high = f32::from_bits((1f32 / 255.0).to_bits() & !0xFF);
    [high, (1.0 / 255.0 - high as f64) as f32]
};

/// Defines a function that divides one byte of each word by 255, correctly rounded.
macro_rules! unorm8_fraction {
    ($name:ident, $words:ident, $integers:ident, $floats:ident) => {
        /// One byte of each word divided by 255, correctly rounded.
        #[inline(always)]
        pub fn $name<S: Simd>(word: $words<S>, shift: u32) -> $floats<S> {
            let code = if shift == 24 { word >> 24 } else { (word >> shift) & 0xFF };
            let code = $floats::float_from(code.bitcast::<$integers<S>>());
            code * INV_255[0] + code * INV_255[1]
        }
    };
}

unorm8_fraction!(unorm8_fraction, u32x16, i32x16, f32x16);

unorm8_fraction!(unorm8_fraction_8, u32x8, i32x8, f32x8);

/// The colours of 16 fragments, by component.
pub type Colors<S> = [f32x16<S>; 4];

/// Clamps numbers. NaN becomes `low`: x86's maximum gives its second operand if the first is NaN, also a signalling one.
#[inline(always)]
pub(crate) fn clamp<S: Simd>(simd: S, value: f32x16<S>, low: f32, high: f32) -> f32x16<S> {
    let (low, high) = (f32x16::splat(simd, low), f32x16::splat(simd, high));
    value.max(low).min(high)
}

/// The nearest 8-bit codes of numbers from 0 to 1, in the low bits. The bits above are undefined. Numbers may be too
/// great by some units in the last place.
#[inline(always)]
fn unorm8<S: Simd>(simd: S, value: f32x16<S>) -> u32x16<S> {
    // At this magnitude binary32 has no bits for a fraction.
    const NO_FRACTION: f32 = 8_388_608.0;
    if float::has_instructions(simd) {
        // This rounds once, to the nearest integer. 127.5 is the only tie.
        let scaled = value.fused_add(f32x16::splat(simd, 255.0), f32x16::splat(simd, NO_FRACTION));
        return bits_of(scaled);
    }
    // 255 v = 256 v - v. The first term is exact, so that its nearest integer is the result or one more.
    let scaled = value * 256.0;
    let rounded = scaled + NO_FRACTION;
    let excess = (scaled - (rounded - NO_FRACTION) + 0.5) - value;
    let more: mask32x16<S> = excess.simd_lt(0.0);
    let one = more.select(f32x16::splat(simd, 1.0), f32x16::splat(simd, 0.0));
    bits_of(rounded - one)
}

/// Packs numbers, clamped to 0 to 1, as four bytes per word, each rounded to nearest.
#[inline(always)]
pub fn pack_unorm8<S: Simd>(simd: S, colors: &Colors<S>, bgra: bool) -> u32x16<S> {
    let mut clamped = *colors;
    for component in &mut clamped {
        *component = clamp(simd, *component, 0.0, 1.0);
    }
    pack_unorm8_in_range(simd, &clamped, bgra)
}

/// Packs numbers as [`pack_unorm8`] does, without clamping.
#[inline(always)]
pub fn pack_unorm8_in_range<S: Simd>(simd: S, [r, g, b, a]: &Colors<S>, bgra: bool) -> u32x16<S> {
    let (first, third) = if bgra { (b, r) } else { (r, b) };
    (unorm8(simd, *first) & 255)
        | (unorm8(simd, *g) & 255) << 8
        | (unorm8(simd, *third) & 255) << 16
        | unorm8(simd, *a) << 24
}

/// The four bytes of each word as numbers from 0 to 1.
#[inline(always)]
pub fn unpack_unorm8<S: Simd>(_: S, texels: u32x16<S>, bgra: bool) -> Colors<S> {
    let first = unorm8_fraction(texels, 0);
    let second = unorm8_fraction(texels, 8);
    let third = unorm8_fraction(texels, 16);
    let fourth = unorm8_fraction(texels, 24);
    if bgra { [third, second, first, fourth] } else { [first, second, third, fourth] }
}
