//! The chapters *Features*, *Limits* and *Formats*.
//!
//! Unit tests: `driver/src/physical_device`, `driver/src/registry`.

mod draw_limits;
mod limits;
mod maintenance;
mod newer_names;
mod robust_access;
