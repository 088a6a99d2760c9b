//! The tile engine: tile buffers, the rasterizer's modes and what becomes of their fragments.

pub mod blend;
pub mod gaussian;
pub mod tile;

/// The side of a tile in pixels: primitives are binned by tile, attachments loaded and stored by tile.
pub const TILE_SIZE: u32 = 16;

/// The greatest side of a macro-tile in pixels.
pub const MAX_MACRO_TILE_SIZE: u32 = 128;
