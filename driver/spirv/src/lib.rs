//! The shader compiler's front end: a SPIR-V module is decoded, and its entry points are translated to programs of the
//! device's shader cores. An [`Interface`] describes the inputs, outputs and resources of a program.
//!
//! [`Module::parse`] is called when a shader module is created, and [`translate`] for each stage when a pipeline is
//! created, with its specialization constants.
//!
//! A module may have any words: a malformed or unsupported one gives an [`Error`] that names the instruction, in
//! bounded time and memory, never a panic.

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod decoder;
mod error;
mod globals;
mod grammar;
mod instruction;
mod interface;
mod module;
mod translate;
mod types;

pub use error::{Error, InstructionRef};
pub use globals::Specialization;
pub use interface::{
    BuiltIn, CapturedScalar, DepthMode, DescriptorKind, Domain, ImageUse, Input, InputPrimitive, InputSource,
    Interface, Interpolation, MemoryScalar, Output, OutputPrimitive, OutputTarget, PrimitiveModes, Sampling,
    ScalarType, Shader, ShaderBinding, Spacing, Stage, TransformFeedback, VertexExchange, VertexMemory,
};
pub use module::Module;
pub use translate::{Options, is_supported, translate};
