//! Decoding: the values that integers in memory stand for, in binary64.

use super::exponential::{fast_exp, fast_exp_m1, round_all};
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

    /// The values of several numbers: those of [`Self::value`], bit for bit.
    pub(super) fn values(self, numbers: &[f64], out: &mut [f32]) {
        let exact = |number| self.value(number);
        match self {
            Self::None | Self::Coefficient => {
                for (out, number) in out.iter_mut().zip(numbers) {
                    *out = self.value(*number);
                }
            }
            Self::SignedExponential => {
                let fast = |number: f64| fast_exp_m1(number.abs()).copysign(number);
                round_all(numbers, out, fast, exact);
            }
            Self::Exponential => round_all(numbers, out, fast_exp, exact),
            Self::Logistic => round_all(numbers, out, |number| 1.0 / (1.0 + fast_exp(-number)), exact),
        }
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
enum Values<'a> {
    Chunks(Chunks<'a>),
    /// Finished values.
    Codebook(Arc<[f32; CODEBOOK]>),
}

/// The table of chunks' bounds.
struct Chunks<'a> {
    table: &'a AttributeStream,
    is_binary64: bool,
    /// The vertices of a chunk.
    size: u32,
}

impl Chunks<'_> {
    /// The bounds of the chunk of a vertex, which are then the last ones.
    fn bounds_of<const COMPONENTS: usize>(
        &self,
        vertex: u64,
        last: &mut Option<ChunkBounds<COMPONENTS>>,
    ) -> ChunkBounds<COMPONENTS> {
        match last {
            Some(bounds) if bounds.has(vertex) => *bounds,
            _ => *last.insert(self.read(vertex / u64::from(self.size))),
        }
    }

    /// Reads the bounds of a chunk. They are zeros if the table does not have all of them.
    fn read<const COMPONENTS: usize>(&self, chunk: u64) -> ChunkBounds<COMPONENTS> {
        let size = number_size(self.is_binary64);
        let mut bytes = [0; 8 * 2 * 3];
        let bytes = &mut bytes[..(2 * COMPONENTS * size).min(8 * 2 * 3)];
        self.table.read(chunk, bytes);
        let at = |index: usize| bytes.get(index * size..).map_or(0.0, |bytes| number(bytes, self.is_binary64));
        let first = chunk * u64::from(self.size);
        ChunkBounds {
            first,
            end: first.saturating_add(self.size.into()),
            low: std::array::from_fn(at),
            high: std::array::from_fn(|component| at(COMPONENTS + component)),
        }
    }
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

    /// The number of a component of an element, which lies between the bounds.
    #[inline(always)]
    fn number(&self, component: usize, field: Field, element: u64) -> f64 {
        let t = field.fraction(element);
        self.low[component] * (1.0 - t) + self.high[component] * t
    }
}

/// Decodes an attribute.
pub(super) struct Decoder<'a, const COMPONENTS: usize> {
    fields: [Field; COMPONENTS],
    values: Values<'a>,
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
                Values::Chunks(Chunks { table, is_binary64, size: size.max(1) })
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
        let mut out = [0.0; COMPONENTS];
        match &self.values {
            Values::Codebook(values) => {
                for (value, field) in out.iter_mut().zip(self.fields) {
                    *value = selected(values, field, element);
                }
            }
            Values::Chunks(chunks) => {
                let bounds = chunks.bounds_of(vertex, last);
                for (component, (value, field)) in out.iter_mut().zip(self.fields).enumerate() {
                    *value = self.finish.value(bounds.number(component, field, element));
                }
            }
        }
        out
    }

    /// The values of several vertices, of which `vertex` gives the numbers, and `elements` what they hold: an array for each
    /// component.
    pub(super) fn decode_all(
        &self,
        vertex: impl Fn(usize) -> u64,
        elements: &[u64],
        out: &mut [&mut [f32; F32_LANES]; COMPONENTS],
    ) {
        match &self.values {
            Values::Codebook(values) => {
                for (out, field) in out.iter_mut().zip(self.fields) {
                    for (value, element) in out.iter_mut().zip(elements) {
                        *value = selected(values, field, *element);
                    }
                }
            }
            Values::Chunks(chunks) => {
                let numbers = self.numbers(chunks, vertex, elements);
                for (out, numbers) in out.iter_mut().zip(&numbers) {
                    self.finish.values(&numbers[..elements.len()], &mut out[..elements.len()]);
                }
            }
        }
    }

    /// The numbers between chunks' bounds of several vertices, as [`Self::decode_all`] has them.
    fn numbers(
        &self,
        chunks: &Chunks<'_>,
        vertex: impl Fn(usize) -> u64,
        elements: &[u64],
    ) -> [[f64; F32_LANES]; COMPONENTS] {
        let mut numbers = [[0.0; F32_LANES]; COMPONENTS];
        let mut last = None;
        let mut start = 0;
        while start < elements.len() {
            let bounds: ChunkBounds<COMPONENTS> = chunks.bounds_of(vertex(start), &mut last);
            let of_chunk = (start + 1..elements.len()).find(|lane| !bounds.has(vertex(*lane)));
            let end = of_chunk.unwrap_or(elements.len());
            for (component, (numbers, field)) in numbers.iter_mut().zip(self.fields).enumerate() {
                for (number, element) in numbers[start..end].iter_mut().zip(&elements[start..end]) {
                    *number = bounds.number(component, field, *element);
                }
            }
            start = end;
        }
        numbers
    }
}

/// The value of a codebook that an element selects.
#[inline(always)]
fn selected(values: &[f32; CODEBOOK], field: Field, element: u64) -> f32 {
    values[usize::from(field.code(element)) % CODEBOOK]
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

#[cfg(test)]
mod tests {
    use super::Finish;

    /// Numbers of all sizes, of which few are near a rounded value's edge, and special ones.
    fn numbers() -> Vec<f64> {
        let mut state = 1_u64;
        let mut random = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut numbers =
            vec![0.0, -0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e308, -1e308, 5e-324, 88.8, -103.9];
        for _ in 0..100_000 {
            numbers.push(40.0 * (random() - 0.5));
            numbers.push(220.0 * (random() - 0.5));
            numbers.push((random() - 0.5) * libm::ldexp(1.0, -(160.0 * random()) as i32));
        }
        // Logarithms of numbers in the middle between two of binary32, where only the exact function can round.
        for step in 0..1000 {
            let low = f32::from_bits(0x3F80_0000 + step * 8191);
            let middle = (f64::from(low) + f64::from(low.next_up())) / 2.0;
            numbers.extend([libm::log(middle), libm::log1p(middle), -libm::log1p(middle)]);
        }
        numbers
    }

    #[gaurast_runner::test]
    fn values_of_many_numbers_are_those_of_each() {
        let numbers = numbers();
        let finishes =
            [Finish::None, Finish::SignedExponential, Finish::Exponential, Finish::Logistic, Finish::Coefficient];
        for finish in finishes {
            let mut values = vec![0.0; numbers.len()];
            finish.values(&numbers, &mut values);
            for (number, value) in numbers.iter().zip(values) {
                let expected = finish.value(*number);
                let is_equal = value.to_bits() == expected.to_bits() || value.is_nan() && expected.is_nan();
                assert!(is_equal, "{finish:?} of {number:e}: {value:e}, not {expected:e}");
            }
        }
    }
}
