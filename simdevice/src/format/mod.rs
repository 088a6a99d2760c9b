//! Texel and vertex formats, with Vulkan's names in camel case.
//!
//! One table defines them; sizes, aspects and conversions derive from it. Texels are decoded to and encoded from four
//! 32-bit registers in the order R, G, B, A. Registers of integer formats hold the integer's bits, as shader registers
//! do; depth and stencil are held in the first register. Components that a format lacks are read as (0, 0, 0, 1). The
//! table has the formats of Vulkan 1.0 with components of up to 32 bits, and those of compressed blocks of texels (see
//! [`Format::decompressed`]), whose blocks are read and written as a whole, as if each were a texel; and those of ten and
//! twelve bits in words of sixteen, in which luma and chroma are kept. The driver decides which format can be used for
//! which purpose.

mod astc;
pub(crate) mod block;
mod component;
mod convert;
pub(crate) mod depth;
mod etc;
mod table;
#[cfg(test)]
mod tests;
pub(crate) mod unorm8;

pub use component::{Aspect, Channel, ClearValue, Component, Numeric};
pub use table::{Format, MAX_TEXEL_SIZE};
