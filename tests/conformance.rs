//! Conformance tests: they compare the driver with the binary64 oracle, exact models and other drivers.

mod driver;
mod gaussian;
mod needs;
mod shader;
mod simulator;
mod stress;
mod triangles;

pub use needs::GLSLANG;

fn main() -> std::process::ExitCode {
    // SAFETY: no other thread runs yet.
    unsafe { triangles::devices::set_environment() };
    gaurast_runner::main()
}
