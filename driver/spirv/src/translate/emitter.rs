//! Emits instructions of the IR: folds constants, and counts the instructions.

use std::collections::HashMap;

use isa::builder::Builder;
use isa::ir::{Reg, Type};
use isa::op::Op as Ir;

use crate::error::{Diagnostic, Error, Result};
use crate::types::Scalar;

/// The most IR instructions of a shader.
const MAX_STATEMENTS: u64 = 1 << 22;

/// The 32-bit or the 64-bit form of an operation.
pub fn op_for_width(scalar: Scalar, narrow: Ir, wide: Ir) -> Ir {
    if scalar.is_wide() { wide } else { narrow }
}

/// Appends instructions to a program.
#[derive(Debug)]
pub struct Emitter {
    pub builder: Builder,
    /// Bits of the registers that hold constants.
    constants: HashMap<Reg, u64>,
    /// Factors of products that may be fused with an addition.
    products: HashMap<Reg, [Reg; 2]>,
    /// Instructions emitted so far, including those that callers counted.
    statements: u64,
}

impl Emitter {
    /// An emitter of an empty program.
    pub fn new() -> Self {
        Self { builder: Builder::new(), constants: HashMap::new(), products: HashMap::new(), statements: 0 }
    }

    /// The words of a 64-bit register, the lower one first.
    pub fn words(&mut self, reg: Reg) -> [Reg; 2] {
        [Ir::Low32, Ir::High32].map(|half| self.op(half, &[reg]))
    }

    /// Counts instructions before they are emitted.
    pub fn charge_budget(&mut self, count: usize) -> Result<()> {
        self.statements += count as u64;
        if self.statements > MAX_STATEMENTS {
            return Err(Diagnostic::Located(Error::TooLarge {
                what: "instructions of a translated shader",
                limit: MAX_STATEMENTS,
            }));
        }
        Ok(())
    }

    /// Emits `op(src...)`. The number that one SPIR-V instruction becomes is bounded, so the limit is checked once for
    /// each.
    pub fn op(&mut self, op: Ir, src: &[Reg]) -> Reg {
        self.statements += 1;
        if let Some(folded) = self.fold(op, src) {
            return folded;
        }
        self.builder.compute(op, src)
    }

    /// A register that holds these bits.
    pub fn constant(&mut self, ty: Type, bits: u64) -> Reg {
        let reg = self.builder.constant(ty, bits);
        self.constants.insert(reg, bits);
        reg
    }

    pub fn u32(&mut self, value: u32) -> Reg {
        self.constant(Type::B32, u64::from(value))
    }

    pub fn f32(&mut self, value: f32) -> Reg {
        self.u32(value.to_bits())
    }

    pub fn u64(&mut self, value: u64) -> Reg {
        self.constant(Type::B64, value)
    }

    pub fn f64(&mut self, value: f64) -> Reg {
        self.u64(value.to_bits())
    }

    /// A float constant.
    pub fn float(&mut self, scalar: Scalar, value: f64) -> Reg {
        if scalar.is_wide() { self.f64(value) } else { self.f32(value as f32) }
    }

    /// The bits of a register that holds a constant of 32 bits.
    pub fn known(&self, reg: Reg) -> Option<u32> {
        self.constants.get(&reg).map(|bits| *bits as u32)
    }

    /// Folds integer arithmetic on constants, as addresses need it.
    fn fold(&mut self, op: Ir, src: &[Reg]) -> Option<Reg> {
        let [a, b] = src else {
            return None;
        };
        let (known_a, known_b) = (self.known(*a), self.known(*b));
        match (op, known_a, known_b) {
            (Ir::IAdd, Some(0), _) | (Ir::IMul, Some(1), _) => return Some(*b),
            (Ir::IAdd | Ir::ISub, _, Some(0)) | (Ir::IMul, _, Some(1)) => return Some(*a),
            _ => {}
        }
        let (a, b) = known_a.zip(known_b)?;
        let bits = match op {
            Ir::IAdd => a.wrapping_add(b),
            Ir::ISub => a.wrapping_sub(b),
            Ir::IMul => a.wrapping_mul(b),
            _ => return None,
        };
        Some(self.u32(bits))
    }

    /// `if condition { a } else { b }` on registers of one type.
    pub fn select(&mut self, condition: Reg, a: Reg, b: Reg) -> Reg {
        if a == b {
            return a;
        }
        let op = match self.builder.type_of(a) {
            Type::Bool => Ir::BSelect,
            Type::B32 => Ir::Select,
            Type::B64 => Ir::Select64,
        };
        self.op(op, &[condition, a, b])
    }

    /// `index == element`.
    pub fn index_is(&mut self, index: Reg, element: u32) -> Reg {
        let element = self.u32(element);
        self.op(Ir::IEq, &[index, element])
    }

    /// Quotient and remainder by a constant.
    pub fn div_rem(&mut self, reg: Reg, by: u32) -> (Reg, Reg) {
        if by.is_power_of_two() {
            let (shift, mask) = (self.u32(by.trailing_zeros()), self.u32(by - 1));
            (self.op(Ir::UShr, &[reg, shift]), self.op(Ir::And, &[reg, mask]))
        } else {
            let by = self.u32(by);
            (self.op(Ir::UDiv, &[reg, by]), self.op(Ir::URem, &[reg, by]))
        }
    }

    /// Brings a result into its type's range: narrow integers wrap, halves are rounded.
    pub fn wrap_to_width(&mut self, scalar: Scalar, reg: Reg) -> Reg {
        match scalar {
            Scalar::Int { width: 8, signed: true } => self.op(Ir::SExt8, &[reg]),
            Scalar::Int { width: 16, signed: true } => self.op(Ir::SExt16, &[reg]),
            Scalar::Int { width: width @ (8 | 16), .. } => self.low_bits(reg, width),
            Scalar::Float { width: 16 } => self.op(Ir::RoundToF16, &[reg]),
            _ => reg,
        }
    }

    fn low_bits(&mut self, reg: Reg, width: u32) -> Reg {
        let mask = self.u32((1 << width) - 1);
        self.op(Ir::And, &[reg, mask])
    }

    /// An integer operand, sign-extended whatever its type's signedness is.
    pub fn sign_extend(&mut self, scalar: Scalar, reg: Reg) -> Reg {
        match scalar {
            Scalar::Int { width: 8, signed: false } => self.op(Ir::SExt8, &[reg]),
            Scalar::Int { width: 16, signed: false } => self.op(Ir::SExt16, &[reg]),
            _ => reg,
        }
    }

    /// An integer operand, zero-extended.
    pub fn zero_extend(&mut self, scalar: Scalar, reg: Reg) -> Reg {
        match scalar {
            Scalar::Int { width: width @ (8 | 16), signed: true } => self.low_bits(reg, width),
            _ => reg,
        }
    }

    /// `a * b` on floats.
    pub fn mul(&mut self, scalar: Scalar, a: Reg, b: Reg) -> Reg {
        let reg = self.op(op_for_width(scalar, Ir::FMul, Ir::FMul64), &[a, b]);
        self.wrap_to_width(scalar, reg)
    }

    /// `a + b` on floats.
    pub fn plus(&mut self, scalar: Scalar, a: Reg, b: Reg) -> Reg {
        let reg = self.op(op_for_width(scalar, Ir::FAdd, Ir::FAdd64), &[a, b]);
        self.wrap_to_width(scalar, reg)
    }

    /// `a - b` on floats.
    pub fn minus(&mut self, scalar: Scalar, a: Reg, b: Reg) -> Reg {
        let reg = self.op(op_for_width(scalar, Ir::FSub, Ir::FSub64), &[a, b]);
        self.wrap_to_width(scalar, reg)
    }

    /// `a / b` on floats.
    pub fn over(&mut self, scalar: Scalar, a: Reg, b: Reg) -> Reg {
        let reg = self.op(op_for_width(scalar, Ir::FDiv, Ir::FDiv64), &[a, b]);
        self.wrap_to_width(scalar, reg)
    }

    /// Records that a register is a product that may be fused with an addition.
    pub fn set_product(&mut self, product: Reg, factors: [Reg; 2]) {
        self.products.insert(product, factors);
    }

    /// The factors of a product that may be fused with an addition.
    pub fn product(&self, reg: Reg) -> Option<[Reg; 2]> {
        self.products.get(&reg).copied()
    }
}
