//! Colour attachments: blends 16 fragments at a time or applies a logic operation, then the write mask, and encodes
//! them in the attachment's format. Tests compare it with a naive reference for one fragment.

use super::tile::AREA;
use super::tile_buffer::QuadAddresses;
use crate::format::unorm8::{Colors, clamp, pack_unorm8, pack_unorm8_in_range, unpack_unorm8};
use crate::format::{Component, Format, MAX_TEXEL_SIZE, Numeric};
use crate::simd::{as_floats, bits_of, floats_of};
use crate::state::{BlendEquation, BlendEquations, BlendFactor, BlendOp, BlendState, LogicOp};
use fearless_simd::{Simd, f32x16, prelude::*, u32x16};
use isa::Vector;

/// The operations by which a draw writes to a colour attachment.
#[derive(Clone, Debug)]
pub struct ColorOutput {
    format: Format,
    codec: Codec,
    equations: Option<BlendEquations>,
    /// The kernel for the equations, if there is one.
    over: Option<Over>,
    constants: [f32; 4],
    /// The range to which sources and constants are clamped before blending.
    range: Option<(f32, f32)>,
    logic: Option<LogicOp>,
    /// The bits of a texel that are written, as a little-endian number.
    written: u128,
}

/// The usual equations, source over destination, for which there are kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Over {
    /// For a source whose colour is already multiplied by its alpha.
    Premultiplied,
    /// For a source that is not. Alpha is blended as the colours are.
    Straight,
}

/// A kernel that blends by one of the usual equations and writes all components.
#[derive(Clone, Copy, Debug)]
pub enum OverKernel {
    /// For texels of four bytes.
    Unorm8 { over: Over, bgra: bool },
    /// For texels of four floats.
    Words { over: Over },
}

/// The equation `source * factor + destination * (1 - alpha)`.
const fn over(source: BlendFactor) -> BlendEquation {
    BlendEquation { source, destination: BlendFactor::OneMinusSrcAlpha, op: BlendOp::Add }
}
const PREMULTIPLIED: BlendEquation = over(BlendFactor::One);
const STRAIGHT: BlendEquation = over(BlendFactor::SrcAlpha);

impl Over {
    fn of(equations: BlendEquations) -> Option<Self> {
        if equations == BlendEquations::both(PREMULTIPLIED) {
            Some(Self::Premultiplied)
        } else if equations == BlendEquations::both(STRAIGHT) {
            Some(Self::Straight)
        } else {
            None
        }
    }
}

/// The range to which colours are clamped before they are blended in a format.
pub(super) fn clamp_range(format: Format) -> Option<(f32, f32)> {
    match format.numeric() {
        Numeric::Unorm | Numeric::Srgb => Some((0.0, 1.0)),
        Numeric::Snorm => Some((-1.0, 1.0)),
        _ => None,
    }
}

/// The way texels are read and written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Codec {
    /// Four bytes from 0 to 1, red first or, if `bgra`, blue first.
    Unorm8 { bgra: bool },
    /// Four 32-bit words, unchanged.
    Words,
    /// One 32-bit word for red, unchanged.
    Word,
    /// Converted by [`Format`].
    Other,
}

impl ColorOutput {
    /// The output to an attachment of `format`; `None` if the state never changes it.
    pub fn new(state: &BlendState, logic: Option<LogicOp>, constants: [f32; 4], format: Format) -> Option<Self> {
        let written = written_bits(format, state.write_mask);
        // An enabled logic operation disables blending even for formats to which it does not apply.
        let blends = logic.is_none() && !format.is_integer();
        let logic = logic
            .filter(|_| matches!(format.numeric(), Numeric::Unorm | Numeric::Snorm | Numeric::Uint | Numeric::Sint));
        let range = clamp_range(format);
        let codec = match format {
            _ if logic.is_some() => Codec::Other,
            Format::R8G8B8A8Unorm | Format::A8B8G8R8UnormPack32 => Codec::Unorm8 { bgra: false },
            Format::B8G8R8A8Unorm => Codec::Unorm8 { bgra: true },
            Format::R32G32B32A32Sfloat | Format::R32G32B32A32Uint | Format::R32G32B32A32Sint => Codec::Words,
            Format::R32Sfloat | Format::R32Uint | Format::R32Sint => Codec::Word,
            _ => Codec::Other,
        };
        let equations = state.equations.filter(|_| blends);
        (written != 0).then_some(Self {
            format,
            codec,
            equations,
            over: equations.and_then(Over::of),
            constants: match range {
                Some((low, high)) => constants.map(|constant| constant.clamp(low, high)),
                None => constants,
            },
            range,
            logic,
            written,
        })
    }

    /// True if every texel is replaced as a whole, independent of its old value.
    pub fn overwrites(&self) -> bool {
        self.equations.is_none() && self.logic.is_none() && self.written == written_bits(self.format, 0xF)
    }

    /// The kernel that does what [`ColorOutput::write`] does, if there is one.
    pub fn over_kernel(&self) -> Option<OverKernel> {
        match (self.codec, self.over?) {
            (Codec::Unorm8 { bgra }, over) if self.written as u32 == u32::MAX => {
                Some(OverKernel::Unorm8 { over, bgra })
            }
            (Codec::Words, over) if self.written == u128::MAX && self.range.is_none() => {
                Some(OverKernel::Words { over })
            }
            _ => None,
        }
    }

    /// True if blending uses the second source.
    pub fn is_dual_source(&self) -> bool {
        let dual = |factor| {
            matches!(
                factor,
                BlendFactor::Src1Color
                    | BlendFactor::OneMinusSrc1Color
                    | BlendFactor::Src1Alpha
                    | BlendFactor::OneMinusSrc1Alpha
            )
        };
        self.equations.is_some_and(|BlendEquations { color, alpha }| {
            [color, alpha].iter().any(|equation| dual(equation.source) || dual(equation.destination))
        })
    }

    /// Blends fragments into the texels of a tile buffer. `words` is its memory.
    #[inline(always)]
    fn write<S: Simd>(
        &self,
        simd: S,
        source: &Colors<S>,
        second: &Colors<S>,
        lanes: u16,
        quads: &QuadAddresses,
        words: &mut [u32],
    ) {
        match self.codec {
            Codec::Unorm8 { bgra } => {
                let written = self.written as u32;
                let mut packed;
                if let Some(equations) = self.equations {
                    let stored = u32x16::simd_from(simd, quads.load(words));
                    let destination = unpack_unorm8(simd, stored, bgra);
                    if let Some(over) = self.over {
                        let blended = blend_over_in_range(simd, over, source, &destination);
                        packed = pack_unorm8_in_range(simd, &blended, bgra);
                    } else {
                        let blended = self.blend(simd, equations, source, second, &destination);
                        packed = pack_unorm8(simd, &blended, bgra);
                    }
                } else {
                    packed = pack_unorm8(simd, source, bgra);
                }
                if written != u32::MAX {
                    let stored = u32x16::simd_from(simd, quads.load(words));
                    packed = (packed & written) | (stored & !written);
                }
                quads.store(words, lanes, &packed.into());
            }
            Codec::Word => {
                let [red, ..] = match self.equations {
                    None => *source,
                    Some(equations) => {
                        let stored = u32x16::simd_from(simd, quads.load(words));
                        let mut destination = [f32x16::splat(simd, 0.0); 4];
                        destination[0] = stored.bitcast();
                        destination[3] = f32x16::splat(simd, 1.0);
                        self.blend(simd, equations, source, second, &destination)
                    }
                };
                quads.store(words, lanes, &bits_of(red).into());
            }
            Codec::Words => self.write_words(simd, source, second, lanes, quads, words),
            Codec::Other => self.write_other(simd, source, second, lanes, quads, words),
        }
    }

    /// Blends fragments as [`ColorOutput::write`] does, which this compiles once a SIMD level.
    #[inline(never)]
    pub fn write_shared<S: Simd>(
        &self,
        simd: S,
        source: &Colors<S>,
        second: &Colors<S>,
        lanes: u16,
        quads: &QuadAddresses,
        words: &mut [u32],
    ) {
        simd.vectorize(
            #[inline(always)]
            || self.write(simd, source, second, lanes, quads, words),
        );
    }

    /// Blends the fragments of a fully covered tile into its texels, from number `first` on in a tile buffer. `words`
    /// is its memory.
    #[inline(always)]
    pub fn write_tile<S: Simd>(&self, simd: S, sources: &[[&[Vector]; 4]; 2], first: usize, words: &mut [u32]) {
        let dual = self.is_dual_source();
        if let Codec::Unorm8 { bgra } = self.codec
            && self.written as u32 == u32::MAX
            && (self.equations.is_none() || self.over.is_some())
        {
            let blocks = words[first..first + AREA].as_chunks_mut::<16>().0;
            for (chunk, texels) in blocks.iter_mut().enumerate() {
                let source = load(simd, &sources[0], chunk);
                let packed = match self.over {
                    None => pack_unorm8(simd, &source, bgra),
                    Some(over) => {
                        let stored = u32x16::simd_from(simd, *texels);
                        let destination = unpack_unorm8(simd, stored, bgra);
                        let blended = blend_over_in_range(simd, over, &source, &destination);
                        pack_unorm8_in_range(simd, &blended, bgra)
                    }
                };
                *texels = packed.into();
            }
            return;
        }
        for chunk in 0..AREA / 16 {
            let source = load(simd, &sources[0], chunk);
            let mut second = [f32x16::splat(simd, 0.0); 4];
            if dual {
                second = load(simd, &sources[1], chunk);
            }
            let quads = QuadAddresses::block(first + 16 * chunk);
            self.write_shared(simd, &source, &second, u16::MAX, &quads, words);
        }
    }

    /// The words that replace a tile buffer's texels; `None` if the old texels matter, or texels are not words.
    #[inline(always)]
    pub fn replacement<S: Simd>(&self, simd: S, source: &Colors<S>) -> Option<[u32; 16]> {
        match self.codec {
            Codec::Unorm8 { bgra } if self.equations.is_none() && self.written as u32 == u32::MAX => {
                Some(pack_unorm8(simd, source, bgra).into())
            }
            _ => None,
        }
    }

    /// Blends fragments into texels of four words.
    #[inline(always)]
    fn write_words<S: Simd>(
        &self,
        simd: S,
        source: &Colors<S>,
        second: &Colors<S>,
        lanes: u16,
        quads: &QuadAddresses,
        words: &mut [u32],
    ) {
        let blended = match self.equations {
            None => *source,
            Some(equations) => {
                let destination = load_texels(simd, words, quads);
                self.blend(simd, equations, source, second, &destination)
            }
        };
        store_texels(simd, &blended, words, quads, lanes, self.written);
    }

    /// Blends fragments into texels of any format.
    #[inline(always)]
    fn write_other<S: Simd>(
        &self,
        simd: S,
        source: &Colors<S>,
        second: &Colors<S>,
        lanes: u16,
        quads: &QuadAddresses,
        words: &mut [u32],
    ) {
        let size = self.format.texel_size();
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(words);
        let blended = match self.equations {
            None => *source,
            Some(equations) => {
                let destination = transpose(decode(self.format, bytes, quads));
                let [r, g, b, a] = destination;
                let load = |component| f32x16::simd_from(simd, component);
                let destination = [load(r), load(g), load(b), load(a)];
                self.blend(simd, equations, source, second, &destination)
            }
        };
        let [r, g, b, a] = blended;
        let texels = [r.into(), g.into(), b.into(), a.into()];
        self.store_other(&texels, lanes, quads, bytes, size);
    }

    #[inline(never)]
    fn store_other(
        &self,
        components: &[[f32; 16]; 4],
        lanes: u16,
        quads: &QuadAddresses,
        bytes: &mut [u8],
        size: usize,
    ) {
        let mut encoded = [0; 16 * MAX_TEXEL_SIZE];
        let texels: [[f32; 4]; 16] = std::array::from_fn(|lane| components.each_ref().map(|component| component[lane]));
        self.format.encode_row(&texels, &mut encoded[..16 * size]);
        for lane in 0..16 {
            if lanes >> lane & 1 == 0 {
                continue;
            }
            let stored = &mut bytes[quads.texel(lane) * size..][..size];
            let (mut s, mut d) = ([0; MAX_TEXEL_SIZE], [0; MAX_TEXEL_SIZE]);
            s[..size].copy_from_slice(&encoded[lane * size..][..size]);
            d[..size].copy_from_slice(stored);
            let (s, d) = (u128::from_le_bytes(s), u128::from_le_bytes(d));
            let value = self.logic.map_or(s, |op| logic(op, s, d));
            let value = value & self.written | d & !self.written;
            stored.copy_from_slice(&value.to_le_bytes()[..size]);
        }
    }

    /// Evaluates the blend equations for colour and for alpha.
    #[inline(always)]
    fn blend<S: Simd>(
        &self,
        simd: S,
        equations: BlendEquations,
        source: &Colors<S>,
        second: &Colors<S>,
        destination: &Colors<S>,
    ) -> Colors<S> {
        match self.over {
            Some(over) if self.range.is_none() => blend_over(simd, over, source, destination),
            _ => self.blend_by_any(simd, equations, *source, *second, *destination),
        }
    }

    /// Blends by any equations. They are so many that this is compiled once a SIMD level, not wherever colours are written.
    #[inline(never)]
    fn blend_by_any<S: Simd>(
        &self,
        simd: S,
        equations: BlendEquations,
        source: Colors<S>,
        second: Colors<S>,
        destination: Colors<S>,
    ) -> Colors<S> {
        simd.vectorize(
            #[inline(always)]
            || {
                let (mut source, mut second) = (source, second);
                if let Some((low, high)) = self.range {
                    for component in source.iter_mut().chain(&mut second) {
                        *component = clamp(simd, *component, low, high);
                    }
                }
                let operands = Operands { source, second, destination, constants: self.constants };
                let BlendEquations { color, alpha } = equations;
                let mut blended = source;
                for (component, value) in blended.iter_mut().enumerate() {
                    let equation = if component == 3 { alpha } else { color };
                    *value = operands.evaluate(simd, equation, component);
                }
                blended
            },
        )
    }
}

/// The components of 16 texels of four words.
#[inline(always)]
fn load_texels<S: Simd>(simd: S, words: &[u32], quads: &QuadAddresses) -> Colors<S> {
    let texels = words.as_chunks::<16>().0;
    let load = |quad: usize| floats_of(u32x16::simd_from(simd, texels[quads.first[quad] / 4]));
    let (rb, ga) = load(0).deinterleave(load(1));
    let (rb_later, ga_later) = load(2).deinterleave(load(3));
    let ((r, b), (g, a)) = (rb.deinterleave(rb_later), ga.deinterleave(ga_later));
    [r, g, b, a]
}

/// Stores those components of texels of four words whose bits are in `written`, in some lanes.
#[inline(always)]
fn store_texels<S: Simd>(
    simd: S,
    components: &Colors<S>,
    words: &mut [u32],
    quads: &QuadAddresses,
    lanes: u16,
    written: u128,
) {
    let words = words.as_chunks_mut::<16>().0;
    for (quad, texels) in texels_of(components).into_iter().enumerate() {
        let stored = &mut words[quads.first[quad] / 4];
        let covered = lanes >> (4 * quad) & 15;
        if covered == 15 && written == u128::MAX {
            *stored = texels.into();
        } else if covered != 0 {
            // Another quad of the vector may have the same address and other lanes.
            let mask = match written {
                u128::MAX => TEXEL_MASKS[usize::from(covered)],
                _ => written_words(covered, written),
            };
            let mask = u32x16::simd_from(simd, mask);
            *stored = ((texels & mask) | (u32x16::simd_from(simd, *stored) & !mask)).into();
        }
    }
}

/// Stores texels of four words, in all lanes of those quads that have some of `lanes`.
#[inline(always)]
fn store_whole<S: Simd>(components: &Colors<S>, words: &mut [u32], quads: &QuadAddresses, lanes: u16) {
    let words = words.as_chunks_mut::<16>().0;
    for (quad, texels) in texels_of(components).into_iter().enumerate() {
        if lanes >> (4 * quad) & 15 != 0 {
            words[quads.first[quad] / 4] = texels.into();
        }
    }
}

/// The texels of four words of each quad.
#[inline(always)]
fn texels_of<S: Simd>([r, g, b, a]: &Colors<S>) -> [u32x16<S>; 4] {
    let ((rb, rb_later), (ga, ga_later)) = (r.interleave(*b), g.interleave(*a));
    let (first, second) = rb.interleave(ga);
    let (third, fourth) = rb_later.interleave(ga_later);
    [bits_of(first), bits_of(second), bits_of(third), bits_of(fourth)]
}

/// The bits that are written of the four words of each texel of a quad.
#[inline(always)]
const fn written_words(covered: u16, written: u128) -> [u32; 16] {
    let mut words = [0; 16];
    let mut word = 0;
    while word < 16 {
        if covered >> (word / 4) & 1 == 1 {
            words[word] = (written >> (32 * (word % 4))) as u32;
        }
        word += 1;
    }
    words
}

/// A mask of four words a texel for each set of lanes of a quad: all ones in those lanes.
const TEXEL_MASKS: [[u32; 16]; 16] = {
    let mut masks = [[0; 16]; 16];
    let mut set = 0;
    while set < 16 {
        masks[set] = written_words(set as u16, u128::MAX);
        set += 1;
    }
    masks
};

/// A source of 16 fragments. Components that the program does not write are 0.
#[inline(always)]
pub fn load<S: Simd>(simd: S, source: &[&[Vector]; 4], chunk: usize) -> Colors<S> {
    let mut color = [f32x16::splat(simd, 0.0); 4];
    for (component, lanes) in color.iter_mut().zip(source) {
        if let Some(lanes) = lanes.get(chunk) {
            *component = as_floats(simd, lanes);
        }
    }
    color
}

/// The operands of blend equations.
struct Operands<S: Simd> {
    source: Colors<S>,
    second: Colors<S>,
    destination: Colors<S>,
    constants: [f32; 4],
}

impl<S: Simd> Operands<S> {
    /// Evaluates the equation of one component.
    #[inline(always)]
    fn evaluate(&self, simd: S, equation: BlendEquation, component: usize) -> f32x16<S> {
        let (s, d) = (self.source[component], self.destination[component]);
        match equation.op {
            BlendOp::Min => s.min(d),
            BlendOp::Max => s.max(d),
            BlendOp::Add => {
                self.term(simd, s, equation.source, component) + self.term(simd, d, equation.destination, component)
            }
            BlendOp::Subtract => {
                self.term(simd, s, equation.source, component) - self.term(simd, d, equation.destination, component)
            }
            BlendOp::ReverseSubtract => {
                self.term(simd, d, equation.destination, component) - self.term(simd, s, equation.source, component)
            }
        }
    }

    /// A value times its factor. A factor of zero gives zero even for infinities and NaN.
    #[inline(always)]
    fn term(&self, simd: S, value: f32x16<S>, by: BlendFactor, component: usize) -> f32x16<S> {
        match by {
            BlendFactor::Zero => f32x16::splat(simd, 0.0),
            BlendFactor::One => value,
            _ => value * self.factor(simd, by, component),
        }
    }

    #[inline(always)]
    fn factor(&self, simd: S, factor: BlendFactor, component: usize) -> f32x16<S> {
        let splat = |value: f32| f32x16::splat(simd, value);
        let one = splat(1.0);
        match factor {
            BlendFactor::Zero => splat(0.0),
            BlendFactor::One => one,
            BlendFactor::SrcColor => self.source[component],
            BlendFactor::OneMinusSrcColor => one - self.source[component],
            BlendFactor::DstColor => self.destination[component],
            BlendFactor::OneMinusDstColor => one - self.destination[component],
            BlendFactor::SrcAlpha => self.source[3],
            BlendFactor::OneMinusSrcAlpha => one - self.source[3],
            BlendFactor::DstAlpha => self.destination[3],
            BlendFactor::OneMinusDstAlpha => one - self.destination[3],
            BlendFactor::ConstantColor => splat(self.constants[component]),
            BlendFactor::OneMinusConstantColor => splat(1.0 - self.constants[component]),
            BlendFactor::ConstantAlpha => splat(self.constants[3]),
            BlendFactor::OneMinusConstantAlpha => splat(1.0 - self.constants[3]),
            BlendFactor::SrcAlphaSaturate if component == 3 => one,
            BlendFactor::SrcAlphaSaturate => self.source[3].min(one - self.destination[3]),
            BlendFactor::Src1Color => self.second[component],
            BlendFactor::OneMinusSrc1Color => one - self.second[component],
            BlendFactor::Src1Alpha => self.second[3],
            BlendFactor::OneMinusSrc1Alpha => one - self.second[3],
        }
    }
}

/// Blends fragments into texels of four bytes.
#[inline(always)]
pub fn blend_bytes_over<S: Simd>(
    simd: S,
    over: Over,
    bgra: bool,
    source: &Colors<S>,
    lanes: u16,
    quads: &QuadAddresses,
    words: &mut [u32],
) {
    let stored = u32x16::simd_from(simd, quads.load(words));
    let blended = blend_over_in_range(simd, over, source, &unpack_unorm8(simd, stored, bgra));
    let packed = pack_unorm8_in_range(simd, &blended, bgra);
    if quads.distinct {
        let mask = simd.from_bitmask_mask32x16(lanes.into());
        quads.store_whole(words, lanes, &mask.select(packed, stored).into());
    } else {
        quads.store(words, lanes, &packed.into());
    }
}

/// Blends fragments into texels of four floats.
#[inline(always)]
pub fn blend_words_over<S: Simd>(
    simd: S,
    over: Over,
    source: &Colors<S>,
    lanes: u16,
    quads: &QuadAddresses,
    words: &mut [u32],
) {
    let destination = load_texels(simd, words, quads);
    let mut blended = blend_over(simd, over, source, &destination);
    if quads.distinct {
        let mask = simd.from_bitmask_mask32x16(lanes.into());
        for (component, stored) in blended.iter_mut().zip(destination) {
            *component = mask.select(*component, stored);
        }
        store_whole(&blended, words, quads, lanes);
    } else {
        store_texels(simd, &blended, words, quads, lanes, u128::MAX);
    }
}

/// Blends components, clamped to 0 to 1, by one of the usual equations. The result may exceed 1 by rounding only. Stored texels
/// have the same bits as with [`ColorOutput::blend`].
#[inline(always)]
fn blend_over_in_range<S: Simd>(simd: S, over: Over, source: &Colors<S>, destination: &Colors<S>) -> Colors<S> {
    let mut source = *source;
    for component in &mut source {
        *component = clamp(simd, *component, 0.0, 1.0);
    }
    let mut blended = blend_over(simd, over, &source, destination);
    if over == Over::Premultiplied {
        // The source may be brighter than its alpha permits.
        for component in &mut blended {
            *component = component.min(1.0);
        }
    }
    blended
}

/// Blends by one of the usual equations, without clamping.
#[inline(always)]
fn blend_over<S: Simd>(simd: S, over: Over, source: &Colors<S>, destination: &Colors<S>) -> Colors<S> {
    let mut blended = *source;
    let alpha = source[3];
    let rest = f32x16::splat(simd, 1.0) - alpha;
    for (component, destination) in blended.iter_mut().zip(destination) {
        *component = match over {
            Over::Premultiplied => *component + *destination * rest,
            Over::Straight => *component * alpha + *destination * rest,
        };
    }
    blended
}

/// Decodes the texels of 16 lanes.
#[inline(never)]
fn decode(format: Format, bytes: &[u8], quads: &QuadAddresses) -> [[f32; 4]; 16] {
    let size = format.texel_size();
    let mut stored = [0; 16 * MAX_TEXEL_SIZE];
    for (lane, texel) in stored[..16 * size].chunks_exact_mut(size).enumerate() {
        texel.copy_from_slice(&bytes[quads.texel(lane) * size..][..size]);
    }
    let mut out = [[0.0; 4]; 16];
    format.decode_row(&stored[..16 * size], &mut out);
    out
}

fn transpose(texels: [[f32; 4]; 16]) -> [[f32; 16]; 4] {
    std::array::from_fn(|component| texels.map(|texel| texel[component]))
}

/// The bits of a texel that a write mask enables.
fn written_bits(format: Format, write_mask: u8) -> u128 {
    let (mut bits, mut shift) = (0, 0);
    for &Component { channel, bits: width } in format.components() {
        let written = channel.register().is_some_and(|register| write_mask >> register & 1 == 1);
        // The shared exponent belongs to all components, so that they can only be written together.
        if written || channel.register().is_none() && write_mask & 7 == 7 {
            bits |= (u128::MAX >> (128 - width)) << shift;
        }
        shift += width;
    }
    bits
}

/// A logic operation, applied bit by bit.
fn logic(op: LogicOp, s: u128, d: u128) -> u128 {
    match op {
        LogicOp::Clear => 0,
        LogicOp::And => s & d,
        LogicOp::AndReverse => s & !d,
        LogicOp::Copy => s,
        LogicOp::AndInverted => !s & d,
        LogicOp::NoOp => d,
        LogicOp::Xor => s ^ d,
        LogicOp::Or => s | d,
        LogicOp::Nor => !(s | d),
        LogicOp::Equivalent => !(s ^ d),
        LogicOp::Invert => !d,
        LogicOp::OrReverse => s | !d,
        LogicOp::CopyInverted => !s,
        LogicOp::OrInverted => !s | d,
        LogicOp::Nand => !(s & d),
        LogicOp::Set => u128::MAX,
    }
}

#[cfg(test)]
mod tests;
