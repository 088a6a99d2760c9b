//! Spherical harmonics of single lanes: read from memory, or held by a cluster.

use super::attributes::GroupVertices;
use super::decoding::Codebooks;
use super::harmonics_decoding::HarmonicsDecoder;
use crate::format::Format;
use crate::gaussian::spherical_harmonics::{COEFFICIENT_FLOATS, MAX_COEFFICIENTS};
use crate::packet::{AttributeStream, GaussianAttributes};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// The byte offset in `stream`'s buffer of the element that lane `lane` reads.
fn at(stream: &AttributeStream, group: &GroupVertices<'_>, lane: usize) -> u64 {
    group.element(stream, lane).saturating_mul(u64::from(stream.stride)).saturating_add(u64::from(stream.offset))
}

/// The number of floats in a vertex's coefficients, of which each has a stream: three for each coefficient.
pub(super) fn floats(streams: &[AttributeStream]) -> usize {
    3 * streams.len().min(MAX_COEFFICIENTS)
}

/// Reads the spherical harmonics of single lanes.
pub(crate) struct CoefficientReader<'a> {
    streams: &'a [AttributeStream],
    /// True if the coefficients of a vertex follow one another in memory as 32-bit floats.
    packed: bool,
    /// The decoder of the coefficients, if some are decoded.
    decoder: Option<HarmonicsDecoder<'a>>,
}

impl<'a> CoefficientReader<'a> {
    /// A reader of these attributes' spherical harmonics, which have a stream per coefficient.
    pub(crate) fn new(attributes: &'a GaussianAttributes, codebooks: &mut Codebooks) -> Self {
        let streams = &attributes.spherical_harmonics[..];
        let follows = |a: &AttributeStream, b: &AttributeStream| {
            Arc::ptr_eq(&a.buffer.memory, &b.buffer.memory)
                && a.buffer.offset == b.buffer.offset
                && a.buffer.size == b.buffer.size
                && a.stride == b.stride
                && a.instance_divisor == b.instance_divisor
                && b.format == Format::R32G32B32Sfloat
                && a.offset.checked_add(12) == Some(b.offset)
        };
        let packed = streams.first().is_some_and(|s| s.format == Format::R32G32B32Sfloat)
            && streams.windows(2).all(|pair| follows(&pair[0], &pair[1]));
        Self { streams, packed, decoder: HarmonicsDecoder::new(attributes, codebooks) }
    }

    /// The number of floats in a vertex's coefficients.
    pub(crate) fn floats(&self) -> usize {
        floats(self.streams)
    }

    /// Starts to load the first `count` coefficients of `lane` into the processor's cache, if they are packed.
    #[inline(always)]
    pub(crate) fn prefetch(&self, group: &GroupVertices<'_>, lane: usize, count: usize) {
        if let Some(stream) = self.streams.first().filter(|_| self.packed) {
            let start = stream.buffer.offset.saturating_add(at(stream, group, lane));
            let count = count.min(self.streams.len());
            stream.buffer.memory.prefetch(start, 12 * count);
        }
    }

    /// Reads the coefficients of `lane`: red, green and blue of each in turn.
    pub(crate) fn read(&self, group: &GroupVertices<'_>, lane: usize, out: &mut [f32; COEFFICIENT_FLOATS]) {
        let at = |stream| at(stream, group, lane);
        let count = self.streams.len().min(MAX_COEFFICIENTS);
        let out = &mut out[..3 * count];
        if self.packed {
            let stream = &self.streams[0];
            let start = at(stream);
            let size = size_of_val(out) as u64;
            let inside = start.checked_add(size).is_some_and(|end| end <= stream.buffer.size);
            if inside && stream.buffer.memory.read(stream.buffer.offset.saturating_add(start), out).is_ok() {
                return;
            }
        }
        if let Some(decoder) = &self.decoder {
            return decoder.read(self.streams, group, lane, out);
        }
        for (stream, out) in self.streams.iter().zip(out.as_chunks_mut().0) {
            *out = group.triple(stream, lane);
        }
    }
}

/// Spherical harmonics in host memory: those of all lanes, one lane after the other, or none.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Harmonics<'a> {
    floats: &'a [f32],
    /// The number of floats per lane. A draw of a lower degree uses the first of them.
    stride: usize,
}

impl<'a> Harmonics<'a> {
    /// The harmonics of lanes of `stride` floats each.
    pub(crate) fn new(floats: &'a [f32], stride: usize) -> Self {
        Self { floats, stride }
    }

    /// The floats from the given lane's first on, or an empty slice if there are none.
    #[inline(always)]
    pub(crate) fn from(&self, lane: usize) -> &'a [f32] {
        self.floats.get(lane * self.stride..).unwrap_or_default()
    }

    /// The given lane's first `count` floats and those after it, if there are so many.
    #[inline(always)]
    pub(crate) fn first(&self, lane: usize, count: usize) -> Option<&'a [f32]> {
        let start = lane * self.stride;
        self.floats.get(start..start + count)
    }

    /// The floats of a range of lanes, if they are held and a lane has at most `most`.
    #[inline(always)]
    pub(crate) fn of_all(&self, lanes: RangeInclusive<usize>, most: usize) -> Option<&'a [f32]> {
        let (first, end) = (*lanes.start(), *lanes.end() + 1);
        let are_there = (1..=most).contains(&self.stride);
        self.floats.get(first * self.stride..end * self.stride).filter(|_| are_there)
    }
}
