//! The simulated GauRast device.
//!
//! A device executes [`Packet`]s. Its [`CommandProcessor`] gives each to the module for it: Gaussian draws to
//! [`gaussian`], other draws to [`geometry`], dispatches to [`compute`], copies and clears to [`transfer`]. A [`pass`]
//! holds draws of both kinds, and renders them tile by tile in their order. The device computes real pixels in [`devmem`]
//! memory and does not depend on Vulkan; the driver lowers Vulkan state to packets.
//!
//! Data flows one way: packets -> geometry and Gaussian preprocessing -> binning -> the tile engine -> memory.
//! [`stats::counters`] records the work that was done. A module imports only those before it: [`limits`], [`state`] and
//! the vector helpers; [`format`] and [`stats`]; [`image`] and [`runtime`]; [`texture`]; [`program`]; [`transform_feedback`];
//! [`packet`];
//! [`geometry`], [`compute`] and [`transfer`]; [`gaussian`]; [`raster`]; [`pass`]; [`command_processor`].
#![forbid(unsafe_code)]
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

pub mod command_processor;
pub mod compute;
pub mod device;
pub mod format;
pub mod gaussian;
pub mod geometry;
mod hardware_model;
pub mod image;
pub mod limits;
pub mod packet;
pub mod pass;
pub mod program;
pub mod raster;
pub mod runtime;
mod simd;
pub mod state;
pub mod stats;
pub mod tessellation;
pub mod texture;
pub mod transfer;
pub mod transform_feedback;

pub use command_processor::CommandProcessor;
pub use device::Device;
pub use devmem::{Allocation, BufferRange, host, shared};
pub use format::Format;
pub use image::{Image, ImageView};
pub use isa;
pub use packet::Packet;
pub use runtime::Config;
pub use timing;

/// The SIMD level of a test's variant, of `gaurast_runner::simd_levels`.
#[cfg(test)]
fn level_of(case: &gaurast_runner::Case) -> runtime::SimdLevel {
    runtime::SimdLevel::from_name(case.variant()).expect("a level's name")
}

/// The token of [`level_of`].
#[cfg(test)]
fn token_of(case: &gaurast_runner::Case) -> fearless_simd::Level {
    let token = level_of(case).resolve();
    token.expect("a level of this processor")
}

#[cfg(test)]
fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}
