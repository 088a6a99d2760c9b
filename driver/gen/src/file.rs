//! Generated files.

/// A generated file.
#[derive(Debug)]
pub struct File {
    /// Its path from the root of the repository.
    pub path: &'static str,
    /// Its contents.
    pub text: String,
}
