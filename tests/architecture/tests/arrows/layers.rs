//! Checks that packages depend on each other as ARCHITECTURE.md says.
//!
//! `api` <- `driver` <- `samples` <- `tests`, and `simdevice` <- `driver`. Nothing outside `tests` depends on packages
//! in `tests`, except that unit tests use the test runner.

use crate::workspace::{self, Dependency};

/// The folder of the test runner.
const RUNNER: &str = "tests/runner";

/// The folders on which packages of a folder may depend. Folders match by prefix, and the first matching row counts.
const LAYERS: &[(&str, &[&str])] = &[
    ("api/layer/interface", &[]),
    ("api/layer", &["api/gaurast", "api/layer/interface"]),
    ("api/emulation/layer", &["api/emulation", "api/layer/interface"]),
    ("api/emulation", &["api/gaurast", "api/layer/interface"]),
    ("api", &["api"]),
    ("simdevice/devmem", &[]),
    ("simdevice/isa", &["simdevice/devmem"]),
    ("simdevice/timing/studies", &["simdevice/timing"]),
    ("simdevice/timing", &[]),
    ("simdevice", &["simdevice"]),
    ("driver/gen", &[]),
    ("driver/spirv", &["simdevice/isa"]),
    ("driver/icd", &["driver"]),
    ("driver/window", &["driver"]),
    ("driver", &["api/gaurast", "driver/spirv", "simdevice"]),
    ("samples", &["api", "driver", "simdevice/timing"]),
    ("tests/oracle", &["api"]),
    ("tests/runner", &["tests/runner"]),
    ("tests/architecture", &[]),
    ("tests", &["api", "driver", "simdevice", "tests"]),
];

/// The additional folders on which tests of a folder may depend.
const TESTS: &[(&str, &[&str])] = &[("api/render", &["driver"]), ("driver/spirv", &["simdevice/devmem"])];

/// Returns true if `folder` is `of` or is inside it.
fn is_in(folder: &str, of: &str) -> bool {
    folder.strip_prefix(of).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
}

/// The allowed folders in a table's first matching row.
fn allowed(table: &[(&str, &'static [&'static str])], from: &str) -> &'static [&'static str] {
    let row = table.iter().find(|(folder, _)| is_in(from, folder));
    row.map_or(&[], |(_, folders)| folders)
}

fn is_allowed(dependency: &Dependency) -> bool {
    let Dependency { from, to, is_dev } = dependency;
    let is_one_of = |folders: &[&str]| folders.iter().any(|folder| is_in(to, folder));
    // Nothing may depend on a package that only generates files.
    to != "driver/gen" && is_one_of(allowed(LAYERS, from))
        || *is_dev && (to == RUNNER || is_one_of(allowed(TESTS, from)))
}

#[gaurast_runner::test]
fn packages_depend_as_the_layers_say() {
    let dependencies = workspace::dependencies();
    assert!(dependencies.len() > 100, "{}", dependencies.len());
    let wrong: Vec<_> = dependencies.iter().filter(|dependency| !is_allowed(dependency)).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[gaurast_runner::test]
fn wrong_arrows_are_found() {
    let dependency = |from: &str, to: &str, is_dev| Dependency { from: from.to_owned(), to: to.to_owned(), is_dev };
    for (from, to, is_dev, expected) in [
        ("api/gaurast", "driver", false, false),
        ("api/layer", "driver", false, false),
        ("api/layer", "api/gaurast", false, true),
        ("api/render", "driver", true, true),
        ("simdevice", "driver", false, false),
        ("driver", "tests/runner", false, false),
        ("driver", "tests/runner", true, true),
        ("samples/gaurast", "tests/oracle", true, false),
        ("tests", "driver/gen", false, false),
        ("tests/oracle", "driver", false, false),
        ("tests/bench", "tests/oracle", false, true),
    ] {
        let found = is_allowed(&dependency(from, to, is_dev));
        assert_eq!(found, expected, "{from} -> {to}");
    }
}
