//! The encodings of depth attachments: depths as numbers that compare as the depths do.

use crate::format::Format;
use crate::simd::bits_of;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, u32x16};

/// How depths become numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthEncoding {
    /// A normalised integer of this many bits.
    Unorm(u32),
    /// binary32.
    Float,
}

impl DepthEncoding {
    /// Of a depth format.
    pub fn of(format: Format) -> Self {
        match format {
            Format::D16Unorm => Self::Unorm(16),
            Format::X8D24UnormPack32 => Self::Unorm(24),
            _ => Self::Float,
        }
    }

    /// The numbers of depths, clamped to `range`; NaN becomes the least.
    #[inline(always)]
    pub fn encode<S: Simd>(self, simd: S, depth: f32x16<S>, range: (f32, f32)) -> u32x16<S> {
        let (low, high) = (f32x16::splat(simd, range.0), f32x16::splat(simd, range.1));
        let depth = depth.max_precise(low).min(high);
        match self {
            // Negative zero becomes zero.
            Self::Float => bits_of(depth + 0.0),
            Self::Unorm(bits) => {
                let scaled = depth * (1u32 << bits) as f32;
                // (2^n - 1) d = 2^n d - d: the first is exact, so the nearest integer to it is the result or one more.
                let nearest = scaled.round_ties_even();
                let excess = (scaled - nearest + 0.5) - depth;
                let one = excess
                    .simd_lt(0.0)
                    .select(f32x16::splat(simd, 1.0), f32x16::splat(simd, 0.0));
                (nearest - one).to_int::<u32x16<S>>()
            }
        }
    }

    /// The depth that a number means.
    pub fn decode(self, code: u32) -> f32 {
        match self {
            Self::Float => f32::from_bits(code),
            Self::Unorm(bits) => (f64::from(code) / f64::from((1u32 << bits) - 1)) as f32,
        }
    }

    /// As [`DepthEncoding::encode`], of one depth.
    pub fn encode_one(self, depth: f32) -> u32 {
        let depth = if depth > 0.0 { depth.min(1.0) } else { 0.0 };
        match self {
            Self::Float => depth.to_bits(),
            Self::Unorm(bits) => {
                let max = f64::from((1u32 << bits) - 1);
                (f64::from(depth) * max).round_ties_even() as u32
            }
        }
    }
}
