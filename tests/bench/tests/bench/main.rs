//! The benchmarks' program, and the quads that it measures against.

mod command_line;
mod quads;

use std::process::ExitCode;

fn main() -> ExitCode {
    gaurast_runner::main()
}
