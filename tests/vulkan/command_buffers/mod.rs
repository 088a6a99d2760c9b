//! The chapter *Command Buffers*.
//!
//! Unit tests: `driver/src/command`.

pub mod commands;
mod life_cycle;
