//! The simulated GauRast device.
//!
//! A device executes [`Packet`]s: its [`CommandProcessor`] is the one place that tells a Gaussian draw from a
//! triangle draw, a copy or a clear. It computes real pixels in [`devmem`] memory and knows nothing of Vulkan;
//! the driver lowers Vulkan state to packets.
//!
//! Data flows one way: packets -> geometry and Gaussian preprocessing -> binning -> the tile engine -> memory.
//! [`counters`] records the work that was done.
#![forbid(unsafe_code)]

pub mod bindings;
pub mod command_processor;
pub mod compute;
pub mod counters;
pub mod device;
pub mod format;
pub mod gaussian;
pub mod geometry;
pub mod image;
mod lanes;
mod model;
pub mod optimizations;
pub mod packet;
pub mod pass;
pub mod query;
pub mod raster;
pub mod texture;
pub mod trace;
pub mod transfer;
mod workers;

pub use command_processor::CommandProcessor;
pub use device::{Config, Device};
pub use devmem::{Allocation, host};
pub use format::Format;
pub use image::{Image, ImageView};
pub use isa;
pub use packet::Packet;
pub use timing;
