//! Shared libraries of the workspace that tests load.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

/// The variable for the folder of shared libraries that were built with the tests.
const LIBRARIES: &str = "GAURAST_TEST_LIBRARIES";

/// The path of a package's shared library in the profile of this executable.
///
/// Cargo does not build a shared library for a test. The library is taken from the folder that `GAURAST_TEST_LIBRARIES`
/// names, if it is set; otherwise this function runs cargo to build it.
///
/// # Panics
/// If the build fails; the message has its output.
pub fn built_library(package: &str, file: &str) -> PathBuf {
    built(package, &[], Path::new(file))
}

/// The path of a package's example, likewise.
///
/// # Panics
/// As [`built_library`].
pub fn built_example(package: &str, name: &str) -> PathBuf {
    let file = Path::new("examples").join(name);
    built(package, &["--example", name], &file)
}

/// The path of a `file` in the profile's folder, which is what cargo makes of `targets` of a package.
fn built(package: &str, targets: &[&str], file: &Path) -> PathBuf {
    static ONE_BUILD: Mutex<()> = Mutex::new(());
    if let Some(built) = std::env::var_os(LIBRARIES) {
        let library = Path::new(&built).join(file);
        assert!(library.exists(), "{LIBRARIES}: there is no {}", library.display());
        return library;
    }
    let test = std::env::current_exe().expect("the test's own path");
    let folder = test
        .ancestors()
        .find(|folder| folder.ends_with("deps"))
        .and_then(Path::parent)
        .expect("cargo keeps tests in a profile's folder `deps`");
    let profile = match folder.file_name().and_then(|name| name.to_str()) {
        Some("debug") => "dev",
        Some(profile) => profile,
        None => panic!("{} has no name", folder.display()),
    };
    let library = folder.join(file);
    let _one = ONE_BUILD.lock();
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["build", "--quiet", "--package", package, "--profile", profile])
        .args(targets)
        .arg("--target-dir")
        .arg(folder.parent().expect("the target folder"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs");
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "cargo build -p {package}: {message}");
    assert!(library.exists(), "there is no {}", library.display());
    library
}
