//! Coordinates along one axis: from what a program gives to texel indices. Lane by lane; [`super::batch`] does the same,
//! bit for bit, for 16 lanes.
//!
//! Vulkan 1.3, "Wrapping Operation" and "(u,v,w,a) to (i,j,k,l,n) Transformation". Periodic coordinates are reduced to
//! one period before they are scaled to texels, which is exact and keeps large ones as precise as they can be.

use super::sampler::{AddressMode, Filter};

/// Floats from here on are integers: coordinates are whole periods.
pub(super) const WHOLE: f32 = 8_388_608.0;

/// Texel coordinates are clamped to this magnitude. Beyond any image, and an offset added to it is still exact.
pub(super) const FAR: f32 = 4_194_304.0;

/// Texel offsets are clamped to this magnitude.
pub(super) const MAX_OFFSET: i32 = 1 << 16;

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
