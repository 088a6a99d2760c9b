//! Coordinates along one axis: from what a program gives to texel indices, lane by lane or, with the same bits, 16 lanes at
//! once.
//!
//! Vulkan 1.3, "Wrapping Operation" and "(u,v,w,a) to (i,j,k,l,n) Transformation". Periodic coordinates are reduced to
//! one period before they are scaled to texels, which is exact and keeps large ones as precise as they can be.

use super::sampler::{AddressMode, Filter};
use super::texels::Floats;
use fearless_simd::{Simd, f32x16, i32x16, mask32x16, prelude::*, u32x16};
use isa::ir::VECTOR_LANES;
use isa::resources::LaneWords;

/// Floats from here on are integers: coordinates are whole periods.
const WHOLE: f32 = 8_388_608.0;

/// Texel coordinates are clamped to this magnitude. Beyond any image, and an offset added to it is still exact.
const FAR: f32 = 4_194_304.0;

/// Texel offsets are clamped to this magnitude.
const MAX_OFFSET: i32 = 1 << 16;

/// The texels that a coordinate means along one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Taps {
    /// Indices; None outside the image. Nearest filtering uses the first only.
    pub index: [Option<u32>; 2],
    /// Weight of the second.
    pub weight: f32,
}

impl Taps {
    /// The only texel of an axis that the image doesn't have.
    pub const FLAT: Self = Self {
        index: [Some(0); 2],
        weight: 0.0,
    };

    /// The texels of coordinate `s` of an axis of `size` texels.
    pub fn new(
        mode: AddressMode,
        filter: Filter,
        s: f32,
        normalized: bool,
        size: u32,
        offset: i32,
    ) -> Self {
        let offset = offset.clamp(-MAX_OFFSET, MAX_OFFSET);
        let (first, weight) = first_texel(filter, texel_coordinate(mode, s, normalized, size));
        let index = [0, 1].map(|step| wrap(mode, first + offset + step, size));
        Self { index, weight }
    }
}

/// The coordinate in texels, within [`FAR`]; NaN counts as 0.
pub(super) fn texel_coordinate(mode: AddressMode, s: f32, normalized: bool, size: u32) -> f32 {
    let s = if s.is_nan() { 0.0 } else { s };
    let size = size as f32;
    match mode {
        _ if !normalized => s.clamp(-FAR, FAR),
        AddressMode::Repeat => {
            let s = s.clamp(-WHOLE, WHOLE);
            (s - s.floor()) * size
        }
        AddressMode::MirroredRepeat => {
            let half = s.clamp(-WHOLE, WHOLE) * 0.5;
            (half - half.floor()) * 2.0 * size
        }
        _ => (s * size).clamp(-FAR, FAR),
    }
}

/// The first texel that a filter takes, before wrapping, and the weight of the next.
pub(super) fn first_texel(filter: Filter, u: f32) -> (i32, f32) {
    match filter {
        Filter::Nearest => (u.floor() as i32, 0.0),
        Filter::Linear => {
            let shifted = u - 0.5;
            let first = shifted.floor();
            (first as i32, shifted - first)
        }
    }
}

/// An index within the image; None is the border.
pub(super) fn wrap(mode: AddressMode, i: i32, size: u32) -> Option<u32> {
    let size = i64::from(size);
    let i = i64::from(i);
    let last = size - 1;
    let wrapped = match mode {
        AddressMode::Repeat => i.rem_euclid(size),
        AddressMode::MirroredRepeat => {
            let within = i.rem_euclid(2 * size);
            within.min(2 * size - 1 - within)
        }
        AddressMode::ClampToEdge => i.clamp(0, last),
        AddressMode::ClampToBorder => i,
        AddressMode::MirrorClampToEdge => (if i < 0 { -1 - i } else { i }).min(last),
    };
    (0..size).contains(&wrapped).then_some(wrapped as u32)
}

/// The array layer of a coordinate: to nearest, ties to even, clamped. NaN counts as 0.
#[inline(always)]
pub(super) fn layer(coordinate: f32, layers: u32) -> u32 {
    (coordinate.round_ties_even() as u32).min(layers.saturating_sub(1))
}

/// The texels of 16 coordinates along one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axis {
    /// Indices within the image. Nearest filtering uses the first only.
    pub index: [LaneWords; 2],
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
        index: [[0; VECTOR_LANES]; 2],
        inside: [u16::MAX; 2],
        weight: [0.0; VECTOR_LANES],
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
    coordinate: &LaneWords,
    size: &LaneWords,
    offset: &LaneWords,
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
    coordinate: &LaneWords,
    size: &LaneWords,
    offset: &LaneWords,
) -> Axis {
    let size = u32x16::simd_from(simd, *size).bitcast::<i32x16<S>>();
    let size = f32x16::float_from(size);
    let u = texel_coordinates(simd, mode, normalized, *coordinate, size);
    let shifted = match filter {
        Filter::Nearest => u,
        Filter::Linear => u - 0.5,
    };
    let whole = floor_lanes(simd, shifted);
    let weight = shifted - whole;
    let offset = u32x16::simd_from(simd, *offset).bitcast::<i32x16<S>>();
    let offset = f32x16::float_from(offset.max(-MAX_OFFSET).min(MAX_OFFSET));
    let far = !normalized || offset.simd_eq(0.0).to_bitmask() != u64::from(u16::MAX);
    let first = whole + offset;
    let second = first + 1.0;
    let inside = if mode == AddressMode::ClampToBorder {
        [
            lanes_within(simd, first, size),
            lanes_within(simd, second, size),
        ]
    } else {
        [u16::MAX; 2]
    };
    Axis {
        index: [
            wrap_lanes(simd, mode, first, size, far).into(),
            wrap_lanes(simd, mode, second, size, far).into(),
        ],
        inside,
        weight: weight.into(),
        has_outside: inside != [u16::MAX; 2],
    }
}

/// The texels of 16 coordinates along one axis for linear filters, in vectors: without borders or offsets.
#[derive(Clone, Copy)]
pub(super) struct VectorTaps<S: Simd> {
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
    coordinate: &LaneWords,
    size: f32x16<S>,
) -> VectorTaps<S> {
    let shifted = texel_coordinates(simd, mode, true, *coordinate, size) - 0.5;
    let whole = floor_lanes(simd, shifted);
    VectorTaps {
        first: wrap_lanes(simd, mode, whole, size, false),
        second: wrap_lanes(simd, mode, whole + 1.0, size, false),
        weight: shifted - whole,
    }
}

/// As [`texel_coordinate`].
#[inline(always)]
fn texel_coordinates<S: Simd>(
    simd: S,
    mode: AddressMode,
    normalized: bool,
    coordinate: LaneWords,
    size: f32x16<S>,
) -> f32x16<S> {
    let zero = f32x16::splat(simd, 0.0);
    let s: f32x16<S> = u32x16::simd_from(simd, coordinate).bitcast();
    let s = s.simd_eq(s).select(s, zero);
    match mode {
        _ if !normalized => clamp_lanes(s, FAR),
        AddressMode::Repeat => {
            let s = clamp_lanes(s, WHOLE);
            (s - floor_lanes(simd, s)) * size
        }
        AddressMode::MirroredRepeat => {
            let half = clamp_lanes(s, WHOLE) * 0.5;
            (half - floor_lanes(simd, half)) * 2.0 * size
        }
        _ => clamp_lanes(s * size, FAR),
    }
}

/// As [`wrap`]; the border's indices are clamped.
#[inline(always)]
fn wrap_lanes<S: Simd>(
    simd: S,
    mode: AddressMode,
    i: f32x16<S>,
    size: f32x16<S>,
    far: bool,
) -> u32x16<S> {
    let zero = f32x16::splat(simd, 0.0);
    let wrapped = match mode {
        AddressMode::Repeat => reduce_lanes(simd, i, size, far),
        AddressMode::MirroredRepeat => {
            let period = size + size;
            let within = reduce_lanes(simd, i, period, far);
            within.min(period - 1.0 - within)
        }
        AddressMode::ClampToEdge | AddressMode::ClampToBorder => i,
        AddressMode::MirrorClampToEdge => i.simd_lt(zero).select(zero - 1.0 - i, i),
    };
    i32x16::truncate_from(wrapped.max(zero).min(size - 1.0)).bitcast()
}

/// An index reduced to 0.. of a period; if it isn't `far`, it is known to be within a period of that.
#[inline(always)]
fn reduce_lanes<S: Simd>(simd: S, i: f32x16<S>, period: f32x16<S>, far: bool) -> f32x16<S> {
    let zero = f32x16::splat(simd, 0.0);
    let i = if far {
        i - floor_lanes(simd, i / period) * period
    } else {
        i
    };
    let i = i + i.simd_lt(zero).select(period, zero);
    i - i.simd_ge(period).select(period, zero)
}

/// The lanes whose index an image of `size` texels has.
#[inline(always)]
fn lanes_within<S: Simd>(simd: S, i: f32x16<S>, size: f32x16<S>) -> u16 {
    let inside: mask32x16<S> = i.simd_ge(f32x16::splat(simd, 0.0)) & i.simd_lt(size);
    inside.to_bitmask() as u16
}

/// The greatest integers that aren't greater; of numbers within 2^30.
#[inline(always)]
fn floor_lanes<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    let truncated = f32x16::float_from(i32x16::truncate_from(x));
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    truncated - truncated.simd_gt(x).select(one, zero)
}

/// `x` within a magnitude.
#[inline(always)]
fn clamp_lanes<S: Simd>(x: f32x16<S>, magnitude: f32) -> f32x16<S> {
    x.max(-magnitude).min(magnitude)
}
