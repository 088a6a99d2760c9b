//! Texels of 16 lanes at once: the layout of the common formats in words, and their decoding.
//!
//! Decoding gives the same bits as [`crate::Format::decode`]. Vectors are not used in closures: a closure that is not
//! inlined would be compiled without the SIMD level's instructions.

use std::ops::Range;
use std::sync::LazyLock;
use std::sync::atomic::AtomicU32;

use devmem::{Allocation, gather, gather_2, gather_4, gather_each};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, f32x16, i32x8, mask32x8, mask32x16, u32x8, u32x16};

use crate::format::Format;
use crate::format::unorm8::unorm8_fraction_8;
use crate::simd::half::halves;
use crate::state::CompareOp;
use crate::texture::view::Swizzle;
use isa::ir::VECTOR_LANES;
use isa::resources::LaneWords;

/// The encoding of texels in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TexelCodec {
    Unorm8,
    Unorm8x2,
    Unorm8x4,
    Srgb8x4,
    Unorm16,
    Float16,
    Float16x2,
    Float16x4,
    Float32,
    Float32x2,
    Float32x4,
}

/// A mip level. Its extent is in texels, and its base and pitches in texels from the beginning of
/// `VectorLayout::words`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PackedLevel {
    pub extent: [u32; 3],
    pub base: u32,
    pub row_pitch: u32,
    pub depth_pitch: u32,
    pub layer_pitch: u32,
}

/// The layout for reading 16 texels of a surface at a time.
#[derive(Clone, Debug)]
pub(super) struct VectorLayout {
    pub codec: TexelCodec,
    /// The range of words of the memory that contains the surface.
    pub words: Range<usize>,
    pub levels: Vec<PackedLevel>,
    /// The index of the stored component for red, green, blue and alpha.
    pub order: [usize; 4],
    /// The index of the stored component for each component that a program reads, after swizzling; [`ZERO`] or [`ONE`] if
    /// there is none.
    pub sources: [usize; 4],
    /// False if texels are only read and written one by one: those of integers, and those of buffers.
    pub is_filterable: bool,
}

/// The source of a component that is 0.
pub(super) const ZERO: usize = 4;

/// The source of a component that is 1.
pub(super) const ONE: usize = 5;

impl VectorLayout {
    /// Sets the sources of components for a swizzle.
    pub fn set_swizzle(&mut self, swizzle: Swizzle) {
        let components = self.codec.components();
        let mut found = [ZERO, ZERO, ZERO, ONE];
        for (found, stored) in found.iter_mut().zip(self.order) {
            if stored < components {
                *found = stored;
            }
        }
        self.sources = swizzle.map(|from| from.pick(&found, ZERO, ONE));
    }

    /// Sets the result registers for the stored components of 16 texels, given the bits of 1.
    #[inline(always)]
    pub fn arrange<S: Simd>(&self, stored: [u32x16<S>; 4], one: u32, texel: &mut [LaneWords; 4]) {
        if self.sources == [0, 1, 2, 3] {
            for c in 0..4 {
                texel[c] = stored[c].into();
            }
            return;
        }
        let mut found = [[0; VECTOR_LANES]; 6];
        for c in 0..4 {
            found[c] = stored[c].into();
        }
        found[ONE] = [one; VECTOR_LANES];
        for c in 0..4 {
            texel[c] = found[self.sources[c]];
        }
    }

    /// The words of the surface's memory from which texels are read.
    #[inline]
    pub fn words<'a>(&self, memory: &'a Allocation) -> &'a [AtomicU32] {
        memory.words().get(self.words.clone()).unwrap_or_default()
    }
}

impl TexelCodec {
    /// The codec of a format; `None` if its texels must be read one by one. Integers of 32 bits are kept as they are, as
    /// floats of 32 bits are.
    pub fn of(format: Format) -> Option<Self> {
        Some(match format {
            Format::R8Unorm => Self::Unorm8,
            Format::R8G8Unorm => Self::Unorm8x2,
            Format::R8G8B8A8Unorm | Format::B8G8R8A8Unorm | Format::A8B8G8R8UnormPack32 => Self::Unorm8x4,
            Format::R8G8B8A8Srgb | Format::B8G8R8A8Srgb | Format::A8B8G8R8SrgbPack32 => Self::Srgb8x4,
            Format::R16Unorm | Format::D16Unorm => Self::Unorm16,
            Format::R16Sfloat => Self::Float16,
            Format::R16G16Sfloat => Self::Float16x2,
            Format::R16G16B16A16Sfloat => Self::Float16x4,
            Format::R32Sfloat | Format::D32Sfloat | Format::R32Uint | Format::R32Sint => Self::Float32,
            Format::R32G32Sfloat | Format::R32G32Uint | Format::R32G32Sint => Self::Float32x2,
            Format::R32G32B32A32Sfloat | Format::R32G32B32A32Uint | Format::R32G32B32A32Sint => Self::Float32x4,
            _ => return None,
        })
    }
}

/// Two columns and two rows of texels for each of 16 lanes.
pub(super) struct Rows<'a> {
    /// The index of the first texel of each lane's level, layer and slice.
    pub base: LaneWords,
    pub row_pitch: LaneWords,
    pub x: &'a [LaneWords; 2],
    pub y: &'a [LaneWords; 2],
}

/// Calls a kernel for a [`TexelCodec`].
macro_rules! for_codec {
    ($codec:expr, $kernel:ident($($argument:expr),*)) => {{
        use $crate::texture::texels::{self, TexelCodec};
        match $codec {
            TexelCodec::Unorm8 => $kernel::<S, texels::Unorm8>($($argument),*),
            TexelCodec::Unorm8x2 => $kernel::<S, texels::Unorm8x2>($($argument),*),
            TexelCodec::Unorm8x4 => $kernel::<S, texels::Unorm8x4>($($argument),*),
            TexelCodec::Srgb8x4 => $kernel::<S, texels::Srgb8x4>($($argument),*),
            TexelCodec::Unorm16 => $kernel::<S, texels::Unorm16>($($argument),*),
            TexelCodec::Float16 => $kernel::<S, texels::Float16>($($argument),*),
            TexelCodec::Float16x2 => $kernel::<S, texels::Float16x2>($($argument),*),
            TexelCodec::Float16x4 => $kernel::<S, texels::Float16x4>($($argument),*),
            TexelCodec::Float32 => $kernel::<S, texels::Float32>($($argument),*),
            TexelCodec::Float32x2 => $kernel::<S, texels::Float32x2>($($argument),*),
            TexelCodec::Float32x4 => $kernel::<S, texels::Float32x4>($($argument),*),
        }
    }};
}
pub(super) use for_codec;

impl TexelCodec {
    /// The number of components that are stored.
    pub fn components(self) -> usize {
        match self {
            Self::Unorm8 | Self::Unorm16 | Self::Float16 | Self::Float32 => 1,
            Self::Unorm8x2 | Self::Float16x2 | Self::Float32x2 => 2,
            Self::Unorm8x4 | Self::Srgb8x4 | Self::Float16x4 | Self::Float32x4 => 4,
        }
    }

    /// True if depths are stored so.
    pub fn is_depth(self) -> bool {
        matches!(self, Self::Unorm16 | Self::Float32)
    }

    /// The stored components of the texels in column `i` and row `j`, each 0 or 1. The kernel is compiled on its own.
    #[inline(always)]
    pub fn load<S: Simd>(self, simd: S, words: &[AtomicU32], rows: &Rows<'_>, i: usize, j: usize) -> [Floats; 4] {
        simd.vectorize(
            #[inline(always)]
            || for_codec!(self, load(simd, words, rows, i, j)),
        )
    }

    /// The weighted mean of all four texels. The kernel is compiled on its own.
    #[inline(always)]
    pub fn bilinear<S: Simd>(
        self,
        simd: S,
        words: &[AtomicU32],
        rows: &Rows<'_>,
        weight_x: &Floats,
        weight_y: &Floats,
    ) -> [Floats; 4] {
        simd.vectorize(
            #[inline(always)]
            || for_codec!(self, bilinear(simd, words, rows, weight_x, weight_y)),
        )
    }
}

#[inline(always)]
fn load<S: Simd, T: Texels>(simd: S, words: &[AtomicU32], rows: &Rows<'_>, i: usize, j: usize) -> [Floats; 4] {
    let index = row_start(simd, rows, j) + u32x16::simd_from(simd, rows.x[i]);
    let (first, second) = index.split();
    let first = texels::<S, T>(simd, words, first);
    let second = texels::<S, T>(simd, words, second);
    let mut out = [[0.0; VECTOR_LANES]; 4];
    for c in 0..T::COMPONENTS {
        out[c] = first[c].combine(second[c]).into();
    }
    out
}

#[inline(always)]
fn bilinear<S: Simd, T: Texels>(
    simd: S,
    words: &[AtomicU32],
    rows: &Rows<'_>,
    weight_x: &Floats,
    weight_y: &Floats,
) -> [Floats; 4] {
    let around = Footprint2x2 {
        rows: [row_start(simd, rows, 0), row_start(simd, rows, 1)],
        columns: [u32x16::simd_from(simd, rows.x[0]), u32x16::simd_from(simd, rows.x[1])],
        weights: [f32x16::simd_from(simd, *weight_x), f32x16::simd_from(simd, *weight_y)],
    };
    let texel = around.filter::<T>(simd, words, None);
    let mut out = [[0.0; VECTOR_LANES]; 4];
    for c in 0..T::COMPONENTS {
        out[c] = texel[c].into();
    }
    out
}

/// The four texels around each of 16 points.
#[derive(Clone, Copy)]
pub(super) struct Footprint2x2<S: Simd> {
    /// The indices at which the upper and the lower row begin.
    pub rows: [u32x16<S>; 2],
    /// The left and the right column.
    pub columns: [u32x16<S>; 2],
    /// The weights of the right column and of the lower row.
    pub weights: [f32x16<S>; 2],
}

/// A depth comparison in 16 lanes.
#[derive(Clone, Copy)]
pub(super) struct Comparison<S: Simd> {
    pub op: CompareOp,
    pub reference: f32x16<S>,
}

impl<S: Simd> Footprint2x2<S> {
    /// The points of which two columns or rows are the same one, as at edges to which coordinates are clamped.
    #[inline(always)]
    pub fn at_edges(&self) -> u16 {
        let ([top, bottom], [left, right]) = (self.rows, self.columns);
        let at_edges: mask32x16<S> = left.simd_eq(right) | top.simd_eq(bottom);
        at_edges.to_bitmask() as u16
    }

    /// The weighted mean. If a comparison is given, the first component of each texel is its result, 1 or 0.
    #[inline(always)]
    pub fn filter<T: Texels>(&self, simd: S, words: &[AtomicU32], comparison: Option<Comparison<S>>) -> [f32x16<S>; 4] {
        let ([top, bottom], [left, right], [x, y]) = (self.rows, self.columns, self.weights);
        // Half of the lanes at a time, because most processors have enough registers for those only.
        let (top, bottom) = (top.split(), bottom.split());
        let (left, right) = (left.split(), right.split());
        let (x, y) = (x.split(), y.split());
        let mut halves = [None; 2];
        if let Some(Comparison { op, reference }) = comparison {
            let (first, second) = reference.split();
            halves = [Some((op, first)), Some((op, second))];
        }
        let first =
            Half { rows: [top.0, bottom.0], columns: [left.0, right.0], weights: [x.0, y.0], comparison: halves[0] };
        let second =
            Half { rows: [top.1, bottom.1], columns: [left.1, right.1], weights: [x.1, y.1], comparison: halves[1] };
        let (first, second) = (first.filter::<T>(simd, words), second.filter::<T>(simd, words));
        let mut out = [f32x16::splat(simd, 0.0); 4];
        for c in 0..T::COMPONENTS {
            out[c] = first[c].combine(second[c]);
        }
        out
    }
}

/// The four texels around each of eight points; see [`Footprint2x2`].
struct Half<S: Simd> {
    rows: [u32x8<S>; 2],
    columns: [u32x8<S>; 2],
    weights: [f32x8<S>; 2],
    comparison: Option<(CompareOp, f32x8<S>)>,
}

impl<S: Simd> Half<S> {
    /// The weighted means of a row's texels, compared before if that is requested.
    #[inline(always)]
    fn row<T: Texels>(&self, simd: S, words: &[AtomicU32], row: usize) -> [f32x8<S>; 4] {
        let begin = self.rows[row];
        let [left, right] = neighbours::<S, T>(simd, words, begin + self.columns[0], begin + self.columns[1]);
        let (mut mean, mut other) = (T::decode(simd, left), T::decode(simd, right));
        if T::IS_DEPTH
            && let Some((op, reference)) = self.comparison
        {
            mean[0] = compare(simd, op, reference, mean[0]);
            other[0] = compare(simd, op, reference, other[0]);
        }
        for c in 0..T::COMPONENTS {
            mean[c] = mean[c] + self.weights[0] * (other[c] - mean[c]);
        }
        mean
    }

    #[inline(always)]
    fn filter<T: Texels>(&self, simd: S, words: &[AtomicU32]) -> [f32x8<S>; 4] {
        let mut mean = self.row::<T>(simd, words, 0);
        let lower = self.row::<T>(simd, words, 1);
        for c in 0..T::COMPONENTS {
            mean[c] = mean[c] + self.weights[1] * (lower[c] - mean[c]);
        }
        mean
    }
}

/// 1 where a comparison of the reference with the depth holds, otherwise 0; see [`CompareOp::holds`].
#[inline(always)]
fn compare<S: Simd>(simd: S, op: CompareOp, reference: f32x8<S>, depth: f32x8<S>) -> f32x8<S> {
    let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
    match op {
        CompareOp::Never => zero,
        CompareOp::Less => reference.simd_lt(depth).select(one, zero),
        CompareOp::Equal => reference.simd_eq(depth).select(one, zero),
        CompareOp::LessOrEqual => reference.simd_le(depth).select(one, zero),
        CompareOp::Greater => reference.simd_gt(depth).select(one, zero),
        CompareOp::NotEqual => reference.simd_eq(depth).select(zero, one),
        CompareOp::GreaterOrEqual => reference.simd_ge(depth).select(one, zero),
        CompareOp::Always => one,
    }
}

/// The indices at which row `j`, 0 or 1, of each lane begins.
#[inline(always)]
fn row_start<S: Simd>(simd: S, rows: &Rows<'_>, j: usize) -> u32x16<S> {
    let y = u32x16::simd_from(simd, rows.y[j]);
    u32x16::simd_from(simd, rows.base) + y * u32x16::simd_from(simd, rows.row_pitch)
}

/// A [`TexelCodec`] as a type.
pub(super) trait Texels {
    /// The bytes of a texel: 1, 2, 4, 8 or 16.
    const SIZE: usize;
    /// The number of components that are stored.
    const COMPONENTS: usize;
    /// True if depths are stored so.
    const IS_DEPTH: bool = false;

    /// The stored components of texels, given their words. A texel smaller than a word is at the low end of one. Components
    /// beyond [`Texels::COMPONENTS`] are zero.
    fn decode<S: Simd>(simd: S, words: [u32x8<S>; 4]) -> [f32x8<S>; 4];
}

/// The stored components of texels.
#[inline(always)]
pub(super) fn texels<S: Simd, T: Texels>(simd: S, words: &[AtomicU32], index: u32x8<S>) -> [f32x8<S>; 4] {
    let mut found = [u32x8::splat(simd, 0); 4];
    match T::SIZE {
        16 => found = gather_4(simd, words, index * 4),
        8 => [found[0], found[1]] = gather_2(simd, words, index * 2),
        _ => found[0] = at_low_end::<S, T>(gather(simd, words, word_of::<S, T>(index)), index),
    }
    T::decode(simd, found)
}

/// The words of texels and of those beside them, of which most are one further. Both are as [`Texels::decode`] takes them.
#[inline(always)]
fn neighbours<S: Simd, T: Texels>(simd: S, words: &[AtomicU32], left: u32x8<S>, right: u32x8<S>) -> [[u32x8<S>; 4]; 2] {
    let zero = u32x8::splat(simd, 0);
    match T::SIZE {
        16 => [gather_4(simd, words, left * 4), gather_4(simd, words, right * 4)],
        8 => {
            let step = right - left;
            let is_same: mask32x8<S> = step.simd_eq(0);
            let [a, b, c, d] = gather_4(simd, words, left * 2);
            let mut next = [is_same.select(a, c), is_same.select(b, d)];
            if step.simd_gt(1).any_true() {
                let [c, d] = gather_each(words, &(right * 2).into());
                next = [u32x8::simd_from(simd, c), u32x8::simd_from(simd, d)];
            }
            [[a, b, zero, zero], [next[0], next[1], zero, zero]]
        }
        _ => {
            let (place, other) = (word_of::<S, T>(left), word_of::<S, T>(right));
            let step = other - place;
            let [word, next] = gather_2(simd, words, place);
            let mut next = step.simd_eq(0).select(word, next);
            if step.simd_gt(1).any_true() {
                let [each] = gather_each(words, &other.into());
                next = u32x8::simd_from(simd, each);
            }
            [[at_low_end::<S, T>(word, left), zero, zero, zero], [at_low_end::<S, T>(next, right), zero, zero, zero]]
        }
    }
}

/// The indices of the words that contain texels of at most a word.
#[inline(always)]
fn word_of<S: Simd, T: Texels>(index: u32x8<S>) -> u32x8<S> {
    if T::SIZE == 4 { index } else { index >> (4 / T::SIZE as u32).trailing_zeros() }
}

/// Words of which texels of at most a word are shifted to the low end.
#[inline(always)]
fn at_low_end<S: Simd, T: Texels>(word: u32x8<S>, index: u32x8<S>) -> u32x8<S> {
    if T::SIZE == 4 { word } else { word >> ((index & (4 / T::SIZE as u32 - 1)) * (8 * T::SIZE as u32)) }
}

/// The linear values of sRGB codes.
static LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| Format::R8Srgb.decode(&[code as u8])[0]));

pub(super) struct Unorm8;

impl Texels for Unorm8 {
    const SIZE: usize = 1;
    const COMPONENTS: usize = 1;

    #[inline(always)]
    fn decode<S: Simd>(simd: S, words: [u32x8<S>; 4]) -> [f32x8<S>; 4] {
        let zero = f32x8::splat(simd, 0.0);
        [unorm8_fraction_8(words[0], 0), zero, zero, zero]
    }
}

pub(super) struct Unorm8x2;

impl Texels for Unorm8x2 {
    const SIZE: usize = 2;
    const COMPONENTS: usize = 2;

    #[inline(always)]
    fn decode<S: Simd>(simd: S, words: [u32x8<S>; 4]) -> [f32x8<S>; 4] {
        let zero = f32x8::splat(simd, 0.0);
        [unorm8_fraction_8(words[0], 0), unorm8_fraction_8(words[0], 8), zero, zero]
    }
}

pub(super) struct Unorm8x4;

impl Texels for Unorm8x4 {
    const SIZE: usize = 4;
    const COMPONENTS: usize = 4;

    #[inline(always)]
    fn decode<S: Simd>(_: S, words: [u32x8<S>; 4]) -> [f32x8<S>; 4] {
        let word = words[0];
        [
            unorm8_fraction_8(word, 0),
            unorm8_fraction_8(word, 8),
            unorm8_fraction_8(word, 16),
            unorm8_fraction_8(word, 24),
        ]
    }
}

pub(super) struct Srgb8x4;

impl Texels for Srgb8x4 {
    const SIZE: usize = 4;
    const COMPONENTS: usize = 4;

    #[inline(always)]
    fn decode<S: Simd>(simd: S, words: [u32x8<S>; 4]) -> [f32x8<S>; 4] {
        let linear = &*LINEAR;
        let word = words[0];
        let codes: [u32; 8] = word.into();
        let mut values = [[0.0; 8]; 3];
        for lane in 0..8 {
            let [r, g, b, _] = codes[lane].to_le_bytes();
            values[0][lane] = linear[usize::from(r)];
            values[1][lane] = linear[usize::from(g)];
            values[2][lane] = linear[usize::from(b)];
        }
        let [r, g, b] = values;
        [f32x8::simd_from(simd, r), f32x8::simd_from(simd, g), f32x8::simd_from(simd, b), unorm8_fraction_8(word, 24)]
    }
}

pub(super) struct Unorm16;

impl Texels for Unorm16 {
    const SIZE: usize = 2;
    const COMPONENTS: usize = 1;
    const IS_DEPTH: bool = true;

    #[inline(always)]
    fn decode<S: Simd>(simd: S, words: [u32x8<S>; 4]) -> [f32x8<S>; 4] {
        let zero = f32x8::splat(simd, 0.0);
        let code = words[0] & 0xFFFF;
        let code = f32x8::float_from(code.bitcast::<i32x8<S>>());
        [code / 65_535.0, zero, zero, zero]
    }
}

pub(super) struct Float16;

impl Texels for Float16 {
    const SIZE: usize = 2;
    const COMPONENTS: usize = 1;

    #[inline(always)]
    fn decode<S: Simd>(simd: S, words: [u32x8<S>; 4]) -> [f32x8<S>; 4] {
        let zero = f32x8::splat(simd, 0.0);
        [halves(simd, words[0])[0], zero, zero, zero]
    }
}

pub(super) struct Float16x2;

impl Texels for Float16x2 {
    const SIZE: usize = 4;
    const COMPONENTS: usize = 2;

    #[inline(always)]
    fn decode<S: Simd>(simd: S, words: [u32x8<S>; 4]) -> [f32x8<S>; 4] {
        let zero = f32x8::splat(simd, 0.0);
        let [r, g] = halves(simd, words[0]);
        [r, g, zero, zero]
    }
}

pub(super) struct Float16x4;

impl Texels for Float16x4 {
    const SIZE: usize = 8;
    const COMPONENTS: usize = 4;

    #[inline(always)]
    fn decode<S: Simd>(simd: S, words: [u32x8<S>; 4]) -> [f32x8<S>; 4] {
        let ([r, g], [b, a]) = (halves(simd, words[0]), halves(simd, words[1]));
        [r, g, b, a]
    }
}

pub(super) struct Float32;

impl Texels for Float32 {
    const SIZE: usize = 4;
    const COMPONENTS: usize = 1;
    const IS_DEPTH: bool = true;

    #[inline(always)]
    fn decode<S: Simd>(simd: S, words: [u32x8<S>; 4]) -> [f32x8<S>; 4] {
        let zero = f32x8::splat(simd, 0.0);
        [words[0].bitcast(), zero, zero, zero]
    }
}

pub(super) struct Float32x2;

impl Texels for Float32x2 {
    const SIZE: usize = 8;
    const COMPONENTS: usize = 2;

    #[inline(always)]
    fn decode<S: Simd>(simd: S, words: [u32x8<S>; 4]) -> [f32x8<S>; 4] {
        let zero = f32x8::splat(simd, 0.0);
        [words[0].bitcast(), words[1].bitcast(), zero, zero]
    }
}

pub(super) struct Float32x4;

impl Texels for Float32x4 {
    const SIZE: usize = 16;
    const COMPONENTS: usize = 4;

    #[inline(always)]
    fn decode<S: Simd>(_: S, words: [u32x8<S>; 4]) -> [f32x8<S>; 4] {
        [words[0].bitcast(), words[1].bitcast(), words[2].bitcast(), words[3].bitcast()]
    }
}

/// A float for each of 16 lanes.
pub(super) type Floats = [f32; VECTOR_LANES];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::token_of;
    use devmem::dispatch;
    use gaurast_runner::{Case, simd_levels};

    /// Asserts that the texels in these words decode to the same values as by their format's decoder.
    fn agree<T: Texels>(case: &Case, format: Format, words: &[u32]) {
        let atomics: Vec<AtomicU32> = words.iter().copied().map(AtomicU32::new).collect();
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let size = format.texel_size();
        let level = token_of(case);
        for first in (0..bytes.len() / size).step_by(8) {
            let found: [[f32; 8]; 4] = dispatch!(level, simd => {
                let index: [u32; 8] = std::array::from_fn(|lane| (first + lane) as u32);
                texels::<_, T>(simd, &atomics, u32x8::simd_from(simd, index)).map(Into::into)
            });
            for lane in 0..8.min(bytes.len() / size - first) {
                let texel = &bytes[size * (first + lane)..][..size];
                let expected = format.decode(texel);
                for component in 0..T::COMPONENTS {
                    let (a, b) = (found[component][lane], expected[component]);
                    assert!(a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan(), "{format:?} {texel:?}: {a} {b}");
                }
            }
        }
    }

    /// The bits of the components of eight texels and of those beside them.
    type PairBits = [[[u32; 8]; 4]; 2];

    /// Asserts that texels and those beside them are found as one by one, wherever the latter are.
    fn beside<T: Texels>(case: &Case, words: &[u32]) {
        let atomics: Vec<AtomicU32> = words.iter().copied().map(AtomicU32::new).collect();
        let texels_in_all = (4 * words.len() / T::SIZE) as u32;
        let mut left: [u32; 8] = std::array::from_fn(|lane| 7 * lane as u32);
        for round in 0..200 {
            left = left.map(|left| (left * 5 + 1 + round) % texels_in_all);
            let mut right = left.map(|left| (left + 1).min(texels_in_all - 1));
            match round % 4 {
                0 => right[round as usize % 8] = 0,
                1 => right[round as usize % 8] = left[round as usize % 8],
                _ => {}
            }
            let (both, each): (PairBits, PairBits) = dispatch!(token_of(case), simd => {
                let (left, right) = (u32x8::simd_from(simd, left), u32x8::simd_from(simd, right));
                let both = neighbours::<_, T>(simd, &atomics, left, right).map(|words| T::decode(simd, words));
                let each = [left, right].map(|index| texels::<_, T>(simd, &atomics, index));
                let bits = |texels: [[f32x8<_>; 4]; 2]| {
                    texels.map(|texels| texels.map(|component| <[f32; 8]>::from(component).map(f32::to_bits)))
                };
                (bits(both), bits(each))
            });
            assert_eq!(both, each, "{left:?} {right:?}");
        }
    }

    #[gaurast_runner::test(each = simd_levels())]
    fn texels_beside_others_are_those_found_alone(case: &Case) {
        let words: Vec<u32> = (0..96u32).map(|word| word.wrapping_mul(0x9E37_79B9) & 0x7BFF_7BFF).collect();
        beside::<Unorm8>(case, &words);
        beside::<Unorm8x2>(case, &words);
        beside::<Unorm8x4>(case, &words);
        beside::<Srgb8x4>(case, &words);
        beside::<Unorm16>(case, &words);
        beside::<Float16>(case, &words);
        beside::<Float16x2>(case, &words);
        beside::<Float16x4>(case, &words);
        beside::<Float32>(case, &words);
        beside::<Float32x2>(case, &words);
        beside::<Float32x4>(case, &words);
    }

    #[gaurast_runner::test(each = simd_levels())]
    fn decoding_is_that_of_the_formats(case: &Case) {
        let bytes: Vec<u32> = (0..256).map(|code| code * 0x0101_0101).collect();
        agree::<Unorm8>(case, Format::R8Unorm, &bytes);
        agree::<Unorm8x2>(case, Format::R8G8Unorm, &bytes);
        agree::<Unorm8x4>(case, Format::R8G8B8A8Unorm, &bytes);
        agree::<Srgb8x4>(case, Format::R8G8B8A8Srgb, &bytes);
        let halves: Vec<u32> = (0..1 << 16).map(|half| half << 16 | (half ^ 0xFFFF)).collect();
        agree::<Unorm16>(case, Format::R16Unorm, &halves);
        agree::<Float16>(case, Format::R16Sfloat, &halves);
        agree::<Float16x2>(case, Format::R16G16Sfloat, &halves);
        agree::<Float16x4>(case, Format::R16G16B16A16Sfloat, &halves);
        agree::<Float32>(case, Format::R32Sfloat, &halves);
        agree::<Float32x2>(case, Format::R32G32Sfloat, &halves);
        agree::<Float32x4>(case, Format::R32G32B32A32Sfloat, &halves);
    }
}
