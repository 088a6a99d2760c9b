//! Checks that the modules of each crate of the workspace have no import cycles: there is no cycle between the children
//! of any module. Packages depend on each other as the layers say, and bindings are named after their types. What packets add
//! to the device is allocated by functions that can fail. `cargo package` takes the packages that are published. The
//! repository has the project's own files alone.
//!
//! All paths in the sources count (imports, expressions, types, macro arguments), except those of tests within a crate.
//! An `impl` outside the module of its type counts as an arrow from the type's module to that of the `impl`, since
//! readers of the type must go there. Types in generated files are exempt, because those files cannot hold handwritten
//! code. `known.txt` lists the crates that still have cycles. A crate without cycles must not be listed.

mod allocations;
mod bindings;
mod graph;
mod harness;
mod layers;
mod packages;
mod refusals;
mod repository;
mod source;
mod workspace;

use std::process::ExitCode;

use gaurast_runner::{Case, Variant};
use source::Crate;
use workspace::Target;

fn main() -> ExitCode {
    gaurast_runner::main()
}

fn targets() -> Vec<Target> {
    let packages = workspace::packages();
    packages.iter().flat_map(|package| package.targets()).collect()
}

fn names() -> Vec<Variant> {
    let targets = targets().into_iter();
    targets.map(|target| Variant::new(target.name)).collect()
}

/// The crates that still have cycles.
fn known() -> impl Iterator<Item = &'static str> {
    let lines = include_str!("known.txt").lines();
    lines.filter(|line| !line.starts_with('#'))
}

#[gaurast_runner::test(each = names())]
fn modules_have_no_cycle(case: &Case) {
    let targets = targets();
    let target = targets.iter().find(|target| target.name == case.variant()).expect("a crate");
    let source = Crate::read(&target.name.replace('-', "_"), &target.root);
    let found: String = graph::arrows_in_cycles(&source.arrows()).iter().map(|arrow| format!("{arrow}\n")).collect();
    if known().any(|name| name == target.name) {
        assert!(!found.is_empty(), "no cycle any more: off the list with it");
    } else {
        assert!(found.is_empty(), "arrows in cycles:\n{found}");
    }
}

#[gaurast_runner::test]
fn known_crates_are_there() {
    let targets = targets();
    for name in known() {
        assert!(targets.iter().any(|target| target.name == name), "{name}");
    }
}

#[gaurast_runner::test]
fn all_crates_are_found() {
    let targets = targets();
    for name in [
        "gaurast",
        "gaurast-driver",
        "registry-gen/main",
        "gaurast-cli/main",
        "gaurast-examples/hello_triangle",
        "gaurast-bench/gaurast-bench",
        "gaurast-tests/vulkan",
    ] {
        let is_there = targets.iter().any(|target| target.name == name);
        assert!(is_there, "{name}");
    }
    assert!(targets.len() > 40, "{}", targets.len());
}
