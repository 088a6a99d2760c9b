//! What packets of copies, blits, resolves and clears say. Where an image is compressed, copies count its blocks of
//! texels in place of texels; blits count texels always.

use super::BufferRange;
use crate::format::{Aspect, ClearValue};
use crate::image::Image;
use crate::state::ResolveMode;
use crate::texture::Filter;
use std::sync::Arc;

/// A region of a buffer-to-buffer copy; offsets are relative to the packet's ranges.
#[derive(Clone, Copy, Debug)]
pub struct BufferCopyRegion {
    /// The first byte in the source range.
    pub source_offset: u64,
    /// The first byte in the target range.
    pub target_offset: u64,
    /// How many bytes.
    pub size: u64,
}

/// See [`Packet::CopyBuffer`](super::Packet::CopyBuffer).
#[derive(Clone, Debug)]
pub struct CopyBuffer {
    /// Where bytes come from.
    pub source: BufferRange,
    /// Where they go.
    pub target: BufferRange,
    /// What is copied.
    pub regions: Vec<BufferCopyRegion>,
}

/// One mip level of a run of array layers, one aspect.
#[derive(Clone, Copy, Debug)]
pub struct SubresourceLayers {
    /// The aspect.
    pub aspect: Aspect,
    /// The mip level.
    pub mip_level: u32,
    /// The first array layer.
    pub base_layer: u32,
    /// How many layers.
    pub layer_count: u32,
}

/// A region of a copy between a buffer and an image.
#[derive(Clone, Copy, Debug)]
pub struct BufferImageRegion {
    /// Byte offset in the buffer range.
    pub buffer_offset: u64,
    /// Texels from one row to the next in the buffer; 0 means tightly packed.
    pub buffer_row_length: u32,
    /// Rows from one slice or layer to the next in the buffer; 0 means tightly packed.
    pub buffer_image_height: u32,
    /// What part of the image.
    pub subresource: SubresourceLayers,
    /// The first texel: x, y, z.
    pub image_offset: [i32; 3],
    /// Texels in x, y and z.
    pub image_extent: [u32; 3],
}

/// See [`Packet::CopyBufferToImage`](super::Packet::CopyBufferToImage) and [`Packet::CopyImageToBuffer`](super::Packet::CopyImageToBuffer).
#[derive(Clone, Debug)]
pub struct CopyBufferImage {
    /// The buffer side.
    pub buffer: BufferRange,
    /// The image side.
    pub image: Arc<Image>,
    /// What is copied.
    pub regions: Vec<BufferImageRegion>,
}

/// A region of an image-to-image copy.
#[derive(Clone, Copy, Debug)]
pub struct ImageCopyRegion {
    /// What part of the source.
    pub source: SubresourceLayers,
    /// The first texel there: x, y, z.
    pub source_offset: [i32; 3],
    /// What part of the target.
    pub target: SubresourceLayers,
    /// The first texel there: x, y, z.
    pub target_offset: [i32; 3],
    /// Texels in x, y and z.
    pub extent: [u32; 3],
}

/// See [`Packet::CopyImage`](super::Packet::CopyImage).
#[derive(Clone, Debug)]
pub struct CopyImage {
    /// Where texels come from.
    pub source: Arc<Image>,
    /// Where they go.
    pub target: Arc<Image>,
    /// What is copied.
    pub regions: Vec<ImageCopyRegion>,
}

/// A range of an image's subresources, one aspect.
#[derive(Clone, Copy, Debug)]
pub struct SubresourceRange {
    /// The aspect.
    pub aspect: Aspect,
    /// The first mip level.
    pub base_mip_level: u32,
    /// How many levels.
    pub level_count: u32,
    /// The first array layer.
    pub base_layer: u32,
    /// How many layers.
    pub layer_count: u32,
}

/// See [`Packet::ClearImage`](super::Packet::ClearImage).
#[derive(Clone, Debug)]
pub struct ClearImage {
    /// The image.
    pub image: Arc<Image>,
    /// The value.
    pub value: ClearValue,
    /// What is cleared.
    pub ranges: Vec<SubresourceRange>,
}

/// A region of a blit: two boxes, each given by two corners. Corners in the opposite order mirror the region.
#[derive(Clone, Copy, Debug)]
pub struct ImageBlitRegion {
    /// What part of the source.
    pub source: SubresourceLayers,
    /// Two corners there, between texels: x, y, z.
    pub source_corners: [[i32; 3]; 2],
    /// What part of the target; the same aspect.
    pub target: SubresourceLayers,
    /// The corners that they are mapped to.
    pub target_corners: [[i32; 3]; 2],
}

/// See [`Packet::BlitImage`](super::Packet::BlitImage). Either image's format may be any that the other's converts to: of
/// integers of the same sign, of anything that is no integer, or of the same depth and stencil.
#[derive(Clone, Debug)]
pub struct BlitImage {
    /// Where texels come from; of one sample.
    pub source: Arc<Image>,
    /// Where they go; of one sample.
    pub target: Arc<Image>,
    /// How texels are found between those of the source. Integers, depth and stencil are taken from the nearest.
    pub filter: Filter,
    /// What is copied.
    pub regions: Vec<ImageBlitRegion>,
}

/// See [`Packet::ResolveImage`](super::Packet::ResolveImage). The formats are the same.
#[derive(Clone, Debug)]
pub struct ResolveImage {
    /// Where samples come from.
    pub source: Arc<Image>,
    /// Where texels go; of one sample.
    pub target: Arc<Image>,
    /// How samples become one.
    pub mode: ResolveMode,
    /// What is resolved.
    pub regions: Vec<ImageCopyRegion>,
}
