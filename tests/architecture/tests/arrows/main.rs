//! The modules of a crate import each other one way: no cycle stands among the children of any module.
//!
//! All paths in the sources count (imports, expressions, types, macros' arguments), but for those of tests. An `impl`
//! outside its type's module is an arrow back from that module, since whoever reads the type must go there.
//! `known.txt` lists the arrows of cycles that are there still. It only shrinks: an arrow that is no longer part of a
//! cycle must leave it.

mod graph;
mod harness;
mod source;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use gaurast_runner::{Case, Variant};
use graph::Arrow;
use source::Crate;

/// The crates that are held, by their folders.
const CRATES: [(&str, &str); 5] = [
    ("devmem", "simdevice/devmem"),
    ("isa", "simdevice/isa"),
    ("timing", "simdevice/timing"),
    ("simdevice", "simdevice"),
    ("gaurast_spirv", "driver/spirv"),
];

fn main() -> ExitCode {
    gaurast_runner::main()
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn known_arrows(of: &str) -> BTreeSet<String> {
    let text = include_str!("known.txt");
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines
        .filter(|line| line.split("::").next() == Some(of))
        .map(str::to_owned)
        .collect()
}

fn crates() -> Vec<Variant> {
    CRATES.map(|(name, _)| Variant::new(name)).into()
}

#[gaurast_runner::test(each = crates())]
fn modules_have_no_cycle_but_the_known(case: &Case) {
    let name = case.variant();
    let (_, folder) = CRATES
        .iter()
        .find(|(known, _)| *known == name)
        .expect("a crate");
    let source = Crate::read(name, &root().join(folder).join("src/lib.rs"));
    let found: BTreeSet<String> = graph::arrows_in_cycles(&source.arrows())
        .iter()
        .map(Arrow::to_string)
        .collect();
    let known = known_arrows(name);
    let list = |set: Vec<&String>| {
        set.into_iter()
            .map(|arrow| format!("{arrow}\n"))
            .collect::<String>()
    };
    let (new, gone) = (
        list(found.difference(&known).collect()),
        list(known.difference(&found).collect()),
    );
    assert!(new.is_empty(), "new arrows in cycles:\n{new}");
    assert!(
        gone.is_empty(),
        "no longer in a cycle, to be taken off the list:\n{gone}"
    );
}
