//! The chapter *Command Buffers*.
//!
//! Unit tests: `driver/src/command`.

mod life_cycle;
mod markers;
