//! Registers: their types and roles.

use std::fmt::{Display, Formatter, Result};

/// Lanes in a vector, the unit that registers are stored and computed in. Batches are whole numbers of vectors.
pub const VECTOR_LANES: usize = 16;

/// A register: an index into [`Program::registers`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Reg(pub u32);

/// The type of a register, which is its width.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Type {
    /// A truth value.
    Bool,
    /// 32 bits: `f32`, `i32` or `u32`, as the operation says.
    B32,
    /// 64 bits: `f64`, `i64` or `u64`.
    B64,
}

/// The role of a register: defined once, or assigned any number of times.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// Defined once, in all lanes.
    Value,
    /// Written by [`Statement::Assign`], in the active lanes.
    Variable,
}

/// A register's declaration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Register {
    /// Its type.
    pub ty: Type,
    /// Its role.
    pub role: Role,
}

impl Display for Reg {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "%{}", self.0)
    }
}

/// Registers with commas between them.
pub(super) struct List<'a>(pub &'a [Reg]);

impl Display for List<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        for (index, reg) in self.0.iter().enumerate() {
            write!(f, "{}{reg}", if index > 0 { ", " } else { "" })?;
        }
        Ok(())
    }
}
