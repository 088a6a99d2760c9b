//! The extension's structures, its C header, its place beside ash and its camera helpers.

mod ash_chain;
mod camera;
mod header;
mod layout;
mod names;

fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}
