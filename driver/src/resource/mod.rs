//! Resources: memory, and what is bound to it, with its views.

pub(crate) mod buffer;
pub(crate) mod image;
pub(crate) mod memory;
pub(crate) mod sampler;
