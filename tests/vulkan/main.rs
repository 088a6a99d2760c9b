//! Tests of the driver through `ash`, embedded and through the loader.
//!
//! The reason for all `unsafe` here is the same: these are Vulkan calls. Each test follows Vulkan's valid usage, or
//! violates one rule on purpose, which the driver must survive.

mod canvas;
mod command_buffers;
mod compute;
mod context;
mod descriptors;
mod devices;
mod driver_options;
mod dynamic_states;
mod embedded;
mod gaussian_draws;
mod gaussian_interactions;
mod gaussian_modes;
mod gaussian_pipelines;
mod gaussian_shaders;
mod image_transfers;
mod images;
mod images_in_shaders;
mod leaks;
mod loader;
mod memory;
mod polygon_attachments;
mod polygon_draws;
mod polygon_pipelines;
mod polygon_resources;
mod polygon_shaders;
mod queries;
mod render_passes;
mod scene;
mod subpasses;
mod synchronization;
mod transfers;
mod valid_usage;
mod validation;
mod viewer_usage;
mod watchdog;

fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}
