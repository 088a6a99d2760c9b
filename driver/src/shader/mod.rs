//! The SPIR-V front end: modules are decoded, reflected on, and translated to the device's IR.
//!
//! [`Module::parse`] when a shader module is created; [`translate`] for each stage when a pipeline is created, with its
//! specialization constants; [`reflect::check`] to compare what came of it with the pipeline's layout.
//!
//! The words of a module may be anything: what is malformed or unsupported is an [`Error`] that names the instruction,
//! in bounded time and memory, never a panic.

mod constant;
mod decoder;
mod error;
mod globals;
mod grammar;
mod instruction;
mod interface;
mod module;
pub mod reflect;
mod translate;
mod types;

pub use error::{Error, Place};
pub use globals::Specialization;
pub use interface::{
    BuiltIn, DepthMode, Descriptor, DescriptorKind, ImageUse, Input, InputSource, Interface,
    Interpolation, Numeric, Output, OutputTarget, Sampling, Shader, Stage,
};
pub use module::Module;
pub use translate::{Options, is_supported, translate};
