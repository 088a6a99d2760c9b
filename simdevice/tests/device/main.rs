//! Tests of the device through packets: pictures, errors, counters, and the simulated cost.

mod command_processor;
#[path = "../common/mod.rs"]
mod common;
mod compute;
mod levels;
mod optimizations;
mod random_gaussians;
mod render_pass;
#[path = "../common/scenes.rs"]
mod scenes;
mod timing;

fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}
