//! Errors of generation. Each names what has to be changed.

use std::path::PathBuf;

/// A reason why nothing is generated.
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
        /// The version and checksum that are wanted.
        expected: String,
    },
    /// A registry that is no valid one.
    #[error("{path}: {reason}")]
    Registry {
        /// The file.
        path: PathBuf,
        /// The fault.
        reason: String,
    },
    /// Rust that can't be parsed.
    #[error("{path}: {source}")]
    Rust {
        /// The file.
        path: PathBuf,
        /// The fault.
        source: syn::Error,
    },
    /// A `support.toml` that can't be parsed.
    #[error("driver/support.toml: {0}")]
    SupportSyntax(#[from] toml::de::Error),
    /// A `support.toml` that contradicts the registry.
    #[error("driver/support.toml: {0}")]
    Support(String),
    /// An entry point that contradicts the registry.
    #[error("driver/src: {0}")]
    EntryPoint(String),
    /// A thing of the registry that ash or gaurast doesn't declare.
    #[error("ash declares no {0}")]
    Undeclared(String),
}
