//! Images side by side with lavapipe: what blits and samples give there, they give here.
//!
//! `unsafe` here has one reason throughout: these are Vulkan calls, and each test follows Vulkan's valid usage. Objects
//! that a device outlives are its drop's.

mod blits;
mod device;
mod sampling;
mod texels;
