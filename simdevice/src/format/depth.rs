//! The encodings of depth attachments: integers that compare as the depths do.

use crate::format::Format;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, i32x16, u32x16};
use isa::float;

/// The encoding of depths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthEncoding {
    /// A normalised integer of this many bits.
    Unorm(u32),
    /// The bits of a binary32 number, as [`ordered`] changes them.
    Float,
}

/// The bits of a binary32 number, changed so that they are ordered as the numbers are: the sign of a positive number is
/// set, and all bits of a negative one are inverted.
#[inline(always)]
pub const fn ordered(bits: u32) -> u32 {
    bits ^ ((bits.cast_signed() >> 31).cast_unsigned() | SIGN)
}

/// The bits that [`ordered`] changed to these.
#[inline(always)]
pub const fn unordered(code: u32) -> u32 {
    code ^ ((!code.cast_signed() >> 31).cast_unsigned() | SIGN)
}

/// The sign of a binary32 number.
const SIGN: u32 = 1 << 31;

impl DepthEncoding {
    /// The encoding of a depth format.
    pub fn of(format: Format) -> Self {
        match format {
            Format::D16Unorm => Self::Unorm(16),
            Format::X8D24UnormPack32 => Self::Unorm(24),
            _ => Self::Float,
        }
    }

    /// Encodes depths, clamped to `range`. NaN becomes the least depth, as in [`clamp`](super::unorm8::clamp).
    #[inline(always)]
    pub fn encode<S: Simd>(self, simd: S, depth: f32x16<S>, range: (f32, f32)) -> u32x16<S> {
        let (low, high) = (f32x16::splat(simd, range.0), f32x16::splat(simd, range.1));
        let depth = depth.max(low).min(high);
        match self {
            Self::Float => {
                // Negative zero becomes zero.
                let bits: i32x16<S> = (depth + 0.0).bitcast();
                let changed = (bits >> 31) | i32x16::splat(simd, SIGN.cast_signed());
                (bits ^ changed).bitcast()
            }
            Self::Unorm(bits) => {
                let scaled = depth * (1u32 << bits) as f32;
                // (2^n - 1) d = 2^n d - d. The first term is exact, so that its nearest integer is the result or one
                // more.
                let nearest = float::round_ties_even(scaled);
                let excess = (scaled - nearest + 0.5) - depth;
                let one = excess.simd_lt(0.0).select(f32x16::splat(simd, 1.0), f32x16::splat(simd, 0.0));
                (nearest - one).to_int::<u32x16<S>>()
            }
        }
    }

    /// The depth of a code.
    pub fn decode(self, code: u32) -> f32 {
        match self {
            Self::Float => f32::from_bits(unordered(code)),
            Self::Unorm(bits) => (f64::from(code) / f64::from((1u32 << bits) - 1)) as f32,
        }
    }

    /// Encodes one depth, clamped to 0 to 1 if the encoding is normalised.
    #[inline(always)]
    pub fn encode_one(self, depth: f32) -> u32 {
        match self {
            // Negative zero becomes zero.
            Self::Float => ordered((depth + 0.0).to_bits()),
            Self::Unorm(bits) => {
                let depth = if depth > 0.0 { depth.min(1.0) } else { 0.0 };
                let max = f64::from((1u32 << bits) - 1);
                libm::rint(f64::from(depth) * max) as u32
            }
        }
    }
}
