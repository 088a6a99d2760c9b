//! Checks that tests of targets with `harness = false` are registered with the runner, because rustc silently drops a
//! plain `#[test]` there.

use std::path::{Path, PathBuf};

use toml::{Table, Value};

use crate::workspace;

/// The source files of a package's targets that have no harness.
fn without_harness(folder: &Path, manifest: &Table) -> Vec<PathBuf> {
    let has_none = |target: &Value| target.get("harness").and_then(Value::as_bool) == Some(false);
    let library = folder.join("src");
    let mut found = Vec::new();
    if manifest.get("lib").is_some_and(has_none) {
        workspace::sources(&library, &[], &mut found);
    }
    let tests = manifest.get("test").and_then(Value::as_array);
    for test in tests.into_iter().flatten().filter(|test| has_none(test)) {
        let text = |key: &str| test.get(key).and_then(Value::as_str);
        let name = text("name").expect("a name");
        let root = match text("path") {
            Some(path) => folder.join(path),
            None => folder.join("tests").join(name).join("main.rs"),
        };
        let parent = root.parent().expect("a folder");
        if root.exists() {
            workspace::sources(parent, std::slice::from_ref(&library), &mut found);
        } else {
            found.push(folder.join("tests").join(format!("{name}.rs")));
        }
    }
    found
}

#[gaurast_runner::test]
fn no_test_is_dropped() {
    let root = workspace::root();
    let mut files = 0;
    for package in workspace::packages() {
        for file in without_harness(&root.join(&package.folder), &package.manifest) {
            files += 1;
            let text = std::fs::read_to_string(&file).expect("a source file");
            let bare = text.lines().position(|line| line.trim() == "#[test]");
            if let Some(line) = bare {
                panic!("{}:{}: a bare #[test]", file.display(), line + 1);
            }
        }
    }
    assert!(files > 100, "{files} files");
}
