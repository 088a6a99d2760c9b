//! The chapter *Synchronization and Cache Control*.
//!
//! Unit tests: `driver/src/device_sync.rs`, `driver/src/payload.rs`.

mod external_payloads;
mod fences_semaphores_events;
