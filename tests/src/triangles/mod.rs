//! Scenes of triangles that run unchanged on this driver and on lavapipe.
//!
//! A [`Scene`] is a function of a [`Gpu`]. It creates its objects, records, submits, and returns the images that it
//! drew. The code is an ordinary Vulkan application; [`gaurast_testkit`] explains the safety of its `unsafe`.

pub mod checksum;
pub mod clipped;
pub mod edges;
mod expected;

pub use expected::{Exception, Expected};
