//! Decoding of spherical harmonics of single lanes.

use super::attributes::GroupVertices;
use super::decoding::{CODEBOOK, ChunkBounds, Codebooks, Decoder, Encoded, Finish};
use crate::gaussian::spherical_harmonics::MAX_COEFFICIENTS;
use crate::packet::{AttributeStream, GaussianAttributes, HarmonicsCodes, HarmonicsDecoding};
use std::cell::Cell;
use std::sync::Arc;

/// The most bytes from the first to the last code of a vertex that are read with one copy: a place among them is a byte.
const SPAN: usize = 256;

/// Decodes the spherical harmonics of a draw.
pub(super) struct HarmonicsDecoder<'a> {
    /// The decoder of coefficient 0, if it is decoded.
    colors: Option<Decoder<'a, 3>>,
    /// The bounds of the chunk whose colours were read last.
    bounds: Cell<Option<ChunkBounds<3>>>,
    codes: Option<CodeReader<'a>>,
}

/// Reads the coefficients after the first from their codes.
struct CodeReader<'a> {
    component_stride: u64,
    /// The codebook in binary32.
    values: Arc<[f32; CODEBOOK]>,
    /// The labels of a palette's entries, if there is one.
    labels: Option<&'a AttributeStream>,
    span: Option<CodeSpan>,
}

/// The places of a vertex's codes, if they lie near one another.
struct CodeSpan {
    /// The bytes from the first code on that have all of them.
    length: usize,
    /// The places of red, green and blue of each coefficient after the first, in these bytes.
    places: [[u8; 3]; MAX_COEFFICIENTS],
}

impl CodeSpan {
    /// The places of the codes of these streams; `None` if they are too far apart, or in several buffers.
    fn new(streams: &[AttributeStream], component_stride: u64) -> Option<Self> {
        let first = streams.first()?;
        let mut span = Self { length: 0, places: [[0; 3]; MAX_COEFFICIENTS] };
        for (places, stream) in span.places.iter_mut().zip(streams) {
            if !Arc::ptr_eq(&stream.buffer.memory, &first.buffer.memory) || stream.buffer.offset != first.buffer.offset
            {
                return None;
            }
            let mut place = u64::from(stream.offset.checked_sub(first.offset)?);
            for of_component in places {
                *of_component = u8::try_from(place).ok()?;
                span.length = span.length.max(usize::from(*of_component) + 1);
                place = place.saturating_add(component_stride);
            }
        }
        Some(span)
    }
}

impl<'a> HarmonicsDecoder<'a> {
    /// The decoder of these attributes' harmonics; `None` if none is decoded.
    pub(super) fn new(attributes: &'a GaussianAttributes, codebooks: &mut Codebooks) -> Option<Self> {
        let tables = attributes.tables.as_deref()?;
        let decodings = &attributes.activations.decodings;
        let mut reader = |codes: HarmonicsCodes, labels| {
            let values = codebooks.values(tables.harmonics.as_ref()?, codes.is_binary64, Finish::None);
            let component_stride = codes.component_stride.into();
            let streams = attributes.spherical_harmonics.get(1..).unwrap_or_default();
            Some(CodeReader { component_stride, values, labels, span: CodeSpan::new(streams, component_stride) })
        };
        let codes = match decodings.harmonics {
            HarmonicsDecoding::None => None,
            HarmonicsDecoding::Codebook(codes) => reader(codes, None),
            HarmonicsDecoding::Palette(codes) => reader(codes, tables.labels.as_ref()),
        };
        let colors = attributes.spherical_harmonics.first().and_then(|stream| {
            let finish = if decodings.base_color { Finish::Coefficient } else { Finish::None };
            let colors = Encoded { stream, decoding: decodings.color, table: tables.color.as_ref(), finish };
            Decoder::of_colors(&colors, codebooks)
        });
        (codes.is_some() || colors.is_some()).then_some(Self { colors, bounds: Cell::default(), codes })
    }

    /// Reads the coefficients of `lane` from the streams: red, green and blue of each in turn.
    pub(super) fn read(&self, streams: &[AttributeStream], group: &GroupVertices<'_>, lane: usize, out: &mut [f32]) {
        let Some((color, rest)) = streams.split_first() else {
            return;
        };
        let [first, others @ ..] = out.as_chunks_mut().0 else {
            return;
        };
        *first = self.color(color, group, lane);
        match &self.codes {
            Some(codes) => codes.read(rest, group, lane, others),
            None => {
                for (stream, out) in rest.iter().zip(others) {
                    *out = group.triple(stream, lane);
                }
            }
        }
    }

    fn color(&self, stream: &AttributeStream, group: &GroupVertices<'_>, lane: usize) -> [f32; 3] {
        let Some(decoder) = &self.colors else {
            return group.triple(stream, lane);
        };
        let mut element = [0; 8];
        let size = stream.format.texel_size().min(8);
        stream.read(group.element(stream, lane), &mut element[..size]);
        let mut bounds = self.bounds.get();
        let color = decoder.decode(group.vertex(lane), u64::from_le_bytes(element), &mut bounds);
        self.bounds.set(bounds);
        color
    }
}

impl CodeReader<'_> {
    /// Reads coefficients from streams of their codes of red.
    fn read(&self, streams: &[AttributeStream], group: &GroupVertices<'_>, lane: usize, out: &mut [[f32; 3]]) {
        let vertex = group.vertex(lane);
        let entry = match self.labels {
            None => Some(vertex),
            Some(labels) => label(labels, vertex),
        };
        let (Some(first), Some(entry)) = (streams.first(), entry) else {
            return out.fill([0.0; 3]);
        };
        let mut bytes = [0_u8; SPAN];
        if let Some(span) = &self.span
            && let Some(place) = first.place(entry, span.length as u64)
            && first.buffer.memory.read(place, &mut bytes[..span.length]).is_ok()
        {
            for (out, places) in out.iter_mut().zip(&span.places) {
                for (out, place) in out.iter_mut().zip(places) {
                    *out = self.values[usize::from(bytes[usize::from(*place)])];
                }
            }
            return;
        }
        for (stream, out) in streams.iter().zip(out) {
            *out = [0, 1, 2].map(|component| match code(stream, entry, component * self.component_stride) {
                Some(code) => self.values[usize::from(code)],
                None => 0.0,
            });
        }
    }
}

/// The entry of a palette that `vertex` has; `None` if its label lies beyond the buffer.
fn label(labels: &AttributeStream, vertex: u64) -> Option<u64> {
    let mut bytes = [0; 2];
    let place = labels.place(vertex, 2)?;
    labels.buffer.memory.read(place, &mut bytes).ok()?;
    Some(u16::from_le_bytes(bytes).into())
}

/// The byte `further` bytes after an element of a stream begins; `None` if it lies beyond the buffer.
fn code(stream: &AttributeStream, element: u64, further: u64) -> Option<u8> {
    let mut byte = [0; 1];
    let start = element.checked_mul(stream.stride.into())?.checked_add(stream.offset.into())?;
    let at = start.checked_add(further)?;
    if at >= stream.buffer.size {
        return None;
    }
    stream.buffer.memory.read(stream.buffer.offset.checked_add(at)?, &mut byte).ok()?;
    Some(byte[0])
}
