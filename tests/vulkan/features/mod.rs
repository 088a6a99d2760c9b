//! The chapters *Features*, *Limits* and *Formats*.
//!
//! Unit tests: `driver/src/physical_device`, `driver/src/registry`.

mod limits;
mod maintenance;
mod newer_names;
mod robust_access;
