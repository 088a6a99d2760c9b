//! The models of the hardware against each other, and the documents that are made of what they say.

mod models;
mod paper;
mod sensitivity;
mod trace;

fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}
