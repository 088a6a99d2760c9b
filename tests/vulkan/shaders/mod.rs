//! The chapter *Shaders*.
//!
//! Unit tests: `driver/src/shader_module.rs`.

mod clock;
mod features;
mod instructions;
mod kernels;
mod newer_instructions;
mod structured;

use gaurast_workloads::kernels::Context;

/// The context of lavapipe, if `Need::Lavapipe` is met.
fn lavapipe() -> Context {
    let found = Context::lavapipe().expect("lavapipe is opened");
    found.expect("the loader knows lavapipe")
}
