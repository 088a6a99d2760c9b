//! Decoding: the values that integers in memory stand for, in binary64.

use crate::format::Format;
use crate::gaussian::lanes::F32_LANES;
use crate::packet::{AttributeStream, Decoding, RotationDecoding};
use devmem::BufferRange;
use std::f64::consts::FRAC_1_SQRT_2;
use std::sync::Arc;

/// The numbers of a codebook.
pub(super) const CODEBOOK: usize = 256;

/// The value of the constant spherical harmonic.
const Y_0: f64 = 0.28209479177387814;

/// The fourth byte of a quaternion, less the number of its largest component.
const LARGEST_BYTE: u16 = 252;

/// The place of an integer in an element of at most 8 bytes.
#[derive(Clone, Copy)]
pub(super) struct Field {
    /// The number of its lowest bit.
    shift: u32,
    bits: u32,
}

impl Field {
    const fn new(shift: u32, bits: u32) -> Self {
        Self { shift, bits }
    }

    /// The greatest integer of so many bits, at most 16.
    const fn max(self) -> u16 {
        u16::MAX >> (u16::BITS - self.bits)
    }

    #[inline(always)]
    fn code(self, element: u64) -> u16 {
        (element >> self.shift) as u16 & self.max()
    }

    /// The integer's part of the greatest one.
    #[inline(always)]
    fn fraction(self, element: u64) -> f64 {
        f64::from(self.code(element)) / f64::from(self.max())
    }
}

/// The integers of positions and scales in words.
const WORD_OF_LENGTHS: [Field; 3] = [Field::new(21, 11), Field::new(11, 10), Field::new(0, 11)];

/// The integers of colours in words.
const WORD_OF_COLORS: [Field; 3] = [Field::new(24, 8), Field::new(16, 8), Field::new(8, 8)];

/// The places of an attribute's integers in elements of a format, with those of a word if it is one.
fn fields<const COMPONENTS: usize>(format: Format, of_word: [Field; COMPONENTS]) -> [Field; COMPONENTS] {
    if format == Format::R32Uint {
        return of_word;
    }
    let bits = format.components().first().map_or(8, |component| component.bits);
    std::array::from_fn(|component| Field::new(bits * component as u32, bits))
}

/// The number in the first bytes, of which there are as many as it has.
fn number(bytes: &[u8], is_binary64: bool) -> f64 {
    match (is_binary64, bytes) {
        (true, &[a, b, c, d, e, f, g, h, ..]) => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
        (false, &[a, b, c, d, ..]) => f32::from_le_bytes([a, b, c, d]).into(),
        _ => 0.0,
    }
}

const fn number_size(is_binary64: bool) -> usize {
    if is_binary64 { 8 } else { 4 }
}

/// The last step of decoding: the value of a component, as a function of its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Finish {
    /// The number.
    None,
    /// The number whose signed logarithm it is.
    SignedExponential,
    /// The number whose logarithm it is.
    Exponential,
    /// The logistic function.
    Logistic,
    /// The coefficient of a colour, its component of coefficient 0.
    Coefficient,
}

impl Finish {
    /// The value of a number, rounded to binary32.
    #[inline]
    pub(super) fn value(self, number: f64) -> f32 {
        let value = match self {
            Self::None => number,
            Self::SignedExponential => libm::expm1(number.abs()).copysign(number),
            Self::Exponential => libm::exp(number),
            Self::Logistic => 1.0 / (1.0 + libm::exp(-number)),
            Self::Coefficient => (number - 0.5) / Y_0,
        };
        value as f32
    }
}

/// The values of the numbers in a codebook. Those that its buffer does not have are zero.
fn codebook(table: &AttributeStream, is_binary64: bool, finish: Finish) -> [f32; CODEBOOK] {
    let size = number_size(is_binary64);
    let count = usize::try_from(table.buffer.size / size as u64).unwrap_or(CODEBOOK).min(CODEBOOK);
    let mut bytes = [0; 8 * CODEBOOK];
    table.read(0, &mut bytes[..size * count]);
    let mut numbers = [0.0; CODEBOOK];
    for (value, bytes) in numbers.iter_mut().zip(bytes.chunks_exact(size)).take(count) {
        *value = number(bytes, is_binary64);
    }
    numbers.map(|number| finish.value(number))
}

/// The codebooks that a worker has read last. It lives no longer than the reading of a set, in which no table changes.
#[derive(Default)]
pub(crate) struct Codebooks {
    held: Vec<Codebook>,
}

/// A codebook that was read.
struct Codebook {
    table: BufferRange,
    is_binary64: bool,
    finish: Finish,
    values: Arc<[f32; CODEBOOK]>,
}

impl Codebooks {
    /// The most codebooks that are held.
    const MOST: usize = 8;

    /// The values of the numbers in a codebook.
    pub(super) fn values(
        &mut self,
        table: &AttributeStream,
        is_binary64: bool,
        finish: Finish,
    ) -> Arc<[f32; CODEBOOK]> {
        let is_it = |held: &&Codebook| {
            Arc::ptr_eq(&held.table.memory, &table.buffer.memory)
                && (held.table.offset, held.table.size) == (table.buffer.offset, table.buffer.size)
                && (held.is_binary64, held.finish) == (is_binary64, finish)
        };
        if let Some(held) = self.held.iter().find(is_it) {
            return held.values.clone();
        }
        let values = Arc::new(codebook(table, is_binary64, finish));
        if self.held.len() == Self::MOST {
            self.held.remove(0);
        }
        self.held.push(Codebook { table: table.buffer.clone(), is_binary64, finish, values: values.clone() });
        values
    }
}

/// The numbers that an attribute's integers select or lie between.
enum Values<'a, const COMPONENTS: usize> {
    Chunks {
        table: &'a AttributeStream,
        is_binary64: bool,
        /// The vertices of a chunk.
        size: u32,
    },
    /// Finished values.
    Codebook(Arc<[f32; CODEBOOK]>),
}

/// The bounds of a chunk.
#[derive(Clone, Copy)]
pub(super) struct ChunkBounds<const COMPONENTS: usize> {
    /// The chunk's vertices.
    first: u64,
    end: u64,
    low: [f64; COMPONENTS],
    high: [f64; COMPONENTS],
}

impl<const COMPONENTS: usize> ChunkBounds<COMPONENTS> {
    fn has(&self, vertex: u64) -> bool {
        (self.first..self.end).contains(&vertex)
    }
}

/// Decodes an attribute.
pub(super) struct Decoder<'a, const COMPONENTS: usize> {
    fields: [Field; COMPONENTS],
    values: Values<'a, COMPONENTS>,
    finish: Finish,
}

/// An attribute that may be decoded.
pub(super) struct Encoded<'s, 'a> {
    pub(super) stream: &'s AttributeStream,
    pub(super) decoding: Decoding,
    pub(super) table: Option<&'a AttributeStream>,
    pub(super) finish: Finish,
}

impl<'a, const COMPONENTS: usize> Decoder<'a, COMPONENTS> {
    /// The decoder of an attribute whose words have these fields; `None` if nothing is decoded.
    fn new(encoded: &Encoded<'_, 'a>, of_word: [Field; COMPONENTS], codebooks: &mut Codebooks) -> Option<Self> {
        let finish = encoded.finish;
        let values = match (encoded.decoding, encoded.table) {
            (Decoding::None, _) | (_, None) => return None,
            (Decoding::Chunk { size, is_binary64 }, Some(table)) => {
                Values::Chunks { table, is_binary64, size: size.max(1) }
            }
            (Decoding::Codebook { is_binary64 }, Some(table)) => {
                Values::Codebook(codebooks.values(table, is_binary64, finish))
            }
        };
        Some(Self { fields: fields(encoded.stream.format, of_word), values, finish })
    }

    /// The values of the element of `vertex`. `last` are the bounds that were read last, which are not read again.
    pub(super) fn decode(
        &self,
        vertex: u64,
        element: u64,
        last: &mut Option<ChunkBounds<COMPONENTS>>,
    ) -> [f32; COMPONENTS] {
        let mut values = [0.0; COMPONENTS];
        let bounds = self.bounds(vertex, last);
        for (component, value) in values.iter_mut().enumerate() {
            self.decode_component(component, bounds.as_ref(), &[element], std::slice::from_mut(value));
        }
        values
    }

    /// The values of several vertices, of which `vertex` gives the numbers, and `elements` what they hold: an array for each
    /// component.
    pub(super) fn decode_all(
        &self,
        vertex: impl Fn(usize) -> u64,
        elements: &[u64],
        out: &mut [&mut [f32; F32_LANES]; COMPONENTS],
    ) {
        let mut last = None;
        let mut start = 0;
        while start < elements.len() {
            let bounds = self.bounds(vertex(start), &mut last);
            let mut end = elements.len();
            if let Some(bounds) = &bounds {
                end = (start + 1..end).find(|lane| !bounds.has(vertex(*lane))).unwrap_or(end);
            }
            for (component, out) in out.iter_mut().enumerate() {
                self.decode_component(component, bounds.as_ref(), &elements[start..end], &mut out[start..end]);
            }
            start = end;
        }
    }

    /// The values of a component in elements of one chunk, whose bounds are given, or of a codebook.
    fn decode_component(
        &self,
        component: usize,
        bounds: Option<&ChunkBounds<COMPONENTS>>,
        elements: &[u64],
        out: &mut [f32],
    ) {
        let field = self.fields[component];
        match (&self.values, bounds) {
            (Values::Codebook(values), _) => {
                for (value, element) in out.iter_mut().zip(elements) {
                    *value = values[usize::from(field.code(*element)) % CODEBOOK];
                }
            }
            (Values::Chunks { .. }, None) => out.fill(0.0),
            (Values::Chunks { .. }, Some(bounds)) => {
                let (low, high) = (bounds.low[component], bounds.high[component]);
                for (value, element) in out.iter_mut().zip(elements) {
                    let t = field.fraction(*element);
                    *value = self.finish.value(low * (1.0 - t) + high * t);
                }
            }
        }
    }

    /// The bounds of a vertex, which are then the last ones; `None` for a codebook.
    fn bounds(&self, vertex: u64, last: &mut Option<ChunkBounds<COMPONENTS>>) -> Option<ChunkBounds<COMPONENTS>> {
        let Values::Chunks { table, is_binary64, size } = &self.values else {
            return None;
        };
        if !last.is_some_and(|last| last.has(vertex)) {
            let size = u64::from(*size);
            let chunk = vertex / size;
            let [low, high] = bounds(table, *is_binary64, chunk);
            let first = chunk * size;
            *last = Some(ChunkBounds { first, end: first.saturating_add(size), low, high });
        }
        *last
    }
}

/// The minima and the maxima of a chunk; zeros if the table does not have all of them.
fn bounds<const COMPONENTS: usize>(table: &AttributeStream, is_binary64: bool, chunk: u64) -> [[f64; COMPONENTS]; 2] {
    let size = number_size(is_binary64);
    let mut bytes = [0; 8 * 2 * 3];
    let bytes = &mut bytes[..(2 * COMPONENTS * size).min(8 * 2 * 3)];
    table.read(chunk, bytes);
    let at = |index: usize| bytes.get(index * size..).map_or(0.0, |bytes| number(bytes, is_binary64));
    [0, COMPONENTS].map(|first| std::array::from_fn(|component| at(first + component)))
}

impl<'a> Decoder<'a, 3> {
    /// The decoder of positions or scales.
    pub(super) fn of_lengths(encoded: &Encoded<'_, 'a>, codebooks: &mut Codebooks) -> Option<Self> {
        Self::new(encoded, WORD_OF_LENGTHS, codebooks)
    }

    /// The decoder of coefficient 0.
    pub(super) fn of_colors(encoded: &Encoded<'_, 'a>, codebooks: &mut Codebooks) -> Option<Self> {
        Self::new(encoded, WORD_OF_COLORS, codebooks)
    }
}

impl<'a> Decoder<'a, 1> {
    /// The decoder of opacities.
    pub(super) fn of_opacities(encoded: &Encoded<'_, 'a>, codebooks: &mut Codebooks) -> Option<Self> {
        Self::new(encoded, [Field::new(0, 8)], codebooks)
    }
}

/// The quaternion w, x, y, z that an element stands for.
#[inline(always)]
pub(super) fn quaternion(decoding: RotationDecoding, element: u64) -> [f64; 4] {
    let (largest, smaller) = match decoding {
        RotationDecoding::SmallestThree8 => {
            let fields = [Field::new(0, 8), Field::new(8, 8), Field::new(16, 8)];
            match Field::new(24, 8).code(element).checked_sub(LARGEST_BYTE) {
                Some(largest) => (largest, fields),
                None => return [1.0, 0.0, 0.0, 0.0],
            }
        }
        RotationDecoding::None | RotationDecoding::SmallestThree10 => {
            let fields = [Field::new(20, 10), Field::new(10, 10), Field::new(0, 10)];
            (Field::new(30, 2).code(element), fields)
        }
    };
    let component = |field: Field| (2.0 * field.fraction(element) - 1.0) * FRAC_1_SQRT_2;
    let [a, b, c] = [component(smaller[0]), component(smaller[1]), component(smaller[2])];
    let greatest = (1.0 - (a * a + b * b + c * c)).max(0.0).sqrt();
    match largest {
        0 => [greatest, a, b, c],
        1 => [a, greatest, b, c],
        2 => [a, b, greatest, c],
        _ => [a, b, c, greatest],
    }
}
