//! What is advertised, each thing stated once.

pub(crate) mod counters;
pub(crate) mod extensions;
pub(crate) mod features;
pub(crate) mod formats;
pub(crate) mod limits;
pub(crate) mod memory;
pub(crate) mod queues;
pub(crate) mod spirv;
