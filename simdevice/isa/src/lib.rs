//! Shader cores: the device's own instruction set and the engine that runs it.
//!
//! # The machine
//!
//! A program runs on a **batch** of lanes (a multiple of 16): some vertices, the fragments of some quads, or one compute
//! workgroup; the caller says how many lanes a batch has. Registers are structure-of-arrays: a register holds one scalar
//! for each lane, and each instruction processes all lanes before the next begins. So the cost of decoding an instruction
//! is paid once a batch, and a barrier is nothing more than the end of an instruction.
//!
//! # Registers
//!
//! A register ([`ir::Reg`]) has a [`ir::Type`]: `B32` (the bits of an `f32`, `i32` or `u32`; the operation says
//! which), `B64` (likewise 64 bits) or `Bool` (all ones or all zeros). Vectors and matrices are taken apart by
//! whoever builds the program. A register has one of two roles:
//!
//! - a **value** is defined once: a constant, an input, or the result of one instruction. An instruction computes
//!   *all* lanes, active or not. A value may be used after its definition, in the same block or anything that
//!   follows; a use outside the innermost loop around its definition is allowed too, and is rewritten into a
//!   variable when the program is finished (see [`builder::Builder::finish`]).
//! - a **variable** is written only by [`ir::Statement::Assign`], any number of times, and only in the lanes that
//!   are active there. Phis, promoted function variables and outputs are variables. Reading a variable is just
//!   naming it as an operand. Outputs start as zero in every batch; another variable holds nothing in
//!   particular until it is assigned.
//!
//! Whether a register is **uniform** (one value for the whole batch) is found by analysis, not declared; an
//! input alone says it of itself ([`ir::Rate`]).
//!
//! 8- and 16-bit integers live sign- or zero-extended in `B32` registers: compute in 32 bits, then
//! [`op::Op::SExt8`], [`op::Op::SExt16`], or `And` with a mask. `f16` is computed in `f32` and rounded with
//! [`op::Op::RoundToF16`]; for one addition, multiplication, division or square root that is exact.
//!
//! # Control flow
//!
//! The body of a program is a tree of [`ir::Statement`]s. Divergence is kept as a mask of active lanes: each
//! branch of an `If` runs if any lane takes it; a loop runs until no lane is left in it. `Break` and `Continue`
//! name the construct that they leave by its [`ir::Label`]. Masks act at assignments, stores, atomics, image
//! writes and subgroup operations; nothing else looks at them. Each loop's back edge checks the
//! [`machine::Watchdog`].
//!
//! A **helper** lane (a fragment outside the primitive that completes a quad, or a demoted one) computes and
//! assigns like any other, but its stores, atomics and image writes do nothing.
//!
//! # Memory
//!
//! Addresses are bytes within a [`ir::Space`]: a bound buffer, push constants, workgroup memory, per-lane private
//! memory, or global memory (64-bit device addresses). Every access is bounds-checked; one that is out of range, or
//! misaligned, reads zero or vanishes. Images are reached through the [`resources::ImageUnit`] interface.
//!
//! # Life of a program
//!
//! [`builder::Builder`] → [`ir::Program`], checked → [`machine::Executable`] (optimized, registers allocated, control flow
//! linearized, lanes fixed) → [`machine::Machine::run`], once a batch.
//!
//! # Modules
//!
//! `ir` is imported by all others; `builder` makes programs of it. `kernels` are the operations on registers; `compiler`
//! makes steps of a program, and folds constants by the kernels; `machine` runs the steps. `resources` is what a program
//! reaches outside its registers, as traits that the caller implements.

#![forbid(unsafe_code)]

pub mod builder;
mod compiler;
pub mod ir;
mod kernels;
pub mod machine;
pub mod resources;

pub use compiler::Options;
pub use devmem::level;
pub use ir::{op, validate};
pub use kernels::combine;
pub use kernels::registers::Vector;

#[cfg(test)]
mod tests;

#[cfg(test)]
fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}
