//! The tile engine: tile buffers, the rasterizer's modes and what becomes of their fragments.

mod batch;
pub mod blend;
mod color;
mod coverage;
mod depth;
pub mod fragment;
pub mod gaussian;
mod output;
mod pending;
mod plane;
mod prepared;
pub(crate) mod primitives;
mod quads;
mod setup;
mod target;
pub mod tile;

pub use crate::gaussian::TILE_SIZE;
pub(crate) use depth::DepthCode;
pub(crate) use plane::Plane;

/// The greatest side of a macro-tile in pixels.
pub const MAX_MACRO_TILE_SIZE: u32 = 128;

/// The most samples per pixel; the other count is 1.
pub const MAX_SAMPLES: u32 = 4;
