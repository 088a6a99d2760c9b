//! Texels of 16 lanes at once: the layout of the common formats in words, and their decoding.
//!
//! Decoding gives the same bits as [`crate::Format::decode`]. Vectors are not used in closures: a closure that is not
//! inlined would be compiled without the SIMD level's instructions.

use std::ops::Range;
use std::sync::LazyLock;
use std::sync::atomic::AtomicU32;

use devmem::{Allocation, gather};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, f32x16, i32x8, u32x8, u32x16};

use crate::format::Format;
use crate::format::unorm8::unorm8_fraction_8;
use crate::state::CompareOp;
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
    /// False if texels are only read and written one by one: those of integers, and those of buffers.
    pub is_filterable: bool,
}

impl VectorLayout {
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

/// Calls a kernel for a [`TexelCodec`]. Each is compiled on its own.
macro_rules! for_codec {
    ($simd:expr, $codec:expr, $kernel:ident($($argument:expr),*)) => {
        match $codec {
            $crate::texture::texels::TexelCodec::Unorm8 => for_codec!($simd, $kernel, Unorm8, $($argument),*),
            $crate::texture::texels::TexelCodec::Unorm8x2 => for_codec!($simd, $kernel, Unorm8x2, $($argument),*),
            $crate::texture::texels::TexelCodec::Unorm8x4 => for_codec!($simd, $kernel, Unorm8x4, $($argument),*),
            $crate::texture::texels::TexelCodec::Srgb8x4 => for_codec!($simd, $kernel, Srgb8x4, $($argument),*),
            $crate::texture::texels::TexelCodec::Unorm16 => for_codec!($simd, $kernel, Unorm16, $($argument),*),
            $crate::texture::texels::TexelCodec::Float16 => for_codec!($simd, $kernel, Float16, $($argument),*),
            $crate::texture::texels::TexelCodec::Float16x2 => for_codec!($simd, $kernel, Float16x2, $($argument),*),
            $crate::texture::texels::TexelCodec::Float16x4 => for_codec!($simd, $kernel, Float16x4, $($argument),*),
            $crate::texture::texels::TexelCodec::Float32 => for_codec!($simd, $kernel, Float32, $($argument),*),
            $crate::texture::texels::TexelCodec::Float32x2 => for_codec!($simd, $kernel, Float32x2, $($argument),*),
            $crate::texture::texels::TexelCodec::Float32x4 => for_codec!($simd, $kernel, Float32x4, $($argument),*),
        }
    };
    ($simd:expr, $kernel:ident, $codec:ident, $($argument:expr),*) => {
        $simd.vectorize(
            #[inline(always)]
            || $kernel::<S, $crate::texture::texels::$codec>($simd, $($argument),*),
        )
    };
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

    /// The stored components of the texels in column `i` and row `j`, each 0 or 1.
    #[inline(always)]
    pub fn load<S: Simd>(self, simd: S, words: &[AtomicU32], rows: &Rows<'_>, i: usize, j: usize) -> [Floats; 4] {
        for_codec!(simd, self, load(words, rows, i, j))
    }

    /// The weighted mean of all four texels.
    #[inline(always)]
    pub fn bilinear<S: Simd>(
        self,
        simd: S,
        words: &[AtomicU32],
        rows: &Rows<'_>,
        weight_x: &Floats,
        weight_y: &Floats,
    ) -> [Floats; 4] {
        for_codec!(simd, self, bilinear(words, rows, weight_x, weight_y))
    }
}

#[inline(always)]
fn load<S: Simd, T: Texels>(simd: S, words: &[AtomicU32], rows: &Rows<'_>, i: usize, j: usize) -> [Floats; 4] {
    let index = row_start(simd, rows, j) + u32x16::simd_from(simd, rows.x[i]);
    let (first, second) = index.split();
    let first = T::load(simd, words, first);
    let second = T::load(simd, words, second);
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
    /// Texels, compared if that is requested.
    #[inline(always)]
    fn load<T: Texels>(&self, simd: S, words: &[AtomicU32], index: u32x8<S>) -> [f32x8<S>; 4] {
        let mut texels = T::load(simd, words, index);
        if let Some((op, reference)) = self.comparison {
            texels[0] = compare(simd, op, reference, texels[0]);
        }
        texels
    }

    #[inline(always)]
    fn filter<T: Texels>(&self, simd: S, words: &[AtomicU32]) -> [f32x8<S>; 4] {
        let ([top, bottom], [left, right], [x, y]) = (self.rows, self.columns, self.weights);
        let mut upper = self.load::<T>(simd, words, top + left);
        let other = self.load::<T>(simd, words, top + right);
        for c in 0..T::COMPONENTS {
            upper[c] = upper[c] + x * (other[c] - upper[c]);
        }
        let mut lower = self.load::<T>(simd, words, bottom + left);
        let other = self.load::<T>(simd, words, bottom + right);
        for c in 0..T::COMPONENTS {
            lower[c] = lower[c] + x * (other[c] - lower[c]);
            upper[c] = upper[c] + y * (lower[c] - upper[c]);
        }
        upper
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
    /// The number of components that are stored.
    const COMPONENTS: usize;
    /// True if no component is an infinity or NaN.
    const FINITE: bool;

    /// The stored components of texels. Those beyond [`Texels::COMPONENTS`] are zero.
    fn load<S: Simd>(simd: S, words: &[AtomicU32], index: u32x8<S>) -> [f32x8<S>; 4];
}

/// Gathers the bits of texels smaller than a word, and shifts them to the low end.
#[inline(always)]
fn gather_narrow<S: Simd>(simd: S, words: &[AtomicU32], index: u32x8<S>, texels_per_word: u32) -> u32x8<S> {
    let word = gather(simd, words, index >> texels_per_word.trailing_zeros());
    let shift = (index & (texels_per_word - 1)) * (32 / texels_per_word);
    word >> shift
}

/// The linear values of sRGB codes.
static LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| Format::R8Srgb.decode(&[code as u8])[0]));

pub(super) struct Unorm8;

impl Texels for Unorm8 {
    const COMPONENTS: usize = 1;
    const FINITE: bool = true;

    #[inline(always)]
    fn load<S: Simd>(simd: S, words: &[AtomicU32], index: u32x8<S>) -> [f32x8<S>; 4] {
        let zero = f32x8::splat(simd, 0.0);
        let word = gather_narrow(simd, words, index, 4);
        [unorm8_fraction_8(word, 0), zero, zero, zero]
    }
}

pub(super) struct Unorm8x2;

impl Texels for Unorm8x2 {
    const COMPONENTS: usize = 2;
    const FINITE: bool = true;

    #[inline(always)]
    fn load<S: Simd>(simd: S, words: &[AtomicU32], index: u32x8<S>) -> [f32x8<S>; 4] {
        let zero = f32x8::splat(simd, 0.0);
        let word = gather_narrow(simd, words, index, 2);
        [unorm8_fraction_8(word, 0), unorm8_fraction_8(word, 8), zero, zero]
    }
}

pub(super) struct Unorm8x4;

impl Texels for Unorm8x4 {
    const COMPONENTS: usize = 4;
    const FINITE: bool = true;

    #[inline(always)]
    fn load<S: Simd>(simd: S, words: &[AtomicU32], index: u32x8<S>) -> [f32x8<S>; 4] {
        let word = gather(simd, words, index);
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
    const COMPONENTS: usize = 4;
    const FINITE: bool = true;

    #[inline(always)]
    fn load<S: Simd>(simd: S, words: &[AtomicU32], index: u32x8<S>) -> [f32x8<S>; 4] {
        let linear = &*LINEAR;
        let word = gather(simd, words, index);
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
    const COMPONENTS: usize = 1;
    const FINITE: bool = true;

    #[inline(always)]
    fn load<S: Simd>(simd: S, words: &[AtomicU32], index: u32x8<S>) -> [f32x8<S>; 4] {
        let zero = f32x8::splat(simd, 0.0);
        let code = gather_narrow(simd, words, index, 2) & 0xFFFF;
        let code = f32x8::float_from(code.bitcast::<i32x8<S>>());
        [code / 65_535.0, zero, zero, zero]
    }
}

pub(super) struct Float16;

/// The low 16 bits of words as binary16 numbers.
#[inline(always)]
fn float16<S: Simd>(simd: S, bits: u32x8<S>) -> f32x8<S> {
    let splat = |word: u32| u32x8::splat(simd, word);
    let sign = (bits & 0x8000) << 16;
    let half = bits & 0x7FFF;
    // The exponent is in binary32's position, still with binary16's bias.
    let shifted = half << 13;
    let normal = shifted + ((127 - 15) << 23);
    // A denormal number gets a leading one, which is then subtracted. No operand is denormal, because those are slow.
    let least = splat((127 - 14) << 23);
    let denormal = (shifted + least).bitcast::<f32x8<S>>() - least.bitcast::<f32x8<S>>();
    let infinity = splat(0x7C00);
    // The mantissa of a NaN is kept, and the NaN made quiet.
    let quiet = half.simd_gt(infinity).select(splat(1 << 22), splat(0));
    let special = shifted | splat(0x7F80_0000) | quiet;
    let magnitude = half.simd_ge(infinity).select(special, normal);
    let is_denormal = half.simd_lt(splat(0x0400));
    let magnitude = is_denormal.select(denormal.bitcast::<u32x8<S>>(), magnitude);
    (magnitude | sign).bitcast()
}

impl Texels for Float16 {
    const COMPONENTS: usize = 1;
    const FINITE: bool = false;

    #[inline(always)]
    fn load<S: Simd>(simd: S, words: &[AtomicU32], index: u32x8<S>) -> [f32x8<S>; 4] {
        let zero = f32x8::splat(simd, 0.0);
        [float16(simd, gather_narrow(simd, words, index, 2)), zero, zero, zero]
    }
}

pub(super) struct Float16x2;

impl Texels for Float16x2 {
    const COMPONENTS: usize = 2;
    const FINITE: bool = false;

    #[inline(always)]
    fn load<S: Simd>(simd: S, words: &[AtomicU32], index: u32x8<S>) -> [f32x8<S>; 4] {
        let zero = f32x8::splat(simd, 0.0);
        let word = gather(simd, words, index);
        [float16(simd, word), float16(simd, word >> 16), zero, zero]
    }
}

pub(super) struct Float16x4;

impl Texels for Float16x4 {
    const COMPONENTS: usize = 4;
    const FINITE: bool = false;

    #[inline(always)]
    fn load<S: Simd>(simd: S, words: &[AtomicU32], index: u32x8<S>) -> [f32x8<S>; 4] {
        let low = gather(simd, words, index * 2);
        let high = gather(simd, words, index * 2 + 1);
        [float16(simd, low), float16(simd, low >> 16), float16(simd, high), float16(simd, high >> 16)]
    }
}

pub(super) struct Float32;

impl Texels for Float32 {
    const COMPONENTS: usize = 1;
    const FINITE: bool = false;

    #[inline(always)]
    fn load<S: Simd>(simd: S, words: &[AtomicU32], index: u32x8<S>) -> [f32x8<S>; 4] {
        let zero = f32x8::splat(simd, 0.0);
        [gather(simd, words, index).bitcast(), zero, zero, zero]
    }
}

pub(super) struct Float32x2;

impl Texels for Float32x2 {
    const COMPONENTS: usize = 2;
    const FINITE: bool = false;

    #[inline(always)]
    fn load<S: Simd>(simd: S, words: &[AtomicU32], index: u32x8<S>) -> [f32x8<S>; 4] {
        let zero = f32x8::splat(simd, 0.0);
        let first = index * 2;
        [gather(simd, words, first).bitcast(), gather(simd, words, first + 1).bitcast(), zero, zero]
    }
}

pub(super) struct Float32x4;

impl Texels for Float32x4 {
    const COMPONENTS: usize = 4;
    const FINITE: bool = false;

    #[inline(always)]
    fn load<S: Simd>(simd: S, words: &[AtomicU32], index: u32x8<S>) -> [f32x8<S>; 4] {
        let first = index * 4;
        [
            gather(simd, words, first).bitcast(),
            gather(simd, words, first + 1).bitcast(),
            gather(simd, words, first + 2).bitcast(),
            gather(simd, words, first + 3).bitcast(),
        ]
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
                T::load(simd, &atomics, u32x8::simd_from(simd, index)).map(Into::into)
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
