//! The tile engine: tile buffers, the rasterizer's modes and what becomes of their fragments.

mod batch;
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
#[cfg(test)]
mod tests;
pub mod tile;
mod write;

pub use crate::limits::TILE_SIZE;
pub(crate) use plane::Plane;
