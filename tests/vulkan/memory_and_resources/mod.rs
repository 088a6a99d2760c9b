//! The chapters *Memory Allocation* and *Resource Creation*.
//!
//! Unit tests: `driver/src/resource`, `driver/src/external.rs`, `simdevice/devmem/src/shared.rs`.

mod device_groups;
mod device_memory;
mod extended_usage;
mod external_memory;
mod hints;
mod linear_images;
mod volumes_of_depths;
