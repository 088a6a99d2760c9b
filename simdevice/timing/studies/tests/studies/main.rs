//! Tests of the hardware models against each other, and of the documents generated from their results.

mod models;
mod paper;
mod rivals;
mod sensitivity;
mod trace;

fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}
