//! Texel and vertex formats: Vulkan's, by Vulkan's names in camel case.
//!
//! One table defines them; sizes, aspects and conversions derive from it. Texels are decoded to and encoded from
//! four 32-bit registers in the order R, G, B, A. Registers of integer formats hold the integer's bits, as shader
//! registers do; depth and stencil are held in the first register. Components that a format lacks read as
//! (0, 0, 0, 1). The formats of Vulkan 1.0 with components of up to 32 bits are here, and those of compressed blocks of
//! texels (see [`Format::decompressed`]), whose blocks are read and written whole, as if each were a texel; which of them
//! can be used for what is advertised elsewhere.

mod block;
mod component;
mod convert;
pub(crate) mod depth;
mod table;
#[cfg(test)]
mod tests;
pub(crate) mod unorm8;

pub use component::{Aspect, Channel, ClearValue, Component, Numeric};
pub use table::{Format, MAX_TEXEL_SIZE};
