//! Tests by the chapters of the Vulkan specification: a folder is a chapter, and a file is a subject. Helpers are in
//! [`gaurast_testkit`].
//!
//! The reason for all `unsafe` here is the same: these are Vulkan calls. Each test follows Vulkan's valid usage, or
//! violates one rule on purpose, which the driver must survive.

mod chapters;
mod clear_and_copy_commands;
mod command_buffers;
mod devices_and_queues;
mod dispatching_commands;
mod drawing_commands;
mod drivers;
mod features;
mod fragment_operations;
mod fundamentals;
mod image_operations;
mod initialization;
mod memory_and_resources;
mod pipelines;
mod queries;
mod rasterization;
mod render_pass;
mod resource_descriptors;
mod samplers;
mod scenes;
mod shader_interfaces;
mod shaders;
mod synchronization;
mod tessellation_and_geometry;
mod vertex_post_processing;
mod window_system_integration;

fn main() -> std::process::ExitCode {
    // SAFETY: no other thread runs yet.
    unsafe { drivers::set_environment() };
    gaurast_runner::main()
}
