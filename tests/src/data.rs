//! Where test data lies.
//!
//! Real files (splats, meshes, cameras) are no part of the project: they are looked for in
//! `shared/data` next to the workspace, and a test that needs one skips aloud without it.

use std::path::{Path, PathBuf};

/// The folder of test data, whether or not it is there.
pub fn data_dir() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data")
}

/// The path of a test file, given relative to [`data_dir`], or `None` and a printed reason.
///
/// ```no_run
/// let Some(path) = gaurast_tests::data::require_data("splats/skull.ply") else {
///     return;
/// };
/// ```
pub fn require_data(name: &str) -> Option<PathBuf> {
    let path = data_dir().join(name);
    if path.exists() {
        return Some(path);
    }
    eprintln!("skipped: {} is not there", path.display());
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_not_there_is_none() {
        assert_eq!(require_data("no/such/file.ply"), None);
    }

    #[test]
    fn a_file_that_is_there_is_found() {
        let Some(path) = require_data("splats/skull.ply") else {
            return;
        };
        assert!(path.is_file());
    }
}
