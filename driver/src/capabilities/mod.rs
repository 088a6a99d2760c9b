//! What is advertised, each thing stated once.

pub(crate) mod extensions;
pub(crate) mod features;
