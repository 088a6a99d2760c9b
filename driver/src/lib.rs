//! See the package description.

pub mod shader;
