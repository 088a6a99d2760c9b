//! Scenes of triangles that run unchanged on this driver and on lavapipe.
//!
//! A [`Scene`] is one function of a [`Gpu`]: it creates what it needs, records, submits, and returns
//! the images that it drew. Everything here is an ordinary application of Vulkan; [`gaurast_testkit`] says what its
//! `unsafe` relies on.

pub mod checksum;
pub mod edges;
mod expected;
pub mod models;
mod outcome;
pub mod scenes;
pub mod shapes;
pub mod workloads;

pub use expected::{Exception, Expected};
pub use outcome::{Drawn, Missing};
pub use scenes::Scene;
