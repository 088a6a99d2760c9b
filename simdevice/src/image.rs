//! Images: where each texel of each subresource lies in memory.

use crate::format::Format;
use devmem::Allocation;
use std::sync::Arc;

/// How many dimensions an image has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ImageKind {
    /// One.
    D1,
    /// Two.
    D2,
    /// Three.
    D3,
}

/// What an image is, apart from its memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImageDesc {
    /// How many dimensions it has.
    pub kind: ImageKind,
    /// How its texels are stored.
    pub format: Format,
    /// Texels of level 0 in x, y and z.
    pub extent: [u32; 3],
    /// Mip levels.
    pub mip_levels: u32,
    /// Array layers.
    pub array_layers: u32,
    /// Samples per texel.
    pub samples: u32,
}

/// An image bound to memory.
#[derive(Clone, Debug)]
pub struct Image {
    /// What it is.
    pub desc: ImageDesc,
    /// Its memory.
    pub memory: Arc<Allocation>,
    /// The byte at which it begins there.
    pub offset: u64,
}

/// A range of an image's subresources, read as a format.
#[derive(Clone, Debug)]
pub struct ImageView {
    /// The image.
    pub image: Arc<Image>,
    /// How texels are read.
    pub format: Format,
    /// The first mip level.
    pub base_mip_level: u32,
    /// How many levels.
    pub level_count: u32,
    /// The first array layer.
    pub base_layer: u32,
    /// How many layers.
    pub layer_count: u32,
}
