//! The chapters *Features*, *Limits* and *Formats*.
//!
//! Unit tests: `driver/src/physical_device`, `driver/src/registry`.

mod draw_limits;
mod limits;
mod robust_access;
