//! Checks that `cargo package` takes the packages that users depend on, all together.

use std::collections::BTreeSet;
use std::process::Command;

use toml::Value;

use crate::workspace::{self, Package};

/// Reports whether a package is published: it does not inherit `publish = false`.
fn is_published(package: &Package) -> bool {
    package.manifest["package"].get("publish").is_none()
}

/// The packages that are published.
fn published() -> Vec<Package> {
    workspace::packages().into_iter().filter(is_published).collect()
}

#[gaurast_runner::test]
fn published_packages_depend_on_published_packages() {
    let folders: BTreeSet<_> = published().into_iter().map(|package| package.folder).collect();
    assert!(folders.len() > 10, "{folders:?}");
    let dependencies = workspace::dependencies();
    let wrong: Vec<_> = dependencies
        .iter()
        .filter(|dependency| {
            !dependency.is_dev && folders.contains(&dependency.from) && !folders.contains(&dependency.to)
        })
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[gaurast_runner::test]
fn published_packages_say_what_they_are_and_have_the_licences() {
    for Package { name, folder, manifest } in published() {
        for key in ["description", "keywords", "categories", "readme"] {
            assert!(manifest["package"].get(key).is_some_and(|value| *value != Value::from("")), "{name} has no {key}");
        }
        for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
            assert!(workspace::root().join(&folder).join(licence).is_file(), "{name} has no {licence}");
        }
    }
}

/// Packages the published packages. A complete run also builds each from its package alone, which takes minutes.
#[gaurast_runner::test]
fn published_packages_are_packaged() {
    let target = tempfile::tempdir().expect("a folder");
    let mut command = Command::new(env!("CARGO"));
    command.current_dir(workspace::root()).args(["package", "--offline", "--allow-dirty", "--quiet", "--target-dir"]);
    command.arg(target.path());
    if !gaurast_runner::is_long() {
        command.arg("--no-verify");
    }
    let packages = published();
    for package in &packages {
        command.args(["-p", &package.name]);
    }
    let output = command.output().expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for Package { name, .. } in &packages {
        let file = target.path().join(format!("package/{name}-{}.crate", env!("CARGO_PKG_VERSION")));
        assert!(file.is_file(), "{}", file.display());
    }
}
