//! Memories, addresses in them, and the formats of their elements.

use std::fmt::{Display, Formatter, Result};

use super::register::{Reg, Type};

/// A descriptor, or an array of them indexed at run time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Binding {
    /// The first bind point.
    pub slot: u32,
    /// The length of the array; 1 for a single descriptor.
    pub count: u32,
    /// The index into the array, if it is computed. It may differ between lanes. An index out of range gives a buffer
    /// of size zero.
    pub index: Option<Reg>,
}

impl Binding {
    /// A single descriptor.
    pub fn new(slot: u32) -> Self {
        Self { slot, count: 1, index: None }
    }
}

/// The memory that an address is relative to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// A bound buffer range.
    Buffer(Binding),
    /// Push constants: read-only.
    PushConstants,
    /// Workgroup memory: one for the batch.
    Shared,
    /// Private memory: one for each lane. 32- and 64-bit accesses only; addresses are multiples of 4.
    Private,
    /// Device addresses of 64 bits.
    Global,
}

/// The address of an access: `base + offset` bytes into a space. The sum doesn't wrap: an overflow is out of range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Address {
    /// The memory.
    pub space: Space,
    /// Byte address: `B32`, or `B64` for [`Space::Global`], where it must be given. None is zero.
    pub base: Option<Reg>,
    /// Bytes added to `base`.
    pub offset: u32,
}

/// The format of an element in memory, little-endian, aligned to its size (64-bit elements to 4 bytes, so that the
/// scalar block layout works; such an access is atomic only when it is aligned to 8).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// A byte, zero-extended to `B32` when loaded; stores take the low bits.
    U8,
    /// A byte, sign-extended.
    S8,
    /// 16 bits, zero-extended.
    U16,
    /// 16 bits, sign-extended.
    S16,
    /// 32 bits.
    B32,
    /// 64 bits.
    B64,
}

impl Format {
    /// The element's size in memory.
    pub fn bytes(self) -> u32 {
        match self {
            Self::U8 | Self::S8 => 1,
            Self::U16 | Self::S16 => 2,
            Self::B32 => 4,
            Self::B64 => 8,
        }
    }

    /// The type of the register that holds an element.
    pub fn register_type(self) -> Type {
        if self == Self::B64 { Type::B64 } else { Type::B32 }
    }
}

/// A read-modify-write operation on memory or a texel. The result is the old value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AtomicOp {
    /// Integer addition.
    IAdd,
    /// Signed minimum.
    SMin,
    /// Signed maximum.
    SMax,
    /// Unsigned minimum.
    UMin,
    /// Unsigned maximum.
    UMax,
    /// Bitwise and.
    And,
    /// Bitwise or.
    Or,
    /// Bitwise exclusive or.
    Xor,
    /// Replacement.
    Exchange,
    /// Replacement if the old value equals a comparator.
    CompareExchange,
    /// Float addition.
    FAdd,
    /// Float minimum; of NaN and a number, the number.
    FMin,
    /// Float maximum.
    FMax,
}

impl Display for Binding {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "#{}", self.slot)?;
        match self.index {
            Some(index) => write!(f, "[{index} of {}]", self.count),
            None => Ok(()),
        }
    }
}

impl Display for Address {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match &self.space {
            Space::Buffer(binding) => write!(f, "buffer{binding}")?,
            Space::PushConstants => write!(f, "push")?,
            Space::Shared => write!(f, "shared")?,
            Space::Private => write!(f, "private")?,
            Space::Global => write!(f, "global")?,
        }
        match self.base {
            Some(base) => write!(f, "[{base} + {}]", self.offset),
            None => write!(f, "[{}]", self.offset),
        }
    }
}
