//! Tests of the `gaurast` command, the renderer, and the C sample.

mod c_program;
mod command_line;
mod compliance;
mod devices;
mod encoded;
mod evaluation;
mod files;
mod given_files;
#[cfg(target_os = "linux")]
mod interruptions;
mod renderer;
mod renderers;
mod support;
mod tasks;

fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}
