//! Checks that `docs/refusals.md` names each rule of which the driver speaks, once, and no other.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The Rust files below a folder, without those of tests.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|it| it == "rs") && path.file_stem().is_none_or(|it| it != "tests") {
            found.push(path);
        }
    }
    found
}

/// The ids of rules in a text: `VUID`, the place, its part, and a number or a word.
fn ids(text: &str) -> Vec<&str> {
    let words = text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '-'));
    words.filter(|word| word.starts_with("VUID-") && word.split('-').count() == 4).collect()
}

#[gaurast_runner::test]
fn every_rule_of_the_driver_is_decided() {
    let mut spoken = BTreeSet::new();
    for path in sources(&root().join("driver/src")) {
        let text = read(&path);
        let end = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
        spoken.extend(ids(&text[..end]).into_iter().map(str::to_owned));
    }
    assert!(spoken.len() > 300, "{}", spoken.len());
    let page = read(&root().join("docs/refusals.md"));
    let listed = ids(&page);
    let decided: BTreeSet<_> = listed.iter().map(|id| (*id).to_owned()).collect();
    let missing: Vec<_> = spoken.difference(&decided).collect();
    assert!(missing.is_empty(), "docs/refusals.md must decide {missing:#?}");
    let gone: Vec<_> = decided.difference(&spoken).collect();
    assert!(gone.is_empty(), "the driver does not speak of {gone:#?}");
    assert_eq!(listed.len(), decided.len(), "a rule is listed twice");
}
