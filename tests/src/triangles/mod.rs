//! Scenes of triangles that run unchanged on this driver and on lavapipe.
//!
//! A [`Scene`] is one function of a [`Gpu`]: it creates what it needs, records, submits, and returns
//! the images that it drew. Everything here is an ordinary application of Vulkan. `unsafe` has one
//! reason throughout: these are Vulkan calls on objects of one [`Gpu`], which every resource keeps
//! alive, and every submission is waited for before a resource can go. What a scene records stays
//! within Vulkan's valid usage (`VK_INSTANCE_LAYERS=VK_LAYER_KHRONOS_validation` shows where it
//! doesn't).

pub mod checksum;
mod commands;
pub mod edges;
mod expected;
mod gpu;
pub mod models;
mod output;
mod pipeline;
mod resource;
pub mod scenes;
pub mod shader;
pub mod shapes;
mod target;
pub mod workloads;

pub use commands::{Commands, Pass};
pub use expected::{Exception, Expected};
pub use gpu::{Gpu, OpenError, Recorded};
pub use output::{Output, Picture, texel_size};
pub use pipeline::{
    Bindings, FRAGMENT, Kernel, Pipeline, PipelineOptions, Resource, VERTEX, Vertex, attribute,
    binding, blend, depth_test, opaque,
};
pub use resource::{Buffer, Image, ImageOptions, Sampler, aspects, range};
pub use scenes::{Drawn, Missing, Scene};
pub use target::{Target, TargetOptions, fetch_sample};

/// Makes lavapipe sample textures as accurately as it can: per pixel, and in floats. Has an effect
/// only before lavapipe's first device of the process.
///
/// # Safety
/// No other thread may read the environment meanwhile, other than through the standard library.
pub unsafe fn accurate_lavapipe() {
    // SAFETY: the caller's promise.
    unsafe { std::env::set_var("GALLIVM_PERF", "no_aos_sampling,no_quad_lod") };
}
