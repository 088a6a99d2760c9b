//! The intermediate representation: a tree of statements over typed scalar registers. See [`super`] for what it means.

mod image;
mod memory;
pub mod op;
mod program;
mod register;
mod statement;
pub mod validate;
mod waiting;

pub use image::{Dimension, ImageAtomic, ImageQuery, ImageRead, ImageShape, ImageWrite, Lod, Sample};
pub use memory::{Address, AtomicOp, Binding, Format, Space};
pub use program::{
    Constant, Input, MAX_LANES, MAX_MEMORY_BYTES, MAX_NESTING, MAX_SUBGROUP_SIZE, Output, Program, Rate,
};
pub use register::{Reg, Register, Role, Type, VECTOR_LANES};
pub(crate) use statement::contains;
pub use statement::{Axis, Block, Case, Label, Statement, SubgroupOp, is_reducible};
