//! The class of precision in which the kernels compute.

use gaurast::vk::GaussianPrecisionClassGAURAST as Class;

/// The class that `GAURAST_EMULATION_PRECISION` names: `relaxed`, or the full one.
pub(crate) fn class() -> Class {
    match std::env::var_os("GAURAST_EMULATION_PRECISION") {
        Some(name) if name == "relaxed" => Class::RELAXED,
        _ => Class::FULL,
    }
}

/// Reports whether numbers are binary32 alone.
pub(crate) fn is_relaxed() -> bool {
    class() == Class::RELAXED
}
