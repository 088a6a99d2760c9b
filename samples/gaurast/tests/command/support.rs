//! Runs of the command in a folder.

use std::path::Path;
use std::process::{Command, Output};

use tempfile::TempDir;

/// Runs `gaurast` with `arguments` in `folder`.
pub fn gaurast(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_gaurast"))
        .args(arguments)
        .current_dir(folder)
        .env_remove("RUST_LOG")
        .output()
        .expect("the command starts")
}

/// Output as text.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs the command, checks that it succeeds, and returns its output.
#[track_caller]
pub fn succeeds(folder: &TempDir, arguments: &[&str]) -> String {
    let output = gaurast(folder.path(), arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}
