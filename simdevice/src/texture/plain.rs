//! Plain samples, by far the most: of 2D images of four bytes a texel, linear within levels, where quads alone choose the
//! levels. Everything stays in vectors, from the coordinates to the registers. The bits are those of [`super::batch`].

use std::sync::atomic::AtomicU32;

use fearless_simd::{Simd, f32x4, f32x16, prelude::*, u32x4, u32x16};

use super::axis::taps;
use super::lod::{self, QUADS};
use super::packing::{Around, Kind, PackedLevel, Packing, Srgb8x4, Texels, Unorm8x4};
use super::sampler::{AddressMode, Filter, Reduction, Sampler};
use super::surface::Surface;
use isa::ir::{CHUNK_LANES, Dimension};
use isa::resources::{Lanes, LodRequest, SampleRequest};

/// Filters for all lanes; None if the request isn't plain.
#[inline(always)]
pub(super) fn sample<S: Simd>(
    simd: S,
    surface: &Surface,
    sampler: &Sampler,
    request: &SampleRequest,
) -> Option<[Lanes; 4]> {
    let packing = surface.packing.as_ref()?;
    if !is_plain(sampler, request) {
        return None;
    }
    match packing.kind {
        Kind::Unorm8x4 => Some(simd.vectorize(
            #[inline(always)]
            || filter::<S, Unorm8x4>(simd, surface, packing, sampler, request),
        )),
        Kind::Srgb8x4 => Some(simd.vectorize(
            #[inline(always)]
            || filter::<S, Srgb8x4>(simd, surface, packing, sampler, request),
        )),
        _ => None,
    }
}

/// Whether there is nothing but to filter.
#[inline(always)]
fn is_plain(sampler: &Sampler, request: &SampleRequest) -> bool {
    let shape = request.shape;
    let [x, y, _] = sampler.address_modes;
    let mut moved = 0;
    for offset in request.offset[..2].as_flattened() {
        moved |= offset;
    }
    shape.dimension == Dimension::D2
        && !shape.arrayed
        && !shape.multisampled
        && request.lod == LodRequest::Automatic
        && request.gather.is_none()
        && (request.compare.is_none() || sampler.compare_op.is_none())
        && (sampler.mag_filter, sampler.min_filter) == (Filter::Linear, Filter::Linear)
        && !sampler.unnormalized_coordinates
        && sampler.reduction == Reduction::WeightedAverage
        && x != AddressMode::ClampToBorder
        && y != AddressMode::ClampToBorder
        && moved == 0
}

#[inline(always)]
fn filter<S: Simd, T: Texels>(
    simd: S,
    surface: &Surface,
    packing: &Packing,
    sampler: &Sampler,
    request: &SampleRequest,
) -> [Lanes; 4] {
    let words = packing.words(&surface.memory);
    let selection = lod::select_quads(surface, sampler, request);
    let mut texel = level::<S, T>(simd, words, packing, sampler, request, &selection.high);
    if selection.weight != [0.0; QUADS] {
        let low = level::<S, T>(simd, words, packing, sampler, request, &selection.low);
        let weight = spread(simd, selection.weight);
        for c in 0..T::COMPONENTS {
            // Texels are finite, so that a weight of zero takes nothing.
            texel[c] = texel[c] + weight * (low[c] - texel[c]);
        }
    }
    registers(surface, packing, texel)
}

/// The weighted mean of the texels of a level for each quad.
#[inline(always)]
fn level<S: Simd, T: Texels>(
    simd: S,
    words: &[AtomicU32],
    packing: &Packing,
    sampler: &Sampler,
    request: &SampleRequest,
    levels: &[u32; QUADS],
) -> [f32x16<S>; 4] {
    let (width, height, base, row_pitch);
    let first = &packing.levels[levels[0] as usize];
    if *levels == [levels[0]; QUADS] {
        width = f32x16::splat(simd, first.extent[0] as f32);
        height = f32x16::splat(simd, first.extent[1] as f32);
        base = u32x16::splat(simd, first.base);
        row_pitch = u32x16::splat(simd, first.row_pitch);
    } else {
        let mut each = [first; QUADS];
        for quad in 1..QUADS {
            each[quad] = &packing.levels[levels[quad] as usize];
        }
        width = spread(simd, of_each(each, |level| level.extent[0] as f32));
        height = spread(simd, of_each(each, |level| level.extent[1] as f32));
        base = spread_words(simd, of_each(each, |level| level.base));
        row_pitch = spread_words(simd, of_each(each, |level| level.row_pitch));
    }
    let x = taps(
        simd,
        sampler.address_modes[0],
        &request.coordinate[0],
        width,
    );
    let y = taps(
        simd,
        sampler.address_modes[1],
        &request.coordinate[1],
        height,
    );
    let around = Around {
        rows: [base + y.first * row_pitch, base + y.second * row_pitch],
        columns: [x.first, x.second],
        weights: [x.weight, y.weight],
    };
    around.filter::<T>(simd, words)
}

/// A number of each level. (The standard library's `map` is not always inlined.)
#[inline(always)]
fn of_each<T: Copy + Default>(
    levels: [&PackedLevel; QUADS],
    value: impl Fn(&PackedLevel) -> T,
) -> [T; QUADS] {
    let mut values = [T::default(); QUADS];
    for quad in 0..QUADS {
        values[quad] = value(levels[quad]);
    }
    values
}

/// A number of each quad for its lanes.
#[inline(always)]
fn spread<S: Simd>(simd: S, [a, b, c, d]: [f32; QUADS]) -> f32x16<S> {
    let upper = f32x4::splat(simd, a).combine(f32x4::splat(simd, b));
    upper.combine(f32x4::splat(simd, c).combine(f32x4::splat(simd, d)))
}

/// As [`spread`], of integers.
#[inline(always)]
fn spread_words<S: Simd>(simd: S, [a, b, c, d]: [u32; QUADS]) -> u32x16<S> {
    let upper = u32x4::splat(simd, a).combine(u32x4::splat(simd, b));
    upper.combine(u32x4::splat(simd, c).combine(u32x4::splat(simd, d)))
}

/// Stored components, of which there are four, as a program gets them.
#[inline(always)]
fn registers<S: Simd>(surface: &Surface, packing: &Packing, texel: [f32x16<S>; 4]) -> [Lanes; 4] {
    let mut stored = [[0.0; CHUNK_LANES]; 4];
    for c in 0..4 {
        stored[c] = texel[c].into();
    }
    let (zero, one) = ([0.0; CHUNK_LANES], [1.0; CHUNK_LANES]);
    let mut found = [&zero; 4];
    for c in 0..4 {
        found[c] = &stored[packing.order[c]];
    }
    let mut out = [[0; CHUNK_LANES]; 4];
    for (out, from) in out.iter_mut().zip(surface.swizzle) {
        *out = bytemuck::cast(*from.pick(&found, &zero, &one));
    }
    out
}
