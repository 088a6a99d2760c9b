//! The texture unit: what shader cores sample, fetch, read and write of images.
//!
//! An [`ImageTable`] holds a draw's images and samplers and answers a program's image instructions
//! ([`isa::resources::ImageUnit`]), 16 lanes at a time, as the chapter "Image Operations" of the Vulkan
//! specification says. Weights are binary32 throughout, sRGB is decoded before it is filtered, cubes are seamless.
//! Hostile coordinates are safe: NaN counts as 0, and everything is bounds-checked.
//!
//! An anisotropic sample (`anisotropy`) is several isotropic ones. There are two ways to take those: lane by lane
//! (`scalar`), which does everything, and 16 lanes at once (`vector`), which does the common formats. They agree bit for bit, at
//! every SIMD level.

mod addressing;
mod anisotropy;
mod cube;
mod lod;
mod sampler;
mod scalar;
mod surface;
mod table;
#[cfg(test)]
mod tests;
mod texels;
mod vector;
mod view;

pub use sampler::{AddressMode, BorderColor, Filter, MipmapMode, Reduction, Sampler};
pub use table::ImageTable;
pub use view::{
    ComponentSwizzle, IDENTITY, ImageBinding, SampledImage, StorageImage, Swizzle, TexelBuffer,
};
