//! The driver as an application sees it: `ash` over the embedded door.
//!
//! `unsafe` here has one reason throughout: these are Vulkan calls, and each test follows Vulkan's valid usage or
//! breaks it in the one way that it is about, which the driver must survive.

mod canvas;
mod command_buffers;
mod compute;
mod descriptors;
mod dynamic_states;
mod gaussian_draws;
mod gaussian_modes;
mod gaussian_pipelines;
mod gaussian_shaders;
mod gpu;
mod image_transfers;
mod images_in_shaders;
mod kernel;
#[path = "../support/loader.rs"]
mod loader;
mod memory;
mod polygon_attachments;
mod polygon_draws;
mod polygon_pipelines;
mod polygon_resources;
mod polygons;
mod queries;
mod render_passes;
mod scene;
mod subpasses;
mod synchronization;
mod transfers;
mod valid_usage;
mod validation;
