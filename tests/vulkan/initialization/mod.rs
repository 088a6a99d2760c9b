//! The chapter *Initialization*.
//!
//! Unit tests: `driver/src/dispatch`, `driver/src/options.rs`.

mod driver_options;
mod embedded;
mod leaks;
mod loaded_draws;
mod loader;
mod validation_layer;
