//! The chapters *Memory Allocation* and *Resource Creation*.
//!
//! Unit tests: `driver/src/resource`, `driver/src/external.rs`, `simdevice/devmem/src/shared.rs`.

mod device_memory;
mod extended_usage;
mod external_memory;
mod linear_images;
