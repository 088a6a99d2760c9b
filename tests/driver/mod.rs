//! Tests of the driver as the Vulkan loader and its layers use it, and of the limits, features and extensions that
//! common programs ask for. Each is tested by a program that uses it.

mod addresses;
mod clock;
mod conditional;
mod depth_clip;
mod descriptors;
mod dynamic;
mod feedback_loop;
mod geometry_shaders;
mod limits;
mod loader_door;
mod multiview;
mod pipeline_libraries;
mod pipelines;
mod presentation;
mod primitive_stages;
mod programs;
mod queues;
mod robustness;
mod samplers;
mod storage;
mod tessellation_shaders;
mod transform_feedback;
mod wide_values;
mod window;
#[cfg(target_os = "linux")]
mod x11;
