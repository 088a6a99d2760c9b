//! The chapters *Memory Allocation* and *Resource Creation*.
//!
//! Unit tests: `driver/src/resource`.

mod device_groups;
mod device_memory;
mod extended_usage;
mod hints;
mod linear_images;
mod volumes_of_depths;
