//! The chapters *Memory Allocation* and *Resource Creation*.
//!
//! Unit tests: `driver/src/resource`.

mod device_memory;
