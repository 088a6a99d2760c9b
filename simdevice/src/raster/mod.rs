//! The tile engine: tile buffers, the rasterizer's modes and what becomes of their fragments.

pub mod blend;
pub mod gaussian;
pub mod tile;

pub use crate::gaussian::TILE_SIZE;

/// The greatest side of a macro-tile in pixels.
pub const MAX_MACRO_TILE_SIZE: u32 = 128;
