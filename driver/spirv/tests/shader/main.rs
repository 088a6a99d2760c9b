//! Tests of the translation of SPIR-V to programs of the shader cores, and of the programs' results.

mod assembled;
mod common;
mod execution;
mod fragments;
mod functions;
mod fuzz;
mod interfaces;
mod limits;
mod translation;

fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}
