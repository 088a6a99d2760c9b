//! Levels of detail: selects the mip levels to read from derivatives.
//!
//! Vulkan 1.3, "Scale Factor Operation", "LOD Operation" and "Image Level(s) Selection". The code has simple loops over
//! 16 lanes or four quads, without fused operations, so that every SIMD level selects the same levels.

use super::cube::Hit;
use super::sampler::{Filter, MipmapMode, Sampler};
use super::surface::Surface;
use crate::limits::MAX_LOD_BIAS;
use crate::texture::texels::Floats;
use isa::ir::{Dimension, VECTOR_LANES};
use isa::resources::{LaneWords, LodRequest, SampleRequest};

/// The number of quads of 16 lanes.
pub(super) const QUADS: usize = VECTOR_LANES / 4;

/// The mip levels of four quads, with the fields of [`Selection`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct QuadSelection {
    pub high: [u32; QUADS],
    pub low: [u32; QUADS],
    pub weight: [f32; QUADS],
}

/// The result of [`select`] for requests of [`LodRequest::Automatic`] for images other than cubes, with one filter.
#[inline(always)]
pub(super) fn select_quads(surface: &Surface, sampler: &Sampler, request: &SampleRequest) -> QuadSelection {
    let mut selection = QuadSelection { high: [0; QUADS], low: [0; QUADS], weight: [0.0; QUADS] };
    let last = surface.levels.len() as u32 - 1;
    if last == 0 {
        return selection;
    }
    let bias = sampler.mip_lod_bias.clamp(-MAX_LOD_BIAS, MAX_LOD_BIAS);
    let least = sampler.min_lod.max(0.0);
    let linear = sampler.mipmap_mode == MipmapMode::Linear && !surface.is_integer();
    for (quad, lod) in of_quads(surface, request).into_iter().enumerate() {
        let lambda = (lod + bias).max(least).min(sampler.max_lod);
        let level = lambda.clamp(0.0, last as f32);
        let whole = level as i32;
        let fraction = level - whole as f32;
        let up = i32::from(!linear && fraction > 0.5);
        selection.high[quad] = (whole + up) as u32;
        selection.low[quad] = (whole + 1).min(last as i32) as u32;
        selection.weight[quad] = if linear { fraction } else { 0.0 };
    }
    selection
}

/// The mip levels of 16 lanes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Selection {
    /// The level, or the larger image of two levels.
    pub high: [u32; VECTOR_LANES],
    /// The smaller image of two levels.
    pub low: [u32; VECTOR_LANES],
    /// The weight of `low`. If it is zero, `low` is not read.
    pub weight: Floats,
    /// The filter within levels.
    pub filter: [Filter; VECTOR_LANES],
}

impl Selection {
    /// The first level for all lanes.
    fn base(filter: Filter) -> Self {
        Self {
            high: [0; VECTOR_LANES],
            low: [0; VECTOR_LANES],
            weight: [0.0; VECTOR_LANES],
            filter: [filter; VECTOR_LANES],
        }
    }
}

/// The filter that a sampler requests, or the nearest one for integers, which cannot be averaged.
fn possible(surface: &Surface, filter: Filter) -> Filter {
    if surface.is_integer() { Filter::Nearest } else { filter }
}

/// The mip levels and filters for a request.
#[inline(always)]
pub(super) fn select(surface: &Surface, sampler: &Sampler, request: &SampleRequest) -> Selection {
    let magnify = possible(surface, sampler.mag_filter);
    let minify = possible(surface, sampler.min_filter);
    let last = surface.levels.len() as u32 - 1;
    if sampler.unnormalized_coordinates || last == 0 && magnify == minify {
        return Selection::base(magnify);
    }
    let lambda = clamped(sampler, request, &biased(surface, sampler, request));
    let mut selection = Selection::base(magnify);
    // Integers are not averaged between levels either.
    let linear = sampler.mipmap_mode == MipmapMode::Linear && !surface.is_integer();
    for (lane, lambda) in lambda.iter().enumerate() {
        let level = lambda.clamp(0.0, last as f32);
        let whole = level as i32;
        let fraction = level - whole as f32;
        let up = i32::from(!linear && fraction > 0.5);
        selection.high[lane] = (whole + up) as u32;
        selection.low[lane] = (whole + 1).min(last as i32) as u32;
        selection.weight[lane] = if linear { fraction } else { 0.0 };
    }
    if magnify != minify {
        for (filter, lambda) in selection.filter.iter_mut().zip(lambda) {
            if lambda > 0.0 {
                *filter = minify;
            }
        }
    }
    selection
}

/// The results of a query: the level that would be read, relative to the view's first, and the level of detail before
/// it is clamped.
pub(super) fn query(surface: &Surface, sampler: &Sampler, request: &SampleRequest) -> [LaneWords; 2] {
    let biased = biased(surface, sampler, request);
    let last = surface.levels.len() as f32 - 1.0;
    let level = clamped(sampler, request, &biased).map(|lambda| {
        let level = lambda.clamp(0.0, last);
        if sampler.mipmap_mode == MipmapMode::Linear { level } else { nearest_level(level) as f32 }
    });
    [level, biased].map(|lanes| lanes.map(f32::to_bits))
}

/// The level nearest to `level`, which must not be negative. In a tie it is the larger image.
#[inline(always)]
fn nearest_level(level: f32) -> u32 {
    let whole = level as u32;
    whole + u32::from(level - whole as f32 > 0.5)
}

/// The level of detail with its bias.
#[inline(always)]
fn biased(surface: &Surface, sampler: &Sampler, request: &SampleRequest) -> Floats {
    let base: Floats = match &request.lod {
        LodRequest::Explicit(lod) => lod.map(f32::from_bits),
        LodRequest::Automatic | LodRequest::Implicit { .. } => implicit(surface, request),
        LodRequest::Gradient { dx, dy, .. } => std::array::from_fn(|lane| {
            let along = |d: &[LaneWords; 3]| d.map(|lanes| f32::from_bits(lanes[lane]));
            let (x, y) = (along(dx), along(dy));
            scale_lod(surface, request, lane, x, y)
        }),
    };
    let mut biased = base;
    let operand = match &request.lod {
        LodRequest::Implicit { bias, .. } => bias,
        _ => &[0; VECTOR_LANES],
    };
    for (lod, operand) in biased.iter_mut().zip(operand) {
        let bias = sampler.mip_lod_bias + f32::from_bits(*operand);
        *lod += bias.clamp(-MAX_LOD_BIAS, MAX_LOD_BIAS);
    }
    biased
}

/// The level of detail, clamped to the limits of the sampler and the instruction. NaN becomes the minimum.
#[inline(always)]
fn clamped(sampler: &Sampler, request: &SampleRequest, biased: &Floats) -> Floats {
    let minimum = match &request.lod {
        LodRequest::Implicit { minimum, .. } | LodRequest::Gradient { minimum, .. } => minimum,
        LodRequest::Automatic => &[0; VECTOR_LANES],
        LodRequest::Explicit(_) => &[f32::NEG_INFINITY.to_bits(); VECTOR_LANES],
    };
    let mut clamped = *biased;
    for (lod, minimum) in clamped.iter_mut().zip(minimum) {
        let least = sampler.min_lod.max(f32::from_bits(*minimum));
        *lod = lod.max(least).min(sampler.max_lod);
    }
    clamped
}

/// The level of detail from the differences in quads: from the first lane to its right and lower neighbours.
#[inline(always)]
fn implicit(surface: &Surface, request: &SampleRequest) -> Floats {
    let value = |axis: usize, lane: usize| f32::from_bits(request.coordinate[axis][lane]);
    if request.shape.dimension == Dimension::Cube {
        return std::array::from_fn(|lane| {
            let first = lane & !3;
            let dx = [0, 1, 2].map(|axis| value(axis, first + 1) - value(axis, first));
            let dy = [0, 1, 2].map(|axis| value(axis, first + 2) - value(axis, first));
            scale_lod(surface, request, lane, dx, dy)
        });
    }
    let mut lods = [0.0; VECTOR_LANES];
    let quads = of_quads(surface, request);
    for (lods, quad) in lods.chunks_exact_mut(4).zip(quads) {
        lods.fill(quad);
    }
    lods
}

/// The result of [`implicit`], one number for each quad, for images other than cubes.
#[inline(always)]
fn of_quads(surface: &Surface, request: &SampleRequest) -> [f32; QUADS] {
    let value = |axis: usize, lane: usize| f32::from_bits(request.coordinate[axis][lane]);
    let mut right = [0.0; QUADS];
    let mut below = right;
    for axis in 0..request.shape.dimension.coordinates() {
        let size = surface.levels[0].extent[axis] as f32;
        for (quad, (right, below)) in right.iter_mut().zip(&mut below).enumerate() {
            let first = value(axis, 4 * quad);
            let to_right = (value(axis, 4 * quad + 1) - first) * size;
            let to_below = (value(axis, 4 * quad + 2) - first) * size;
            *right += to_right * to_right;
            *below += to_below * to_below;
        }
    }
    let mut lods = [0.0; QUADS];
    for quad in 0..QUADS {
        lods[quad] = half_log2(right[quad].max(below[quad]));
    }
    lods
}

/// The level of detail for given derivatives of the coordinates.
fn scale_lod(surface: &Surface, request: &SampleRequest, lane: usize, dx: [f32; 3], dy: [f32; 3]) -> f32 {
    let extent = surface.levels[0].extent;
    let dimension = request.shape.dimension;
    let (dx, dy, axes) = if dimension == Dimension::Cube {
        let direction = [0, 1, 2].map(|axis| f32::from_bits(request.coordinate[axis][lane]));
        let hit = Hit::new(direction);
        let on_face = |change| {
            let [s, t] = hit.derivative(change);
            [s, t, 0.0]
        };
        (on_face(dx), on_face(dy), 2)
    } else {
        (dx, dy, dimension.coordinates())
    };
    let along = |change: [f32; 3]| {
        let mut squares = 0.0;
        for axis in 0..axes {
            let texels = change[axis] * extent[axis] as f32;
            squares += texels * texels;
        }
        squares
    };
    half_log2(along(dx).max(along(dy)))
}

/// Half the base-2 logarithm, to 2e-6, and exact for powers of four. About -64 for zero, 64 for infinity and NaN.
/// Undefined for negative numbers.
#[inline(always)]
pub(super) fn half_log2(x: f32) -> f32 {
    // The mantissa is taken in [sqrt(1/2), sqrt(2)): subtracting the bits of sqrt(1/2) makes the exponent field match.
    const BIAS: i32 = 127 << 23;
    let bits = x.min(f32::MAX).to_bits() as i32;
    let exponent = (bits - std::f32::consts::FRAC_1_SQRT_2.to_bits() as i32 + BIAS) >> 23;
    let exponent = exponent - 127;
    let mantissa = f32::from_bits((bits - (exponent << 23)) as u32);
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let s2 = s * s;
    // log2(m) / 2 = (s + s^3 / 3 + s^5 / 5 + ...) / ln 2, |s| < 0.1716: the omitted terms are below 2e-7.
    let series = 1.0 + s2 * (1.0 / 3.0 + s2 * (0.2 + s2 * (1.0 / 7.0)));
    0.5 * exponent as f32 + s * series * std::f32::consts::LOG2_E
}

#[cfg(test)]
mod tests {
    use super::*;

    #[gaurast_runner::test]
    fn the_logarithm_is_exact_enough() {
        let mut x = 1e-37f32;
        while x < 1e38 {
            let exact = 0.5 * f64::from(x).log2();
            let error = (f64::from(half_log2(x)) - exact).abs();
            assert!(error < 2e-6 * exact.abs().max(1.0), "{x}: {error}");
            x *= 1.003;
        }
        for power in -60..60 {
            assert_eq!(half_log2(2f32.powi(power)), 0.5 * power as f32);
        }
        assert!(half_log2(0.0) < -60.0);
        assert!(half_log2(f32::INFINITY) >= 64.0);
    }

    #[gaurast_runner::test]
    fn ties_go_to_the_larger_level() {
        let levels = [0.0, 0.5, 0.500_1, 1.5, 1.6, 2.0].map(nearest_level);
        assert_eq!(levels, [0, 0, 1, 1, 2, 2]);
    }
}
