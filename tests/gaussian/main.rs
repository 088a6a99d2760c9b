//! Tests of the extension's text: Gaussian draws from an application's calls to pixels, compared with the binary64 oracle.
//!
//! The reason for all `unsafe` here is the same: these are Vulkan calls. Each test follows Vulkan's valid usage, or
//! violates one rule on purpose, which the driver must survive.
//!
//! Unit tests: `driver/src/command/camera.rs`, `driver/src/command/replay/gaussian.rs`.

mod accuracy;
mod approximations;
mod cameras;
mod conformance_cases;
mod depth_stencil;
mod determinism;
mod draws;
mod given_scenes;
mod hybrid_scenes;
mod instances;
mod interactions;
mod interleavings;
mod modes;
mod mutants;
mod pipelines;
mod popping;
mod rasterization_modes;
mod recorded_work;
mod reference;
mod second;
mod shaded;
mod shaders;
mod simulator;
mod stress;
mod valid_usage;
mod viewer;
mod viewer_usage;
mod what_ifs;

/// A trained scene of the test data.
const SKULL: &str = "splats/skull.ply";
const PLAYBOT: &str = "splats/playbot-125k.ply";

fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}
