//! Errors of the counts.

use gaurast_bench::quads::QuadError;
use gaurast_render::RenderError;
use thiserror::Error;

use crate::callgrind::CallgrindError;

/// A reason for which instructions cannot be counted on this machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum Obstacle {
    #[error("valgrind is not there")]
    NoValgrind,
    #[error("this processor has no AVX2")]
    NoAvx2,
    #[error("there is no Vulkan loader")]
    NoLoader,
}

/// A failure of the counts, or a difference from the stored ones. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum CountsError {
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error(transparent)]
    Quads(#[from] QuadError),
    #[error("there is no Vulkan loader: {0}")]
    NoLoader(String),
    #[error("a worker could not be started or its files not be read: {0}")]
    Io(#[from] std::io::Error),
    #[error("a worker failed: {0}")]
    Worker(String),
    #[error(transparent)]
    Callgrind(#[from] CallgrindError),
    #[error("the stored row \"{0}\" has too few or too many cells")]
    Stored(String),
    #[error("the program's symbols cannot be read: {0}")]
    Object(#[from] object::Error),
    #[error("the program's debug information cannot be read: {0}")]
    Dwarf(#[from] gimli::Error),
    #[error("the program has no symbols: build it without stripping")]
    Stripped,
    #[error("the stored counts are those of the profiling profile, and this program has debug assertions")]
    Profile,
    #[error("{0}")]
    Required(Obstacle),
    #[error("{0} of the counts are not as stored")]
    Differs(usize),
}
