//! The resources of a program outside its registers: buffers, push constants, images, global memory.

use std::sync::atomic::{AtomicU32, Ordering};

use crate::ir::{AtomicOp, ImageShape, VECTOR_LANES};
use devmem::BufferRange;

/// The buffers, push constants, images and device addresses that a program uses while it runs.
#[derive(Clone, Copy)]
pub struct Resources<'a> {
    /// Buffers by bind point. A bind point that is None or beyond the end is a buffer of size zero. Offsets are
    /// multiples of 4.
    pub buffers: &'a [Option<BufferRange>],
    /// Push constants, as [`words`] makes them.
    pub push_constants: &'a [AtomicU32],
    /// Images and samplers.
    pub images: &'a dyn ImageUnit,
    /// Device addresses.
    pub global: &'a dyn GlobalMemory,
}

impl Default for Resources<'_> {
    fn default() -> Self {
        Self { buffers: &[], push_constants: &[], images: &NoImages, global: &NoGlobalMemory }
    }
}

/// Bytes as the words that [`Resources::push_constants`] holds; the last is filled up with zeros.
pub fn words(bytes: &[u8]) -> Vec<AtomicU32> {
    bytes
        .chunks(4)
        .map(|chunk| {
            let mut word = [0; 4];
            word[..chunk.len()].copy_from_slice(chunk);
            AtomicU32::new(u32::from_le_bytes(word))
        })
        .collect()
}

/// Maps device addresses of 64 bits to the buffers at them.
pub trait GlobalMemory: Sync {
    /// The buffer that an address lies in, and the address of the buffer's first byte. None if it lies in none.
    fn find(&self, address: u64) -> Option<(&BufferRange, u64)>;
}

/// Global memory in which no buffer has an address.
#[derive(Clone, Copy, Debug)]
pub struct NoGlobalMemory;

impl GlobalMemory for NoGlobalMemory {
    fn find(&self, _address: u64) -> Option<(&BufferRange, u64)> {
        None
    }
}

/// The words of a buffer range and its size in bytes. A range that isn't within its memory, or not aligned to words, is
/// empty.
pub(crate) fn range_words(range: &BufferRange) -> (&[AtomicU32], u32) {
    let memory = range.memory.words();
    let end = range.offset.checked_add(range.size).filter(|end| *end <= range.memory.len());
    match end {
        Some(end) if range.offset.is_multiple_of(4) => {
            let last = (end.div_ceil(4) as usize).min(memory.len());
            let words = memory.get((range.offset / 4) as usize..last).unwrap_or_default();
            (words, u32::try_from(range.size).unwrap_or(u32::MAX))
        }
        _ => (&[], 0),
    }
}

/// The word at an index. None if it is beyond the end.
#[inline(always)]
pub(crate) fn load_word(words: &[AtomicU32], index: usize) -> Option<u32> {
    words.get(index).map(|word| word.load(Ordering::Relaxed))
}

/// One register for the 16 lanes of a vector; floats as their bits.
pub type LaneWords = [u32; VECTOR_LANES];

/// The level of detail of a sample for 16 lanes; see [`crate::ir::Lod`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "one lives on the stack for each sample")]
pub enum LodRequest {
    /// Computed from differences within each quad of lanes, and nothing else: as [`LodRequest::Implicit`] with zeros.
    Automatic,
    /// Computed from differences within each quad of lanes.
    Implicit {
        /// Added to the level; floats.
        bias: LaneWords,
        /// Least level; floats.
        minimum: LaneWords,
    },
    /// The level itself; floats.
    Explicit(LaneWords),
    /// Computed from the gradients of each coordinate; floats.
    Gradient {
        /// Along x.
        dx: [LaneWords; 3],
        /// Along y.
        dy: [LaneWords; 3],
        /// Least level.
        minimum: LaneWords,
    },
}

/// A sample for 16 lanes: four quads, in order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleRequest {
    /// The lanes whose result is used, lane 0 lowest. The coordinates of other lanes are still used for differences.
    pub mask: u16,
    /// The image's kind.
    pub shape: ImageShape,
    /// Coordinates as floats. The layer, if any, follows the other coordinates; the rest is zero.
    pub coordinate: [LaneWords; 4],
    /// Level of detail.
    pub lod: LodRequest,
    /// Texel offsets; signed integers.
    pub offset: [LaneWords; 3],
    /// Reference values of a depth comparison; floats.
    pub compare: Option<LaneWords>,
    /// The component to gather, if this is a gather.
    pub gather: Option<u8>,
}

/// An unfiltered access for 16 lanes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TexelRequest {
    /// The lanes that access a texel, lane 0 lowest.
    pub mask: u16,
    /// The image's kind.
    pub shape: ImageShape,
    /// Coordinates as integers. The layer, if any, follows the other coordinates; the rest is zero.
    pub coordinate: [LaneWords; 4],
    /// Mip levels.
    pub level: LaneWords,
    /// Sample indices.
    pub sample: LaneWords,
}

/// The images and samplers that a program is bound to, by bind point. If a bind point isn't bound, or coordinates are
/// out of range, reads give zero and writes do nothing. Results are floats or integers as the image's format says. Texels
/// are written where the caller wants them, since copies of vectors from function to function take time.
pub trait ImageUnit: Sync {
    /// Samples with filtering. Sets red, green, blue, alpha.
    fn sample(&self, image: u32, sampler: u32, request: &SampleRequest, texel: &mut [LaneWords; 4]);

    /// Reads texels. Sets red, green, blue, alpha.
    fn read(&self, image: u32, request: &TexelRequest, texel: &mut [LaneWords; 4]);

    /// Writes texels, in order of lanes.
    fn write(&self, image: u32, request: &TexelRequest, texel: &[LaneWords; 4]);

    /// Read-modify-write on texels of one 32-bit component, in order of lanes. Returns the old values.
    fn atomic(
        &self,
        image: u32,
        request: &TexelRequest,
        op: AtomicOp,
        value: &LaneWords,
        comparator: &LaneWords,
    ) -> LaneWords;

    /// Width, height and depth, as many as the dimension has; then layers if arrayed; the rest is zero.
    fn size(&self, image: u32, shape: ImageShape, level: u32) -> [u32; 4];

    /// Number of mip levels.
    fn levels(&self, image: u32) -> u32;

    /// Number of samples.
    fn samples(&self, image: u32) -> u32;

    /// The level of detail of an implicit sample: clamped to the levels that exist, and before clamping; floats.
    fn lod(&self, image: u32, sampler: u32, request: &SampleRequest) -> [LaneWords; 2];
}

/// An image unit to which no image is bound.
#[derive(Clone, Copy, Debug)]
pub struct NoImages;

impl ImageUnit for NoImages {
    fn sample(&self, _image: u32, _sampler: u32, _request: &SampleRequest, texel: &mut [LaneWords; 4]) {
        *texel = Default::default();
    }

    fn read(&self, _image: u32, _request: &TexelRequest, texel: &mut [LaneWords; 4]) {
        *texel = Default::default();
    }

    fn write(&self, _image: u32, _request: &TexelRequest, _texel: &[LaneWords; 4]) {}

    fn atomic(
        &self,
        _image: u32,
        _request: &TexelRequest,
        _op: AtomicOp,
        _value: &LaneWords,
        _comparator: &LaneWords,
    ) -> LaneWords {
        LaneWords::default()
    }

    fn size(&self, _image: u32, _shape: ImageShape, _level: u32) -> [u32; 4] {
        [0; 4]
    }

    fn levels(&self, _image: u32) -> u32 {
        0
    }

    fn samples(&self, _image: u32) -> u32 {
        0
    }

    fn lod(&self, _image: u32, _sampler: u32, _request: &SampleRequest) -> [LaneWords; 2] {
        Default::default()
    }
}
