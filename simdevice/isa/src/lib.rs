//! Shader cores: the device's own instruction set and the engine that runs it.
//!
//! # The machine
//!
//! A program runs on a **batch** of lanes (a multiple of 16): some vertices, the fragments of some quads, or one
//! compute workgroup. The caller chooses the number of lanes. Registers are structure-of-arrays: a register holds one
//! scalar for each lane, and each instruction processes all lanes before the next begins. So an instruction is decoded
//! once a batch, and a barrier is the end of an instruction.
//!
//! # Registers
//!
//! A register ([`ir::Reg`]) has a [`ir::Type`]: `B32` (the bits of an `f32`, `i32` or `u32`; the operation says which),
//! `B64` (likewise 64 bits) or `Bool` (all ones or all zeros). The caller of the builder splits vectors and matrices
//! into scalars. A register has one of two roles:
//!
//! - a **value** is defined once: a constant, an input, or the result of one instruction. An instruction computes
//!   *all* lanes, active or not. A value may be used after its definition, in the same block or anything that
//!   follows; a use outside the innermost loop around its definition is allowed too, and is rewritten into a
//!   variable when the program is finished (see [`builder::Builder::finish`]).
//! - a **variable** is written only by [`ir::Statement::Assign`], any number of times, and only in the lanes that are
//!   active there. Phis, promoted function variables and outputs are variables. An operand that names a variable reads
//!   it. Outputs are zero when a batch begins; another variable is undefined until it is assigned.
//!
//! The compiler finds by analysis the registers that are **uniform** (one value for the whole batch). Only inputs
//! declare it ([`ir::Rate`]).
//!
//! 8- and 16-bit integers are kept sign- or zero-extended in `B32` registers: compute in 32 bits, then
//! [`op::Op::SExt8`], [`op::Op::SExt16`], or `And` with a mask. `f16` is computed in `f32` and rounded with
//! [`op::Op::RoundToF16`]; for one addition, multiplication, division or square root that is exact.
//!
//! # Control flow
//!
//! The body of a program is a tree of [`ir::Statement`]s. Divergence is kept as a mask of active lanes: each branch of
//! an `If` runs if any lane takes it; a loop runs until no lane is left in it. `Break` and `Continue` name the
//! construct that they leave by its [`ir::Label`]. Masks affect assignments, stores, atomics, image writes and subgroup
//! operations; nothing else depends on them. Each loop's back edge checks the [`machine::Watchdog`].
//!
//! A **helper** lane (a fragment outside the primitive that completes a quad, or a demoted one) computes and
//! assigns like any other, but its stores, atomics and image writes do nothing.
//!
//! # Memory
//!
//! Addresses are bytes within a [`ir::Space`]: a bound buffer, push constants, workgroup memory, per-lane private
//! memory, or global memory (64-bit device addresses). Every access is bounds-checked. A load that is out of range or
//! misaligned gives zero; such a store does nothing. Images are reached through the [`resources::ImageUnit`] interface.
//!
//! # Stages of a program
//!
//! [`builder::Builder`] → [`ir::Program`], checked → [`machine::Executable`] (optimized, registers allocated, control
//! flow linearized, lanes fixed) → [`machine::Machine::run`], once a batch.
//!
//! # Modules
//!
//! `ir` is imported by all others; `builder` makes programs of it. `kernels` are the operations on registers;
//! `compiler` makes steps of a program, and folds constants with the kernels; `machine` runs the steps. `resources` has
//! the traits through which a program reaches buffers, images and global memory; the caller implements them.

#![forbid(unsafe_code)]
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

pub mod builder;
pub mod clock;
mod compiler;
pub mod ir;
mod kernels;
pub mod machine;
pub mod resources;

pub use compiler::Options;
pub use devmem::level;
pub use ir::{op, validate};
pub use kernels::registers::Vector;
pub use kernels::{combine, evaluate, float};

#[cfg(test)]
mod tests;

#[cfg(test)]
fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}
