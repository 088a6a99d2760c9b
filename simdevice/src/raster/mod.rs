//! The tile engine: tile buffers, the rasterizer's triangle and Gaussian modes, and the output of fragments.

mod color;
mod depth_stencil;
pub mod gaussian;
pub(crate) mod output;
#[cfg(test)]
mod tests;
pub mod tile;
pub(crate) mod tile_buffer;
pub(crate) mod triangle;

pub use crate::limits::TILE_SIZE;
pub use tile_buffer::AttachmentError;
