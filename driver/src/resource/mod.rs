//! Resources: memory, buffers, images, samplers, and views.

pub(crate) mod buffer;
pub(crate) mod image;
pub(crate) mod memory;
pub(crate) mod sampler;
