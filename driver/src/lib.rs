//! The GauRast driver: a software Vulkan driver that draws with a simulated device.
//!
//! There are two doors to it. [`entry`] gives an [`ash::Entry`] over the driver linked into this process; and
//! `driver/icd` exports [`loader`] as a shared library for the Vulkan loader. Both lead to one table of commands.
//!
//! The driver keeps Vulkan's objects and lowers recorded commands to [`simdevice`] packets. It never computes a
//! pixel.

mod capabilities;
mod command;
mod dispatch;
mod embed;
mod entrypoints;
mod environment;
mod error;
mod float_control;
mod handle;
pub mod loader;
mod lower;
mod object;
mod pnext;
mod pointer;
mod registry;

pub use embed::entry;
pub use handle::live_handles;
