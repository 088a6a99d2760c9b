//! Shader cores as a Vulkan application sees them.

mod instructions;
mod kernels;
mod structured;

use gaurast_tests::kernels::Context;

/// lavapipe, where `Need::Lavapipe` is met.
fn lavapipe() -> Context {
    let found = Context::lavapipe().expect("lavapipe is opened");
    found.expect("the loader knows lavapipe")
}
