//! What a program reaches besides its registers: buffers, push constants, images, global memory.

use super::ir::{AtomicOp, CHUNK_LANES, ImageShape};

/// One register for the 16 lanes of a chunk; floats as their bits.
pub type Lanes = [u32; CHUNK_LANES];

/// How the level of detail of a sample is chosen; see [`super::ir::Lod`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LodRequest {
    /// From differences within each quad of lanes.
    Implicit {
        /// Added to the level; floats.
        bias: Lanes,
        /// Least level; floats.
        minimum: Lanes,
    },
    /// Given; floats.
    Explicit(Lanes),
    /// From gradients by coordinate; floats.
    Gradient {
        /// Along x.
        dx: [Lanes; 3],
        /// Along y.
        dy: [Lanes; 3],
        /// Least level.
        minimum: Lanes,
    },
}

/// A sample for 16 lanes: four quads, in order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleRequest {
    /// Lanes whose result is wanted, lane 0 lowest. The coordinates of the others still count for differences.
    pub mask: u16,
    /// The image's kind.
    pub shape: ImageShape,
    /// Floats; the layer, if any, after the other coordinates; the rest is zero.
    pub coordinate: [Lanes; 4],
    /// Level of detail.
    pub lod: LodRequest,
    /// Texel offsets; signed integers.
    pub offset: [Lanes; 3],
    /// Reference values of a depth comparison; floats.
    pub compare: Option<Lanes>,
    /// The component to gather, if this is a gather.
    pub gather: Option<u8>,
}

/// An unfiltered access for 16 lanes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TexelRequest {
    /// Lanes that take part, lane 0 lowest.
    pub mask: u16,
    /// The image's kind.
    pub shape: ImageShape,
    /// Integers; the layer, if any, after the other coordinates; the rest is zero.
    pub coordinate: [Lanes; 4],
    /// Mip levels.
    pub level: Lanes,
    /// Sample indices.
    pub sample: Lanes,
}

/// The images and samplers that a program is bound to. Indices are bind points; one that isn't bound, or coordinates
/// out of range, read zero and write nothing. Results are floats or integers as the image's format says.
pub trait ImageUnit: Sync {
    /// Filters. Returns red, green, blue, alpha.
    fn sample(&self, image: u32, sampler: u32, request: &SampleRequest) -> [Lanes; 4];

    /// Reads texels. Returns red, green, blue, alpha.
    fn read(&self, image: u32, request: &TexelRequest) -> [Lanes; 4];

    /// Writes texels, in order of lanes.
    fn write(&self, image: u32, request: &TexelRequest, texel: &[Lanes; 4]);

    /// Read-modify-write on texels of one 32-bit component, in order of lanes. Returns the old values.
    fn atomic(
        &self,
        image: u32,
        request: &TexelRequest,
        op: AtomicOp,
        value: &Lanes,
        comparator: &Lanes,
    ) -> Lanes;

    /// Width, height, depth as far as the dimension has them, then layers if arrayed; the rest is zero.
    fn size(&self, image: u32, shape: ImageShape, level: u32) -> [u32; 4];

    /// Number of mip levels.
    fn levels(&self, image: u32) -> u32;

    /// Number of samples.
    fn samples(&self, image: u32) -> u32;

    /// The level of detail of an implicit sample, clamped to what exists, and before clamping; floats.
    fn lod(&self, image: u32, sampler: u32, request: &SampleRequest) -> [Lanes; 2];
}
