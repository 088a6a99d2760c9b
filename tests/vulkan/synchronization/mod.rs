//! The chapter *Synchronization and Cache Control*.
//!
//! Unit tests: `driver/src/device_sync.rs`.

mod fences_semaphores_events;
