//! Tests of the benchmark program, and of the quads with which it compares.

mod command_line;
mod exact;
mod quads;

use std::process::ExitCode;

fn main() -> ExitCode {
    gaurast_runner::main()
}
