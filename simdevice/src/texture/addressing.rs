//! Addressing along one axis: converts a program's coordinates to texel indices, lane by lane or 16 lanes at once, with
//! the same bits.
//!
//! Vulkan 1.3, "Wrapping Operation" and "(u,v,w,a) to (i,j,k,l,n) Transformation". Periodic coordinates are reduced to
//! one period before they are scaled to texels. That is exact, and large coordinates lose no further precision.

use super::sampler::{AddressMode, Filter};
use super::texels::Floats;
use fearless_simd::{Simd, f32x16, i32x16, mask32x16, prelude::*, u32x16};
use isa::float;
use isa::ir::VECTOR_LANES;
use isa::resources::LaneWords;

/// The magnitude from which on floats are integers, so that coordinates are whole periods.
const WHOLE: f32 = 8_388_608.0;

/// The magnitude to which texel coordinates are clamped. It is beyond any image, and adding an offset to it is exact.
const FAR: f32 = 4_194_304.0;

/// The magnitude to which texel offsets are clamped.
const MAX_OFFSET: i32 = 1 << 16;

/// The texels of a coordinate along one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Taps {
    /// The indices of both texels; `None` outside the image. Nearest filtering uses only the first.
    pub index: [Option<u32>; 2],
    /// The weight of the second texel.
    pub weight: f32,
}

impl Taps {
    /// The taps of an axis that the image does not have.
    pub const FLAT: Self = Self { index: [Some(0); 2], weight: 0.0 };

    /// The texels of coordinate `s` of an axis of `size` texels.
    pub fn new(mode: AddressMode, filter: Filter, s: f32, normalized: bool, size: u32, offset: i32) -> Self {
        let offset = offset.clamp(-MAX_OFFSET, MAX_OFFSET);
        let (first, weight) = first_texel(filter, texel_coordinate(mode, s, normalized, size));
        let index = [0, 1].map(|step| wrap(mode, first + offset + step, size));
        Self { index, weight }
    }
}

/// The coordinate in texels, clamped to [`FAR`] or, for periodic modes, reduced to one period. NaN counts as 0.
pub(super) fn texel_coordinate(mode: AddressMode, s: f32, normalized: bool, size: u32) -> f32 {
    let s = if s.is_nan() { 0.0 } else { s };
    let size = size as f32;
    match mode {
        _ if !normalized => s.clamp(-FAR, FAR),
        AddressMode::Repeat => {
            let s = s.clamp(-WHOLE, WHOLE);
            (s - libm::floorf(s)) * size
        }
        AddressMode::MirroredRepeat => {
            let half = s.clamp(-WHOLE, WHOLE) * 0.5;
            (half - libm::floorf(half)) * 2.0 * size
        }
        _ => (s * size).clamp(-FAR, FAR),
    }
}

/// The first texel of a filter, before wrapping, and the weight of the next texel.
pub(super) fn first_texel(filter: Filter, u: f32) -> (i32, f32) {
    match filter {
        Filter::Nearest => (libm::floorf(u) as i32, 0.0),
        Filter::Linear => {
            let shifted = u - 0.5;
            let first = libm::floorf(shifted);
            (first as i32, shifted - first)
        }
    }
}

/// The wrapped index; `None` for the border.
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

/// The array layer of a coordinate: rounded to nearest, ties to even, and clamped. NaN counts as 0.
#[inline(always)]
pub(super) fn layer(coordinate: f32, layers: u32) -> u32 {
    (libm::rintf(coordinate) as u32).min(layers.saturating_sub(1))
}

/// The texels of 16 coordinates along one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axis {
    /// The indices, clamped to the image. Nearest filtering uses only the first.
    pub index: [LaneWords; 2],
    /// The lanes whose texel is not the border, for each of both texels.
    pub inside: [u16; 2],
    /// The weight of the second texel.
    pub weight: Floats,
    /// True if the texel of any lane is the border.
    pub has_outside: bool,
}

impl Axis {
    /// The axis of coordinates that the image does not have.
    pub const FLAT: Self =
        Self { index: [[0; VECTOR_LANES]; 2], inside: [u16::MAX; 2], weight: [0.0; VECTOR_LANES], has_outside: false };
}

/// The texels along an axis of `size` texels, given the bits of `coordinate`. The kernel is compiled on its own.
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
    let coordinate = u32x16::simd_from(simd, *coordinate).bitcast();
    let u = texel_coordinates(simd, mode, normalized, coordinate, size);
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
        [lanes_within(simd, first, size), lanes_within(simd, second, size)]
    } else {
        [u16::MAX; 2]
    };
    Axis {
        index: [wrap_lanes(simd, mode, first, size, far).into(), wrap_lanes(simd, mode, second, size, far).into()],
        inside,
        weight: weight.into(),
        has_outside: inside != [u16::MAX; 2],
    }
}

/// The texels of 16 coordinates along one axis for linear filters, as vectors, without borders or offsets.
#[derive(Clone, Copy)]
pub(super) struct VectorTaps<S: Simd> {
    pub first: u32x16<S>,
    pub second: u32x16<S>,
    /// The weight of the second texel.
    pub weight: f32x16<S>,
}

/// The results of [`axis`], for normalized coordinates and a linear filter.
#[inline(always)]
pub(super) fn taps<S: Simd>(simd: S, mode: AddressMode, coordinate: f32x16<S>, size: f32x16<S>) -> VectorTaps<S> {
    let shifted = texel_coordinates(simd, mode, true, coordinate, size) - 0.5;
    let whole = floor_lanes(simd, shifted);
    let (next, weight) = (whole + 1.0, shifted - whole);
    if mode == AddressMode::Repeat {
        // Within a period only the first can be before it, by one texel, and only the second after it.
        let zero = f32x16::splat(simd, 0.0);
        let first = i32x16::truncate_from(whole.simd_lt(zero).select(size - 1.0, whole)).bitcast();
        let second = i32x16::truncate_from(next.simd_ge(size).select(zero, next)).bitcast();
        return VectorTaps { first, second, weight };
    }
    let (first, second) = (wrap_lanes(simd, mode, whole, size, false), wrap_lanes(simd, mode, next, size, false));
    VectorTaps { first, second, weight }
}

/// The results of [`texel_coordinate`] for 16 lanes.
#[inline(always)]
fn texel_coordinates<S: Simd>(
    simd: S,
    mode: AddressMode,
    normalized: bool,
    s: f32x16<S>,
    size: f32x16<S>,
) -> f32x16<S> {
    let zero = f32x16::splat(simd, 0.0);
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

/// The results of [`wrap`] for 16 lanes. Indices of the border are clamped.
#[inline(always)]
fn wrap_lanes<S: Simd>(simd: S, mode: AddressMode, i: f32x16<S>, size: f32x16<S>, far: bool) -> u32x16<S> {
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

/// The index reduced to `0..period`. Unless `far`, it must be at most a period outside of that range.
#[inline(always)]
fn reduce_lanes<S: Simd>(simd: S, i: f32x16<S>, period: f32x16<S>, far: bool) -> f32x16<S> {
    let zero = f32x16::splat(simd, 0.0);
    let i = if far { i - floor_lanes(simd, i / period) * period } else { i };
    let i = i + i.simd_lt(zero).select(period, zero);
    i - i.simd_ge(period).select(period, zero)
}

/// The lanes whose index is in an image of `size` texels.
#[inline(always)]
fn lanes_within<S: Simd>(simd: S, i: f32x16<S>, size: f32x16<S>) -> u16 {
    let inside: mask32x16<S> = i.simd_ge(f32x16::splat(simd, 0.0)) & i.simd_lt(size);
    inside.to_bitmask() as u16
}

/// The greatest integers that are not greater, for numbers within 2^30.
#[inline(always)]
fn floor_lanes<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    if float::has_instructions(simd) {
        return float::floor(x);
    }
    let truncated = f32x16::float_from(i32x16::truncate_from(x));
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    truncated - truncated.simd_gt(x).select(one, zero)
}

/// The lanes of `x`, clamped to a magnitude.
#[inline(always)]
fn clamp_lanes<S: Simd>(x: f32x16<S>, magnitude: f32) -> f32x16<S> {
    x.max(-magnitude).min(magnitude)
}
