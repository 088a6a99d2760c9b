//! Checks that the repository has nothing but the project's own files.

use std::collections::BTreeSet;
use std::process::Command;

use gaurast_runner::Need;

use crate::workspace;

/// The entries of the top level: the project's folders, and what every project has.
const TOP_LEVEL: [&str; 26] = [
    ".ci",
    ".dockerignore",
    ".editorconfig",
    ".github",
    ".gitignore",
    "ARCHITECTURE.md",
    "CHANGELOG.md",
    "CITATION.cff",
    "CONTRIBUTING.md",
    "Cargo.lock",
    "Cargo.toml",
    "Dockerfile",
    "LICENSE-APACHE",
    "LICENSE-MIT",
    "README.md",
    "SECURITY.md",
    "api",
    "clippy.toml",
    "deny.toml",
    "docs",
    "driver",
    "rust-toolchain.toml",
    "rustfmt.toml",
    "samples",
    "simdevice",
    "tests",
];

/// The size of the largest file that the repository may have, in bytes.
const MAX_SIZE: u64 = 1 << 20;

/// The paths of the files that git knows, or would add.
fn files() -> Vec<String> {
    let mut command = Command::new("git");
    command.current_dir(workspace::root()).args(["ls-files", "--cached", "--others", "--exclude-standard", "-z"]);
    let output = command.output().expect("git starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("paths are text");
    text.split_terminator('\0').map(str::to_owned).collect()
}

/// The entries of the top level that paths have and that are not the project's.
fn strangers<'a>(files: &[&'a str]) -> BTreeSet<&'a str> {
    let entries = files.iter().filter_map(|path| path.split('/').next());
    entries.filter(|entry| !TOP_LEVEL.contains(entry)).collect()
}

#[gaurast_runner::test(needs = [Need::Program("git")])]
fn the_repository_has_the_projects_files_alone() {
    let files = files();
    let paths: Vec<&str> = files.iter().map(String::as_str).collect();
    assert!(paths.len() > 1000, "{} files", paths.len());
    assert_eq!(strangers(&paths), BTreeSet::new());
    let size = |path: &&&str| std::fs::metadata(workspace::root().join(path)).map_or(0, |file| file.len());
    let large: Vec<_> = paths.iter().filter(|path| size(path) > MAX_SIZE).collect();
    assert!(large.is_empty(), "{large:#?}");
}

#[gaurast_runner::test]
fn files_of_others_are_found() {
    assert_eq!(strangers(&["api/a.rs", "a.whl", "tests/b.rs", "build/c"]), BTreeSet::from(["a.whl", "build"]));
}
