//! A Vulkan application for tests: devices of any driver, resources, pipelines and pictures.
//!
//! | module | contents |
//! |---|---|
//! | [`gpu`] | devices of this driver and of lavapipe, with a SIMD level and a thread count; recording, submission |
//! | [`resource`] | buffers, images with upload and readback, samplers |
//! | [`descriptors`] | descriptor sets |
//! | [`pipeline`] | graphics pipelines, of triangles and of Gaussians, and compute pipelines |
//! | [`pass`] | render passes, with render pass objects or dynamic rendering |
//! | [`target`] | attachments, and [pictures](output) of their contents |
//! | [`transform_feedback`] | the commands of transform feedback |
//! | [`gaussians`] | Gaussians in vertex buffers, and pipelines that draw them |
//! | `control` | the floating-point modes of the application's thread |
//! | [`difference`] | comparison of the pictures of two devices |
//! | [`devices`], [`context`] | devices that tests share, or open with some features; instances without a device |
//! | [`scene`], [`canvas`] | small pictures of Gaussians, and of points, lines and triangles |
//! | [`shapes`] | vertices of shapes that scenes draw |
//! | [`drawn`] | scenes that this driver and lavapipe draw |
//! | [`stage_program`] | programs of geometry and tessellation shaders, which both drivers run |
//! | [`sharing`] | memory, semaphores and fences that devices and processes share |
//! | [`packets`] | resources for a device that is driven by packets, without Vulkan |
//! | [`newer`] | structures that are newer than ash, SPIR-V that is newer than the compiler |
//! | [`presenter`] | a device that presents to a surface |
//! | [`fetch`] | texels of images as programs fetch them |
//! | [`texels`], [`exact_lavapipe`] | random texels, and a lavapipe that samples them as accurately as it can |
//!
//! The reason for all `unsafe` is the same. These are Vulkan calls on objects of one [`Gpu`], which every resource
//! keeps alive, and every submission is waited for before a resource is destroyed. Tests record only valid usage of
//! Vulkan, except tests of invalid usage. `VK_INSTANCE_LAYERS=VK_LAYER_KHRONOS_validation` reports violations.

pub mod canvas;
pub mod context;
#[cfg(target_arch = "x86_64")]
pub mod control;
pub mod descriptors;
pub mod devices;
pub mod difference;
pub mod drawn;
pub mod exact_lavapipe;
pub mod fetch;
pub mod for_levels;
pub mod gaussians;
pub mod gpu;
pub mod loader;
pub mod messages;
pub mod newer;
mod open;
pub mod output;
pub mod packets;
pub mod pass;
pub mod pipeline;
pub mod presenter;
pub mod resource;
pub mod scene;
pub mod settings;
pub mod shader;
pub mod shapes;
pub mod sharing;
pub mod stage_program;
pub mod target;
pub mod texels;
pub mod transform_feedback;

pub use descriptors::{Binding, Bindings, Resource, Sets};
pub use difference::{Difference, difference, differences, for_people, write_differences};
pub use gaussians::{GaussianOptions, GaussianPipeline, GaussianScene, Instance, bind_instances, over};
pub use gpu::{Commands, Driver, Gpu, OpenError, Opening, Recorded};
pub use loader::accurate_lavapipe;
pub use messages::{Message, Messages};
pub use output::{Output, Picture};
pub use pass::{Attachments, Bindable, Formats, Pass};
pub use pipeline::{
    Compute, FRAGMENT, Graphics, Kernel, Pipeline, PipelineOptions, Shader, VERTEX, Vertex, attribute, binding, blend,
    depth_test, opaque, whole,
};
pub use resource::{Addressed, Buffer, Image, ImageOptions, Sampler, aspects, device_format, range, texel_size};
pub use settings::Settings;
pub use target::{PassObject, Target, TargetOptions, fetch_sample};
pub use transform_feedback::TransformFeedback;
