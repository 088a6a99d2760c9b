//! The texture unit: samples, fetches, reads and writes images for the shader cores.
//!
//! An [`ImageTable`] holds a draw's images and samplers and executes a program's image instructions
//! ([`isa::resources::ImageUnit`]), 16 lanes at a time, as the chapter "Image Operations" of the Vulkan specification
//! defines. Weights are binary32, sRGB is decoded before it is filtered, and cubes are seamless. Any coordinate is
//! safe: NaN counts as 0, and all accesses are bounds-checked.
//!
//! An anisotropic sample (`anisotropy`) is the mean of several isotropic ones. There are two implementations of those:
//! lane by lane (`scalar`), which supports everything, and 16 lanes at once (`vector`), which supports the common
//! formats. An image whose luma and chroma are apart has a sample of each plane (`ycbcr`), which are converted to a colour
//! (`conversion`). Single texels are read and written lane by lane or 16 at once too (`access`). They agree bit for bit, at every
//! SIMD level.

mod access;
mod addressing;
mod anisotropy;
mod conversion;
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
mod ycbcr;

pub use conversion::{ChromaLocation, YcbcrConversion, YcbcrModel, YcbcrRange};
pub use sampler::{AddressMode, BorderColor, Filter, MipmapMode, Reduction, Sampler};
pub use table::ImageTable;
pub use view::{
    Chroma, ComponentSwizzle, IDENTITY, ImageBinding, PlaneComponent, SampledImage, StorageImage, Swizzle, TexelBuffer,
};
