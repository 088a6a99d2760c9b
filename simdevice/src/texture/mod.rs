//! The texture unit: what shader cores sample, fetch, read and write of images.
//!
//! An [`ImageTable`] holds a draw's images and samplers and answers a program's image instructions
//! ([`isa::resources::ImageUnit`]), 16 lanes at a time, as the chapter "Image Operations" of the Vulkan
//! specification says. Weights are binary32 throughout, sRGB is decoded before it is filtered, cubes are seamless.
//! Hostile coordinates are safe: NaN counts as 0, and everything is bounds-checked.
//!
//! An anisotropic sample (`anisotropy`) is several isotropic ones. There are two ways to take those: lane by lane (`filter`), which does everything, and 16 lanes at once (`batch`), which
//! does the common formats. They agree bit for bit, at every SIMD level.

mod address;
mod anisotropy;
mod axis;
mod batch;
mod cube;
mod fetch;
mod filter;
mod lod;
mod packing;
mod plain;
mod sampler;
mod surface;
mod table;
#[cfg(test)]
mod tests;
mod view;

pub use sampler::{AddressMode, BorderColor, CompareOp, Filter, MipmapMode, Reduction, Sampler};
pub use table::ImageTable;
pub use view::{
    ComponentSwizzle, IDENTITY, ImageBinding, SampledImage, StorageImage, Swizzle, TexelBuffer,
};
