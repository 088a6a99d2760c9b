//! Resources: memory, buffers, images, samplers, their conversions, and views.

pub(crate) mod buffer;
pub(crate) mod image;
pub(crate) mod memory;
pub(crate) mod sampler;
pub(crate) mod ycbcr_conversion;
