//! Reads and writes of single texels, 16 at once. The bits are those of [`super::scalar`], which handles requests that
//! this module does not.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use devmem::{load_16, look_up_16, store_16};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, mask32x16, u32x8, u32x16};
use half::f16;
use half::slice::HalfFloatSliceExt;

use super::surface::Surface;
use super::texels::{PackedLevel, TexelCodec, Texels, VectorLayout, for_codec, texels};
use crate::format::unorm8::pack_unorm8;
use crate::simd::floats_of;
use isa::ir::{Dimension, VECTOR_LANES};
use isa::resources::{LaneWords, TexelRequest};

/// The texels that 16 lanes access.
struct Places<S: Simd> {
    /// The active lanes whose texel exists.
    inside: u16,
    /// The index of each lane's texel; that of the level's first if there is none.
    index: u32x16<S>,
}

/// The layout and the level that a request accesses; `None` if it must be handled lane by lane.
#[inline(always)]
fn level<'a>(surface: &'a Surface, request: &TexelRequest) -> Option<(&'a VectorLayout, &'a PackedLevel)> {
    let layout = surface.layout.as_ref()?;
    let first = request.level[0];
    let mut differences = 0;
    for lane in 0..VECTOR_LANES {
        differences |= request.level[lane] ^ first;
    }
    if request.shape.multisampled || differences != 0 || first as usize >= surface.levels.len() {
        return None;
    }
    Some((layout, layout.levels.get(first as usize)?))
}

/// Finds the texels of a level.
#[inline(always)]
fn places<S: Simd>(simd: S, surface: &Surface, level: &PackedLevel, request: &TexelRequest) -> Places<S> {
    let splat = |word: u32| u32x16::splat(simd, word);
    let shape = request.shape;
    let (y, z) = match shape.dimension {
        Dimension::Buffer | Dimension::D1 => (None, None),
        Dimension::D2 | Dimension::Cube => (Some(1), None),
        Dimension::D3 => (Some(1), Some(2)),
    };
    // A cube's faces are its layers.
    let layer = match shape.dimension {
        Dimension::Buffer => None,
        Dimension::Cube => Some(2),
        dimension => shape.arrayed.then_some(dimension.coordinates()),
    };
    let [width, height, depth] = level.extent;
    let x = u32x16::simd_from(simd, request.coordinate[0]);
    let mut is_inside: mask32x16<S> = x.simd_lt(splat(width));
    let mut index = splat(level.base) + x;
    let others =
        [(y, height, level.row_pitch), (z, depth, level.depth_pitch), (layer, surface.layers, level.layer_pitch)];
    for (number, size, pitch) in others {
        if let Some(number) = number {
            let coordinate = u32x16::simd_from(simd, request.coordinate[number]);
            is_inside &= coordinate.simd_lt(splat(size));
            index += coordinate * splat(pitch);
        }
    }
    let inside = is_inside.to_bitmask() as u16 & request.mask;
    if inside != u16::MAX {
        index = simd.from_bitmask_mask32x16(u64::from(inside)).select(index, splat(level.base));
    }
    Places { inside, index }
}

/// Reads texels. Returns false if they must be read lane by lane.
#[inline(always)]
pub(super) fn read<S: Simd>(simd: S, surface: &Surface, request: &TexelRequest, texel: &mut [LaneWords; 4]) -> bool {
    simd.vectorize(
        #[inline(always)]
        || match level(surface, request) {
            Some((layout, level)) => {
                read_level(simd, surface, layout, level, request, texel);
                true
            }
            None => false,
        },
    )
}

/// The stored components of 16 texels.
#[inline(always)]
fn stored<S: Simd, T: Texels>(simd: S, words: &[AtomicU32], index: u32x16<S>) -> [u32x16<S>; 4] {
    if T::SIZE == 4
        && let Some(words) = run(simd, words, index)
    {
        let zero = u32x8::splat(simd, 0);
        let (first, second) = words.split();
        let (first, second) = (T::decode(simd, [first, zero, zero, zero]), T::decode(simd, [second, zero, zero, zero]));
        return joined::<S, T>(simd, first, second);
    }
    let (first, second) = index.split();
    let (first, second) = (texels::<S, T>(simd, words, first), texels::<S, T>(simd, words, second));
    joined::<S, T>(simd, first, second)
}

/// The bits of the components of two times eight texels.
#[inline(always)]
fn joined<S: Simd, T: Texels>(simd: S, first: [f32x8<S>; 4], second: [f32x8<S>; 4]) -> [u32x16<S>; 4] {
    let mut joined = [u32x16::splat(simd, 0); 4];
    for c in 0..T::COMPONENTS {
        joined[c] = first[c].combine(second[c]).bitcast();
    }
    joined
}

/// The words at 16 indices, if these are consecutive, or in any order within an aligned run of 16 words.
#[inline(always)]
fn run<S: Simd>(simd: S, words: &[AtomicU32], index: u32x16<S>) -> Option<u32x16<S>> {
    const RUN: u32 = VECTOR_LANES as u32;
    let first = index[0];
    let consecutive = u32x16::simd_from(simd, CONSECUTIVE);
    let is_consecutive = (index - first).simd_eq(consecutive).all_true();
    let begin = if is_consecutive { first } else { first & !(RUN - 1) };
    let place = index - begin;
    if !is_consecutive && !place.simd_lt(RUN).all_true() {
        return None;
    }
    let run = load_16(simd, words.get(begin as usize..)?.first_chunk()?);
    Some(if is_consecutive { run } else { look_up_16(simd, run, place) })
}

/// The numbers of lanes.
const CONSECUTIVE: LaneWords = {
    let mut numbers = [0; VECTOR_LANES];
    let mut lane = 0;
    while lane < VECTOR_LANES {
        numbers[lane] = lane as u32;
        lane += 1;
    }
    numbers
};

#[inline(always)]
fn read_level<S: Simd>(
    simd: S,
    surface: &Surface,
    layout: &VectorLayout,
    level: &PackedLevel,
    request: &TexelRequest,
    texel: &mut [LaneWords; 4],
) {
    let words = layout.words(&surface.memory);
    let Places { inside, index } = places(simd, surface, level, request);
    let stored = for_codec!(layout.codec, stored(simd, words, index));
    if inside == u16::MAX {
        return layout.arrange(stored, surface.one(), texel);
    }
    let zero = u32x16::splat(simd, 0);
    let one = u32x16::splat(simd, surface.one());
    let components = layout.codec.components();
    let mut found = [zero, zero, zero, one];
    for c in 0..4 {
        if layout.order[c] < components {
            found[c] = stored[layout.order[c]];
        }
    }
    let is_inside = simd.from_bitmask_mask32x16(u64::from(inside));
    let outside = surface.outside();
    for c in 0..4 {
        found[c] = is_inside.select(found[c], u32x16::splat(simd, outside[c]));
    }
    let is_active = simd.from_bitmask_mask32x16(u64::from(request.mask));
    for (texel, from) in texel.iter_mut().zip(surface.swizzle) {
        *texel = is_active.select(from.pick(&found, zero, one), zero).into();
    }
}

/// Writes texels, in order of lanes. Returns false if they must be written lane by lane.
#[inline(always)]
pub(super) fn write<S: Simd>(simd: S, surface: &Surface, request: &TexelRequest, texel: &[LaneWords; 4]) -> bool {
    simd.vectorize(
        #[inline(always)]
        || match level(surface, request) {
            Some((layout, level)) if surface.writable => write_level(simd, surface, layout, level, request, texel),
            _ => false,
        },
    )
}

#[inline(always)]
fn write_level<S: Simd>(
    simd: S,
    surface: &Surface,
    layout: &VectorLayout,
    level: &PackedLevel,
    request: &TexelRequest,
    texel: &[LaneWords; 4],
) -> bool {
    let words = layout.words(&surface.memory);
    let places = places(simd, surface, level, request);
    let [r, g, b, a] = *texel;
    match layout.codec {
        TexelCodec::Unorm8x4 => {
            let colors = [
                floats_of(u32x16::simd_from(simd, r)),
                floats_of(u32x16::simd_from(simd, g)),
                floats_of(u32x16::simd_from(simd, b)),
                floats_of(u32x16::simd_from(simd, a)),
            ];
            let is_bgra = layout.order[0] == 2;
            store_words(words, &places, pack_unorm8(simd, &colors, is_bgra));
        }
        TexelCodec::Float32 => store_words(words, &places, u32x16::simd_from(simd, r)),
        TexelCodec::Float32x4 => store_quads(words, &places, texel),
        TexelCodec::Float16x4 => {
            let [r, g, b, a] = [to_halves(r), to_halves(g), to_halves(b), to_halves(a)];
            let mut pairs = [0; VECTOR_LANES];
            for lane in 0..VECTOR_LANES {
                let [r, g, b, a] = [r[lane], g[lane], b[lane], a[lane]].map(u64::from);
                pairs[lane] = r | g << 16 | b << 32 | a << 48;
            }
            store_pairs(surface, layout, &places, &pairs);
        }
        TexelCodec::Float32x2 => {
            let mut pairs = [0; VECTOR_LANES];
            for lane in 0..VECTOR_LANES {
                pairs[lane] = u64::from(r[lane]) | u64::from(g[lane]) << 32;
            }
            store_pairs(surface, layout, &places, &pairs);
        }
        _ => return false,
    }
    true
}

/// The bits of binary32 numbers as binary16 numbers, rounded as formats round them.
#[inline(always)]
fn to_halves(numbers: LaneWords) -> [u16; VECTOR_LANES] {
    let numbers: [f32; VECTOR_LANES] = bytemuck::cast(numbers);
    let mut halves = [f16::ZERO; VECTOR_LANES];
    halves.convert_from_f32_slice(&numbers);
    bytemuck::cast(halves)
}

/// The lanes of a set, in ascending order.
#[inline(always)]
fn lanes_of(set: u16) -> impl Iterator<Item = usize> {
    (0..VECTOR_LANES).filter(move |lane| set >> lane & 1 != 0)
}

/// Stores texels of one word.
#[inline(always)]
fn store_words<S: Simd>(words: &[AtomicU32], places: &Places<S>, values: u32x16<S>) {
    let index: LaneWords = places.index.into();
    let mut differences = 0;
    for lane in 0..VECTOR_LANES {
        differences |= index[lane].wrapping_sub(lane as u32) ^ index[0];
    }
    if places.inside == u16::MAX
        && differences == 0
        && let Some(run) = words.get(index[0] as usize..).and_then(|words| words.first_chunk())
    {
        return store_16(values.simd, run, values);
    }
    let values: LaneWords = values.into();
    for lane in lanes_of(places.inside) {
        if let Some(word) = words.get(index[lane] as usize) {
            word.store(values[lane], Relaxed);
        }
    }
}

/// Stores texels of four words.
#[inline(always)]
fn store_quads<S: Simd>(words: &[AtomicU32], places: &Places<S>, texel: &[LaneWords; 4]) {
    let index: LaneWords = places.index.into();
    let (quads, _) = words.as_chunks::<4>();
    for lane in lanes_of(places.inside) {
        if let Some(words) = quads.get(index[lane] as usize) {
            for (word, component) in words.iter().zip(texel) {
                word.store(component[lane], Relaxed);
            }
        }
    }
}

/// Stores texels of eight bytes, each at once.
#[inline(always)]
fn store_pairs<S: Simd>(surface: &Surface, layout: &VectorLayout, places: &Places<S>, values: &[u64; VECTOR_LANES]) {
    let index: LaneWords = places.index.into();
    let begin = 4 * layout.words.start as u64;
    for lane in lanes_of(places.inside) {
        let offset = begin + 8 * u64::from(index[lane]);
        if surface.memory.store_u64(offset, values[lane]).is_none() {
            // The memory of a buffer may begin between multiples of eight.
            let _ = surface.memory.write(offset, &values[lane].to_le_bytes());
        }
    }
}
