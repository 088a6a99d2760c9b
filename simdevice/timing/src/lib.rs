//! What the simulated GauRast hardware would have spent: cycles, energy and area, from a trace of the work that a
//! device did.
//!
//! The trace ([`work`]) is read, never changed, and knows nothing of time. [`config`] says what the hardware is like,
//! with the source of each number. Two models of the rasterizer tell its cycles: [`fast`], which everything
//! uses, and [`stepped`], one clock cycle at a time, which it is held against.
#![forbid(unsafe_code)]

pub mod area;
pub mod config;
pub mod energy;
pub mod fast;
pub mod paper;
pub mod pe;
mod plan;
pub mod raster;
pub mod scene;
pub mod schedule;
pub mod sensitivity;
pub mod shader_cores;
pub mod simulate;
pub mod stages;
pub mod stepped;
pub mod what_if;
pub mod work;

pub use config::{Config, ConfigError};
pub use work::{FrameWork, Trace};
