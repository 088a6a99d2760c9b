//! The chapter *Devices and Queues*.
//!
//! Unit tests: `driver/src/device.rs`, `driver/src/queue.rs`.

mod queues;
mod watchdog;
