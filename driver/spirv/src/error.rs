//! The reason that a shader can't be used, and the instruction.

use isa::validate::InvalidProgram;
use spirv::Op;
use thiserror::Error;

use super::Stage;

/// The instruction in which a problem was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InstructionRef {
    /// The instruction's name.
    pub opcode: Op,
    /// The id that it defines; if it defines none, its first id operand.
    pub id: Option<u32>,
}

impl std::fmt::Display for InstructionRef {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Op{:?}", self.opcode)?;
        match self.id {
            Some(id) => write!(f, " %{id}"),
            None => Ok(()),
        }
    }
}

/// The reason that a shader module, or an entry point of it, can't be used.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum Error {
    /// The words aren't a SPIR-V module that can be decoded.
    #[error("not SPIR-V: {reason}")]
    Binary {
        /// The fault.
        reason: String,
    },
    /// An instruction breaks a rule of SPIR-V.
    #[error("malformed SPIR-V: {instruction}: {reason}")]
    Malformed {
        /// The instruction.
        instruction: InstructionRef,
        /// The fault.
        reason: String,
    },
    /// An instruction needs something that this driver doesn't support.
    #[error("unsupported SPIR-V: {instruction}: {reason}")]
    Unsupported {
        /// The instruction.
        instruction: InstructionRef,
        /// The unsupported thing.
        reason: String,
    },
    /// The module, or its translation, is too big.
    #[error("shader too large: {what} exceed {limit}")]
    TooLarge {
        /// The thing that is too big.
        what: &'static str,
        /// The most that is allowed.
        limit: u64,
    },
    /// The module has no such entry point.
    #[error("the module has no {stage} entry point named \"{name}\"")]
    NoEntryPoint {
        /// The requested name.
        name: String,
        /// The requested stage.
        stage: Stage,
    },
    /// A specialization constant is given a value of the wrong size.
    #[error("specialization constant {id} takes {expected} bytes, but was given {given}")]
    Specialization {
        /// The constant's `SpecId`.
        id: u32,
        /// The constant's size in bytes.
        expected: usize,
        /// The value's size in bytes.
        given: usize,
    },
    /// The system could not start a thread for the translation.
    #[error("there is no thread to translate on: {reason}")]
    NoThread {
        /// The system's message.
        reason: String,
    },
    /// The translation broke a rule of the device's IR.
    #[error("the shader can't be translated: {0}")]
    Program(#[from] InvalidProgram),
}

/// A problem whose instruction isn't known yet.
#[derive(Clone, Debug)]
pub(crate) enum Diagnostic {
    /// See [`Error::Malformed`].
    Malformed(String),
    /// See [`Error::Unsupported`].
    Unsupported(String),
    /// A complete error.
    Located(Error),
}

/// The result of translating a part of a shader.
pub(crate) type Result<T, E = Diagnostic> = std::result::Result<T, E>;

/// The diagnostic of a violation of SPIR-V's rules.
pub(crate) fn malformed<T>(reason: impl Into<String>) -> Result<T> {
    Err(Diagnostic::Malformed(reason.into()))
}

/// The diagnostic of something that this driver doesn't support.
pub(crate) fn unsupported<T>(reason: impl Into<String>) -> Result<T> {
    Err(Diagnostic::Unsupported(reason.into()))
}

impl Diagnostic {
    /// Adds the instruction, unless it is known already.
    pub(crate) fn locate(self, instruction: InstructionRef) -> Error {
        match self {
            Self::Malformed(reason) => Error::Malformed { instruction, reason },
            Self::Unsupported(reason) => Error::Unsupported { instruction, reason },
            Self::Located(error) => error,
        }
    }
}

impl From<Error> for Diagnostic {
    fn from(error: Error) -> Self {
        Self::Located(error)
    }
}
