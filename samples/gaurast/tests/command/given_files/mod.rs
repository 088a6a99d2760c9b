//! The `gaurast` command with files that others made: what it refuses and why, and that a camera
//! file's camera is the one that it draws with.

mod cameras;
mod fixtures;

use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Output};

/// Runs `gaurast render` with `arguments` in `folder`.
fn render<A: AsRef<OsStr>>(folder: &Path, arguments: impl IntoIterator<Item = A>) -> Output {
    Command::new(env!("CARGO_BIN_EXE_gaurast"))
        .arg("render")
        .args(arguments)
        .current_dir(folder)
        .env_remove("RUST_LOG")
        .output()
        .expect("the command starts")
}
