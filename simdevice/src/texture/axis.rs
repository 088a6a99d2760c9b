//! Coordinates along one axis, 16 lanes at once: as [`super::address`], bit for bit.

use fearless_simd::{Simd, f32x16, i32x16, mask32x16, prelude::*, u32x16};

use super::address::{FAR, MAX_OFFSET, WHOLE};
use super::sampler::{AddressMode, Filter};
use crate::texture::packing::Floats;
use isa::ir::CHUNK_LANES;
use isa::resources::Lanes;

/// The texels of 16 coordinates along one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axis {
    /// Indices within the image. Nearest filtering uses the first only.
    pub index: [Lanes; 2],
    /// Lanes whose texel isn't the border.
    pub inside: [u16; 2],
    /// Weight of the second.
    pub weight: Floats,
    /// Whether any lane's texel is the border.
    pub has_outside: bool,
}

impl Axis {
    /// An axis that the image doesn't have.
    pub const FLAT: Self = Self {
        index: [[0; CHUNK_LANES]; 2],
        inside: [u16::MAX; 2],
        weight: [0.0; CHUNK_LANES],
        has_outside: false,
    };
}

/// The texels of `coordinate`, whose bits these are, along an axis of `size` texels. Compiled on its own.
#[inline(always)]
pub(super) fn axis<S: Simd>(
    simd: S,
    mode: AddressMode,
    filter: Filter,
    normalized: bool,
    coordinate: &Lanes,
    size: &Lanes,
    offset: &Lanes,
) -> Axis {
    simd.vectorize(
        #[inline(always)]
        || vector_axis(simd, mode, filter, normalized, coordinate, size, offset),
    )
}

#[inline(always)]
fn vector_axis<S: Simd>(
    simd: S,
    mode: AddressMode,
    filter: Filter,
    normalized: bool,
    coordinate: &Lanes,
    size: &Lanes,
    offset: &Lanes,
) -> Axis {
    let size = u32x16::simd_from(simd, *size).bitcast::<i32x16<S>>();
    let size = f32x16::float_from(size);
    let u = texel_coordinate(simd, mode, normalized, *coordinate, size);
    let shifted = match filter {
        Filter::Nearest => u,
        Filter::Linear => u - 0.5,
    };
    let whole = floor(simd, shifted);
    let weight = shifted - whole;
    let offset = u32x16::simd_from(simd, *offset).bitcast::<i32x16<S>>();
    let offset = f32x16::float_from(offset.max(-MAX_OFFSET).min(MAX_OFFSET));
    let far = !normalized || offset.simd_eq(0.0).to_bitmask() != u64::from(u16::MAX);
    let first = whole + offset;
    let second = first + 1.0;
    let inside = if mode == AddressMode::ClampToBorder {
        [within(simd, first, size), within(simd, second, size)]
    } else {
        [u16::MAX; 2]
    };
    Axis {
        index: [
            wrap(simd, mode, first, size, far).into(),
            wrap(simd, mode, second, size, far).into(),
        ],
        inside,
        weight: weight.into(),
        has_outside: inside != [u16::MAX; 2],
    }
}

/// The texels of 16 coordinates along one axis for linear filters, in vectors: without borders or offsets.
#[derive(Clone, Copy)]
pub(super) struct Taps<S: Simd> {
    pub first: u32x16<S>,
    pub second: u32x16<S>,
    /// Weight of the second.
    pub weight: f32x16<S>,
}

/// As [`axis`], for normalized coordinates and a linear filter.
#[inline(always)]
pub(super) fn taps<S: Simd>(
    simd: S,
    mode: AddressMode,
    coordinate: &Lanes,
    size: f32x16<S>,
) -> Taps<S> {
    let shifted = texel_coordinate(simd, mode, true, *coordinate, size) - 0.5;
    let whole = floor(simd, shifted);
    Taps {
        first: wrap(simd, mode, whole, size, false),
        second: wrap(simd, mode, whole + 1.0, size, false),
        weight: shifted - whole,
    }
}

/// As [`super::address::texel_coordinate`].
#[inline(always)]
fn texel_coordinate<S: Simd>(
    simd: S,
    mode: AddressMode,
    normalized: bool,
    coordinate: Lanes,
    size: f32x16<S>,
) -> f32x16<S> {
    let zero = f32x16::splat(simd, 0.0);
    let s: f32x16<S> = u32x16::simd_from(simd, coordinate).bitcast();
    let s = s.simd_eq(s).select(s, zero);
    match mode {
        _ if !normalized => clamp(s, FAR),
        AddressMode::Repeat => {
            let s = clamp(s, WHOLE);
            (s - floor(simd, s)) * size
        }
        AddressMode::MirroredRepeat => {
            let half = clamp(s, WHOLE) * 0.5;
            (half - floor(simd, half)) * 2.0 * size
        }
        _ => clamp(s * size, FAR),
    }
}

/// As [`super::address::wrap`]; the border's indices are clamped.
#[inline(always)]
fn wrap<S: Simd>(
    simd: S,
    mode: AddressMode,
    i: f32x16<S>,
    size: f32x16<S>,
    far: bool,
) -> u32x16<S> {
    let zero = f32x16::splat(simd, 0.0);
    let wrapped = match mode {
        AddressMode::Repeat => reduce(simd, i, size, far),
        AddressMode::MirroredRepeat => {
            let period = size + size;
            let within = reduce(simd, i, period, far);
            within.min(period - 1.0 - within)
        }
        AddressMode::ClampToEdge | AddressMode::ClampToBorder => i,
        AddressMode::MirrorClampToEdge => i.simd_lt(zero).select(zero - 1.0 - i, i),
    };
    i32x16::truncate_from(wrapped.max(zero).min(size - 1.0)).bitcast()
}

/// An index reduced to 0.. of a period; if it isn't `far`, it is known to be within a period of that.
#[inline(always)]
fn reduce<S: Simd>(simd: S, i: f32x16<S>, period: f32x16<S>, far: bool) -> f32x16<S> {
    let zero = f32x16::splat(simd, 0.0);
    let i = if far {
        i - floor(simd, i / period) * period
    } else {
        i
    };
    let i = i + i.simd_lt(zero).select(period, zero);
    i - i.simd_ge(period).select(period, zero)
}

/// The lanes whose index an image of `size` texels has.
#[inline(always)]
fn within<S: Simd>(simd: S, i: f32x16<S>, size: f32x16<S>) -> u16 {
    let inside: mask32x16<S> = i.simd_ge(f32x16::splat(simd, 0.0)) & i.simd_lt(size);
    inside.to_bitmask() as u16
}

/// The greatest integers that aren't greater; of numbers within 2^30.
#[inline(always)]
fn floor<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    let truncated = f32x16::float_from(i32x16::truncate_from(x));
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    truncated - truncated.simd_gt(x).select(one, zero)
}

/// `x` within a magnitude.
#[inline(always)]
fn clamp<S: Simd>(x: f32x16<S>, magnitude: f32) -> f32x16<S> {
    x.max(-magnitude).min(magnitude)
}
