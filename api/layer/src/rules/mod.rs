//! The rules: those of the specification's valid usage, and what is valid and surely not meant.

pub(crate) mod camera;
pub(crate) mod contents;
pub(crate) mod device;
pub(crate) mod draw;
pub(crate) mod dynamic;
pub(crate) mod harmonics;
pub(crate) mod pipeline;
pub(crate) mod set;
pub(crate) mod shaders;
pub(crate) mod state;
