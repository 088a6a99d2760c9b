//! The tile engine: tile buffers, the rasterizer's modes and what becomes of their fragments.

mod batch;
pub mod blend;
mod color;
mod coverage;
mod depth;
pub mod gaussian;
pub(crate) mod output;
mod pending;
mod plane;
pub(crate) mod prepared;
pub(crate) mod primitives;
mod quads;
pub(crate) mod recording;
mod setup;
mod target;
pub mod tile;
mod write;

pub use crate::limits::TILE_SIZE;
pub(crate) use plane::Plane;
