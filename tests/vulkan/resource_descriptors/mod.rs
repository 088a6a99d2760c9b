//! The chapter *Resource Descriptors*.
//!
//! Unit tests: `driver/src/descriptor`, `driver/src/device_addresses.rs`.

mod addresses;
mod draw_resources;
mod indexing;
mod sets;
