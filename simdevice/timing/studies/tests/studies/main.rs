//! The models of the hardware against each other, and the documents that are made of what they say.

mod models;
mod paper;
mod rtl;
mod sensitivity;
mod tiles;
mod trace;

fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}
