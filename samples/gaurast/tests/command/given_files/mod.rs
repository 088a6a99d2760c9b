//! The `gaurast` command with files of other programs: invalid files are refused with a reason, and pictures use the
//! camera of a camera file.

mod cameras;
mod faults;
mod fixtures;
mod golden;
mod gpu;
mod lenses;

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
