//! Types of shaders' values, and their bits.

use super::assembler::{Assembler, Id};
use half::f16;
use spirv::{Capability, Op};

/// The type of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Kind {
    Bool,
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F16,
    F32,
    F64,
}
use Kind::{Bool, F16, F32, F64, I8, I16, I32, I64, U8, U16, U32, U64};

impl Kind {
    /// All integer kinds.
    pub const INTEGERS: [Self; 8] = [U8, I8, U16, I16, U32, I32, U64, I64];
    /// All float kinds.
    pub const FLOATS: [Self; 3] = [F16, F32, F64];

    /// The number of bits; 1 for a Boolean.
    pub fn bits(self) -> u32 {
        match self {
            Bool => 1,
            U8 | I8 => 8,
            U16 | I16 | F16 => 16,
            U32 | I32 | F32 => 32,
            U64 | I64 | F64 => 64,
        }
    }

    /// The number of buffer words that a component takes.
    pub fn words(self) -> u32 {
        self.bits().div_ceil(32)
    }

    /// True if it is a float.
    pub fn is_float(self) -> bool {
        matches!(self, F16 | F32 | F64)
    }

    /// True if it is a signed integer.
    pub fn is_signed(self) -> bool {
        matches!(self, I8 | I16 | I32 | I64)
    }

    /// True if it is an integer.
    pub fn is_integer(self) -> bool {
        !self.is_float() && self != Bool
    }

    /// The integer kind with the same number of bits and the given signedness; other kinds are unchanged.
    pub fn with_sign(self, signed: bool) -> Self {
        match (self.bits(), signed) {
            (8, false) => U8,
            (8, true) => I8,
            (16, false) => U16,
            (16, true) => I16,
            (32, false) => U32,
            (32, true) => I32,
            (64, false) => U64,
            (64, true) => I64,
            _ => self,
        }
    }

    /// The mask of its bits.
    pub fn mask(self) -> u64 {
        u64::MAX >> (64 - self.bits())
    }

    /// An integer's value.
    pub fn integer(self, bits: u64) -> i128 {
        let above = 64 - self.bits();
        if self.is_signed() {
            i128::from((bits << above).cast_signed() >> above)
        } else {
            i128::from(bits & self.mask())
        }
    }

    /// An integer's bits, wrapped to its size.
    pub fn wrap(self, value: i128) -> u64 {
        value as u64 & self.mask()
    }

    /// A float's value.
    pub fn float(self, bits: u64) -> f64 {
        match self {
            F16 => f16::from_bits(bits as u16).to_f64(),
            F32 => f64::from(f32::from_bits(bits as u32)),
            _ => f64::from_bits(bits),
        }
    }

    /// The bits of the float nearest to a value.
    pub fn round(self, value: f64) -> u64 {
        match self {
            F16 => u64::from(f16::from_f32(rounded_to_odd(value)).to_bits()),
            F32 => u64::from((value as f32).to_bits()),
            _ => value.to_bits(),
        }
    }

    /// The least positive float that is not denormal.
    pub fn least_normal(self) -> f64 {
        match self {
            F16 => f64::from(2f32.powi(-14)),
            F32 => f64::from(f32::MIN_POSITIVE),
            _ => f64::MIN_POSITIVE,
        }
    }

    fn capability(self) -> Option<Capability> {
        Some(match self {
            U8 | I8 => Capability::Int8,
            U16 | I16 => Capability::Int16,
            U64 | I64 => Capability::Int64,
            F16 => Capability::Float16,
            F64 => Capability::Float64,
            _ => return None,
        })
    }

    fn declare(self, to: &mut Assembler) -> Id {
        if let Some(capability) = self.capability() {
            to.capability(capability);
        }
        match self {
            Bool => to.declare(Op::TypeBool, None, &[]),
            F16 | F32 | F64 => to.declare(Op::TypeFloat, None, &[self.bits()]),
            _ => to.declare(Op::TypeInt, None, &[self.bits(), u32::from(self.is_signed())]),
        }
    }
}

/// A single-precision number next to a value, rounded to odd: inexact results get an odd significand. Rounding it
/// further to half precision gives the same result as rounding the value directly.
fn rounded_to_odd(value: f64) -> f32 {
    let near = value as f32;
    if value.is_nan() || f64::from(near) == value {
        return near;
    }
    let bits = near.to_bits() - u32::from(f64::from(near).abs() > value.abs());
    f32::from_bits(bits | 1)
}

/// A scalar, vector or matrix type.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Ty {
    /// The kind of its components.
    pub kind: Kind,
    /// The number of components of a column: 1 for a scalar.
    pub rows: u32,
    /// The number of columns: 1 for a scalar or a vector.
    pub columns: u32,
}

impl Ty {
    /// A scalar.
    pub const fn scalar(kind: Kind) -> Self {
        Self::vector(kind, 1)
    }

    /// A vector, or a scalar for one component.
    pub const fn vector(kind: Kind, rows: u32) -> Self {
        Self::matrix(kind, 1, rows)
    }

    /// A matrix of floats.
    pub const fn matrix(kind: Kind, columns: u32, rows: u32) -> Self {
        Self { kind, rows, columns }
    }

    /// The number of its components.
    pub fn count(self) -> usize {
        (self.rows * self.columns) as usize
    }

    /// The same shape with another component kind.
    pub fn of(self, kind: Kind) -> Self {
        Self { kind, ..self }
    }

    /// Declares the type in a module and returns its id.
    pub fn declare(self, to: &mut Assembler) -> Id {
        let mut id = self.kind.declare(to);
        if self.rows > 1 {
            id = to.declare(Op::TypeVector, None, &[id, self.rows]);
        }
        if self.columns > 1 {
            to.capability(Capability::Matrix);
            id = to.declare(Op::TypeMatrix, None, &[id, self.columns]);
        }
        id
    }

    /// A value of it from its components, column by column.
    pub fn construct(self, to: &mut Assembler, components: &[Id]) -> Id {
        let vector = Self { columns: 1, ..self };
        let columns: Vec<Id> = components
            .chunks(self.rows as usize)
            .map(|column| match column {
                [one] => *one,
                _ => {
                    let ty = vector.declare(to);
                    to.emit(Op::CompositeConstruct, ty, column)
                }
            })
            .collect();
        match columns.as_slice() {
            [one] => *one,
            _ => {
                let ty = self.declare(to);
                to.emit(Op::CompositeConstruct, ty, &columns)
            }
        }
    }

    /// The components of a value of it, column by column.
    pub fn take_apart(self, to: &mut Assembler, value: Id) -> Vec<Id> {
        let scalar = Self::scalar(self.kind).declare(to);
        let mut components = Vec::with_capacity(self.count());
        for column in 0..self.columns {
            for row in 0..self.rows {
                let path: &[u32] = match (self.columns, self.rows) {
                    (1, 1) => {
                        components.push(value);
                        continue;
                    }
                    (1, _) => &[value, row],
                    _ => &[value, column, row],
                };
                components.push(to.emit(Op::CompositeExtract, scalar, path));
            }
        }
        components
    }
}
