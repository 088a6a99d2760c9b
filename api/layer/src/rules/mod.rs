//! The rules: those of the specification's valid usage, and what is valid and surely not meant.

pub(crate) mod camera;
pub(crate) mod contents;
pub(crate) mod counts;
pub(crate) mod decoding;
pub(crate) mod depth;
pub(crate) mod device;
pub(crate) mod draw;
pub(crate) mod dynamic;
pub(crate) mod gaussians;
pub(crate) mod harmonics;
pub(crate) mod indirect;
pub(crate) mod pipeline;
pub(crate) mod ranges;
pub(crate) mod reader;
pub(crate) mod set;
pub(crate) mod shaders;
pub(crate) mod sizes;
pub(crate) mod state;
