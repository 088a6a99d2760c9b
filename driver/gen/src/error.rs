//! Errors of generation. Each names what has to be changed to fix it.

use std::path::PathBuf;

/// The reason that no files are generated.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file can't be read or written.
    #[error("{path}: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: std::io::Error,
    },
    /// A program can't be run, or fails.
    #[error("{program}: {reason}")]
    Program {
        /// The program's name.
        program: &'static str,
        /// Its message.
        reason: String,
    },
    /// The registry is of another version.
    #[error("{path} has the SHA-256 {found}; this generator reads the registry of {expected}")]
    OtherRegistry {
        /// The file.
        path: PathBuf,
        /// Its checksum.
        found: String,
        /// The version and checksum that are expected.
        expected: String,
    },
    /// The registry is invalid.
    #[error("{path}: {reason}")]
    Registry {
        /// The file.
        path: PathBuf,
        /// The fault.
        reason: String,
    },
    /// Rust source can't be parsed.
    #[error("{path}: {source}")]
    Rust {
        /// The file.
        path: PathBuf,
        /// The fault.
        source: syn::Error,
    },
    /// `support.toml` can't be parsed.
    #[error("driver/support.toml: {0}")]
    SupportSyntax(#[from] toml::de::Error),
    /// `support.toml` contradicts the registry.
    #[error("driver/support.toml: {0}")]
    Support(String),
    /// An entry point contradicts the registry.
    #[error("driver/src: {0}")]
    EntryPoint(String),
    /// Neither ash nor gaurast declares a structure or command of the registry.
    #[error("ash declares no {0}")]
    Undeclared(String),
}
