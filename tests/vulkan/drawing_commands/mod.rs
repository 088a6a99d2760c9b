//! The chapters *Drawing Commands* and *Fixed-Function Vertex Processing*.
//!
//! Unit tests: `driver/src/command/replay`.

mod conditional_rendering;
mod draws;
