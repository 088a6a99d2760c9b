//! Tests that hold what the driver does against the binary64 oracle, exact models, and other drivers.

mod driver;
mod gaussian;
mod shader;
mod simulator;
mod stress;
mod triangles;

/// The compiler of the shaders that are written in GLSL.
const GLSLANG: gaurast_runner::Need = gaurast_runner::Need::Program("glslangValidator");

fn main() -> std::process::ExitCode {
    // SAFETY: no other thread runs yet.
    unsafe { triangles::devices::set_environment() };
    gaurast_runner::main()
}
