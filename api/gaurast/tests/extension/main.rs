//! Tests of the extension's structures, its C header, its use with ash, and its camera helpers.

mod ash_chain;
mod camera;
mod header;
mod layout;
mod names;

fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}
