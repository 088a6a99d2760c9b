//! Models of the simulated GauRast hardware: cycles, energy and area, from a trace of the work that a device did.
//!
//! The trace ([`work`]) is read, never changed, and has no times. [`config`] describes the hardware, with the source of
//! each number. [`fast`] computes the rasterizer's cycles and [`simulate`] a frame's time. Studies that use the model
//! (the paper's numbers, sweeps, a cycle-stepped model) are the crate `timing-studies`.
#![forbid(unsafe_code)]

pub mod area;
pub mod check;
pub mod config;
pub mod dram;
pub mod energy;
pub mod fast;
pub mod pe;
pub mod plan;
pub mod raster;
pub mod ring;
pub mod schedule;
pub mod shader_cores;
pub mod simulate;
pub mod stages;
pub mod trace_file;
pub mod work;

pub use config::{Config, ConfigError};
pub use work::{FrameWork, Trace};
