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
pub use gaurast_testkit::shader;
pub use gaurast_testkit::target::{Target, TargetOptions, fetch_sample};
pub use gaurast_testkit::{
    Bindings, Buffer, Commands, FRAGMENT, Gpu, Image, ImageOptions, Kernel, OpenError, Output,
    Pass, Picture, Pipeline, PipelineOptions, Recorded, Resource, Sampler, VERTEX, Vertex,
    accurate_lavapipe, aspects, attribute, binding, blend, depth_test, opaque, range, texel_size,
};
pub use outcome::{Drawn, Missing};
pub use scenes::Scene;
