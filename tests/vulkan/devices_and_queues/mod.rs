//! The chapter *Devices and Queues*.
//!
//! Unit tests: `driver/src/device.rs`, `driver/src/enabled.rs`, `driver/src/queue.rs`.

mod not_enabled;
mod priorities;
mod queues;
mod watchdog;
