//! The place of the repository.

use std::path::Path;

/// The root of the repository that this crate was built in.
pub fn repository() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}
