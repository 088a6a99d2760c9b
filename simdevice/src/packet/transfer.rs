//! Packets of copies, blits, resolves and clears. Copies of compressed images count blocks instead of texels; blits
//! always count texels.

use crate::format::{Aspect, ClearValue};
use crate::image::Image;
use crate::state::ResolveMode;
use crate::texture::Filter;
use devmem::BufferRange;
use std::sync::Arc;

/// A region of a buffer-to-buffer copy; offsets are relative to the packet's ranges.
#[derive(Clone, Copy, Debug)]
pub struct BufferCopyRegion {
    /// The first byte in the source range.
    pub source_offset: u64,
    /// The first byte in the target range.
    pub target_offset: u64,
    /// The number of bytes.
    pub size: u64,
}

/// A copy between buffers: see [`Packet::CopyBuffer`](super::Packet::CopyBuffer).
#[derive(Clone, Debug)]
pub struct CopyBuffer {
    /// The source of the bytes.
    pub source: BufferRange,
    /// The destination of the bytes.
    pub target: BufferRange,
    /// The regions to copy.
    pub regions: Vec<BufferCopyRegion>,
}

/// One aspect of a mip level's consecutive array layers.
#[derive(Clone, Copy, Debug)]
pub struct SubresourceLayers {
    /// The aspect.
    pub aspect: Aspect,
    /// The mip level.
    pub mip_level: u32,
    /// The first array layer.
    pub base_layer: u32,
    /// The number of layers.
    pub layer_count: u32,
}

/// A region of a copy between a buffer and an image.
#[derive(Clone, Copy, Debug)]
pub struct BufferImageRegion {
    /// The offset in the buffer range, in bytes.
    pub buffer_offset: u64,
    /// Texels from one row to the next in the buffer; 0 means tightly packed.
    pub buffer_row_length: u32,
    /// Rows from one slice or layer to the next in the buffer; 0 means tightly packed.
    pub buffer_image_height: u32,
    /// The image's subresources.
    pub subresource: SubresourceLayers,
    /// The first texel: x, y, z.
    pub image_offset: [i32; 3],
    /// Texels in x, y and z.
    pub image_extent: [u32; 3],
}

/// A copy between a buffer and an image: see [`Packet::CopyBufferToImage`](super::Packet::CopyBufferToImage) and
/// [`Packet::CopyImageToBuffer`](super::Packet::CopyImageToBuffer).
#[derive(Clone, Debug)]
pub struct CopyBufferImage {
    /// The range of the buffer.
    pub buffer: BufferRange,
    /// The image.
    pub image: Arc<Image>,
    /// The regions to copy.
    pub regions: Vec<BufferImageRegion>,
}

/// A region of an image-to-image copy.
#[derive(Clone, Copy, Debug)]
pub struct ImageCopyRegion {
    /// The subresources of the source.
    pub source: SubresourceLayers,
    /// The first texel of the source: x, y, z.
    pub source_offset: [i32; 3],
    /// The subresources of the target.
    pub target: SubresourceLayers,
    /// The first texel of the target: x, y, z.
    pub target_offset: [i32; 3],
    /// Texels in x, y and z.
    pub extent: [u32; 3],
}

/// A copy between images: see [`Packet::CopyImage`](super::Packet::CopyImage).
#[derive(Clone, Debug)]
pub struct CopyImage {
    /// The source of the texels.
    pub source: Arc<Image>,
    /// The destination of the texels.
    pub target: Arc<Image>,
    /// The regions to copy.
    pub regions: Vec<ImageCopyRegion>,
}

/// A range of an image's mip levels and array layers, in one aspect.
#[derive(Clone, Copy, Debug)]
pub struct SubresourceRange {
    /// The aspect.
    pub aspect: Aspect,
    /// The first mip level.
    pub base_mip_level: u32,
    /// The number of levels.
    pub level_count: u32,
    /// The first array layer.
    pub base_layer: u32,
    /// The number of layers.
    pub layer_count: u32,
}

/// A clear of an image: see [`Packet::ClearImage`](super::Packet::ClearImage).
#[derive(Clone, Debug)]
pub struct ClearImage {
    /// The image.
    pub image: Arc<Image>,
    /// The value of the cleared texels.
    pub value: ClearValue,
    /// The ranges to clear.
    pub ranges: Vec<SubresourceRange>,
}

/// A region of a blit: two boxes, each given by two corners. Corners in the opposite order mirror the region.
#[derive(Clone, Copy, Debug)]
pub struct ImageBlitRegion {
    /// The subresources of the source.
    pub source: SubresourceLayers,
    /// Two opposite corners of the source's box, on borders of texels: x, y, z.
    pub source_corners: [[i32; 3]; 2],
    /// The subresources of the target, of the same aspect.
    pub target: SubresourceLayers,
    /// The corners of the target's box that the source's corners are mapped to.
    pub target_corners: [[i32; 3]; 2],
}

/// A blit: see [`Packet::BlitImage`](super::Packet::BlitImage). Formats are converted between integers of the same
/// signedness, between any formats that are not integer, and between the same formats of depth and stencil.
#[derive(Clone, Debug)]
pub struct BlitImage {
    /// The source of the texels, of one sample.
    pub source: Arc<Image>,
    /// The destination of the texels, of one sample.
    pub target: Arc<Image>,
    /// The filter between texels of the source. Integers, depth and stencil are taken from the nearest texel.
    pub filter: Filter,
    /// The regions to blit.
    pub regions: Vec<ImageBlitRegion>,
}

/// A resolve: see [`Packet::ResolveImage`](super::Packet::ResolveImage). Both images have the same format.
#[derive(Clone, Debug)]
pub struct ResolveImage {
    /// The source of the samples.
    pub source: Arc<Image>,
    /// The destination of the texels, of one sample.
    pub target: Arc<Image>,
    /// The function from samples to a texel.
    pub mode: ResolveMode,
    /// The regions to resolve.
    pub regions: Vec<ImageCopyRegion>,
}
