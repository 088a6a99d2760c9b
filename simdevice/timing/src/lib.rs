//! What the simulated GauRast hardware would have spent: cycles, energy and area, from a trace of the work that a
//! device did.
//!
//! The trace ([`work`]) is read, never changed, and knows nothing of time. [`config`] says what the hardware is like,
//! with the source of each number. [`fast`] tells the rasterizer's cycles and [`simulate`] a frame's. What is studied with
//! the model (the paper's numbers, sweeps, the model cycle by cycle) is the crate `timing-studies`.
#![forbid(unsafe_code)]

pub mod config;
pub mod energy;
pub mod fast;
pub mod pe;
pub mod plan;
pub mod raster;
pub mod schedule;
pub mod shader_cores;
pub mod simulate;
pub mod stages;
pub mod work;

pub use config::{Config, ConfigError};
pub use work::{FrameWork, Trace};
