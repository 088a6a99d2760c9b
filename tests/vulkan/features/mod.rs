//! The chapters *Features*, *Limits* and *Formats*.
//!
//! Unit tests: `driver/src/physical_device`, `driver/src/registry`.

mod limits;
mod robust_access;
