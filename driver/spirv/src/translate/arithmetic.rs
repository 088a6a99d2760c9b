//! Arithmetic, comparisons, logic and bits, component by component.

use isa::ir::{Axis, Reg};
use isa::op::Op as Ir;
use spirv::{Decoration, Op};

use super::super::error::{Result, malformed, unsupported};
use super::super::instruction::Instruction;
use super::super::types::Scalar;
use super::Translator;

/// The 32-bit or the 64-bit form of an operation.
pub fn op_for_width(scalar: Scalar, narrow: Ir, wide: Ir) -> Ir {
    if scalar.is_wide() { wide } else { narrow }
}

/// A form of an integer comparison: the operation and whether operands are exchanged and the result negated.
struct Comparison {
    narrow: Ir,
    wide: Ir,
    exchange: bool,
    negate: bool,
}

impl Translator<'_> {
    /// Brings a result to its type's range: narrow integers wrap, halves are rounded.
    pub fn wrap_to_width(&mut self, scalar: Scalar, reg: Reg) -> Reg {
        match scalar {
            Scalar::Int {
                width: 8,
                signed: true,
            } => self.op(Ir::SExt8, &[reg]),
            Scalar::Int {
                width: 16,
                signed: true,
            } => self.op(Ir::SExt16, &[reg]),
            Scalar::Int {
                width: width @ (8 | 16),
                ..
            } => self.low_bits(reg, width),
            Scalar::Float { width: 16 } => self.op(Ir::RoundToF16, &[reg]),
            _ => reg,
        }
    }

    fn low_bits(&mut self, reg: Reg, width: u32) -> Reg {
        let mask = self.u32((1 << width) - 1);
        self.op(Ir::And, &[reg, mask])
    }

    /// An integer operand, extended by its sign whatever its type's signedness is.
    pub fn sign_extend(&mut self, scalar: Scalar, reg: Reg) -> Reg {
        match scalar {
            Scalar::Int {
                width: 8,
                signed: false,
            } => self.op(Ir::SExt8, &[reg]),
            Scalar::Int {
                width: 16,
                signed: false,
            } => self.op(Ir::SExt16, &[reg]),
            _ => reg,
        }
    }

    /// An integer operand, extended by zeros.
    pub fn zero_extend(&mut self, scalar: Scalar, reg: Reg) -> Reg {
        match scalar {
            Scalar::Int {
                width: width @ (8 | 16),
                signed: true,
            } => self.low_bits(reg, width),
            _ => reg,
        }
    }

    /// Applies an operation of one operand to each component.
    pub fn unary(
        &mut self,
        it: &Instruction,
        mut each: impl FnMut(&mut Self, Scalar, Reg) -> Reg,
    ) -> Result<()> {
        let (scalar, a) = self.vector(it.id(0)?)?;
        let regs = a.iter().map(|a| each(self, scalar, *a)).collect();
        self.define(it, regs)
    }

    /// Applies an operation of two operands to each pair of components.
    pub fn binary(
        &mut self,
        it: &Instruction,
        mut each: impl FnMut(&mut Self, [Scalar; 2], Reg, Reg) -> Reg,
    ) -> Result<()> {
        let (scalar_a, a) = self.vector(it.id(0)?)?;
        let (scalar_b, b) = self.vector(it.id(1)?)?;
        if a.len() != b.len() {
            return malformed("the operands differ in size");
        }
        let both = [scalar_a, scalar_b];
        let pairs = a.iter().zip(b.iter());
        let regs = pairs.map(|(a, b)| each(self, both, *a, *b)).collect();
        self.define(it, regs)
    }

    /// An integer or bit operation whose result wraps to its type.
    fn wrapping(&mut self, it: &Instruction, narrow: Ir, wide: Ir) -> Result<()> {
        let (result, _) = self.globals.types.vector(it.ty()?)?;
        self.binary(it, |this, _, a, b| {
            let reg = this.op(op_for_width(result, narrow, wide), &[a, b]);
            this.wrap_to_width(result, reg)
        })
    }

    fn signed(&mut self, it: &Instruction, narrow: Ir, wide: Ir) -> Result<()> {
        let (result, _) = self.globals.types.vector(it.ty()?)?;
        self.binary(it, |this, [scalar_a, scalar_b], a, b| {
            let (a, b) = (this.sign_extend(scalar_a, a), this.sign_extend(scalar_b, b));
            let reg = this.op(op_for_width(result, narrow, wide), &[a, b]);
            this.wrap_to_width(result, reg)
        })
    }

    fn unsigned(&mut self, it: &Instruction, narrow: Ir, wide: Ir) -> Result<()> {
        let (result, _) = self.globals.types.vector(it.ty()?)?;
        self.binary(it, |this, [scalar_a, scalar_b], a, b| {
            let (a, b) = (this.zero_extend(scalar_a, a), this.zero_extend(scalar_b, b));
            let reg = this.op(op_for_width(result, narrow, wide), &[a, b]);
            this.wrap_to_width(result, reg)
        })
    }

    fn float_op(&mut self, it: &Instruction, narrow: Ir, wide: Ir) -> Result<()> {
        self.binary(it, |this, [scalar, _], a, b| {
            let reg = this.op(op_for_width(scalar, narrow, wide), &[a, b]);
            this.wrap_to_width(scalar, reg)
        })
    }

    fn may_contract(&self, it: &Instruction) -> bool {
        let id = it.result_id.unwrap_or(0);
        !self.module.has(id, Decoration::NoContraction)
    }

    /// `a * b`, to be fused with an addition later if that is allowed.
    fn multiply(&mut self, it: &Instruction) -> Result<()> {
        let contract = self.may_contract(it);
        self.binary(it, |this, [scalar, _], a, b| {
            let product = this.op(op_for_width(scalar, Ir::FMul, Ir::FMul64), &[a, b]);
            if contract && scalar != (Scalar::Float { width: 16 }) {
                this.products.insert(product, (a, b));
            }
            this.wrap_to_width(scalar, product)
        })
    }

    /// `a + b`, fused if one is a product.
    fn add(&mut self, it: &Instruction) -> Result<()> {
        let contract = self.may_contract(it);
        self.binary(it, |this, [scalar, _], a, b| {
            let find = |reg, other| Some((*this.products.get(&reg)?, other));
            let fused = find(a, b).or_else(|| find(b, a)).filter(|_| contract);
            let sum = match fused {
                Some(((x, y), z)) => {
                    this.op(op_for_width(scalar, Ir::FFma, Ir::FFma64), &[x, y, z])
                }
                None => this.op(op_for_width(scalar, Ir::FAdd, Ir::FAdd64), &[a, b]),
            };
            this.wrap_to_width(scalar, sum)
        })
    }

    /// The derivative along an axis, or the sum of absolute values along both.
    pub fn derivative(&mut self, it: &Instruction, axes: &[Axis], fine: bool) -> Result<()> {
        self.unary(it, |this, scalar, a| {
            let along = |this: &mut Self, axis| this.builder.derivative(a, axis, fine);
            let reg = match axes {
                [one] => along(this, *one),
                _ => {
                    let (x, y) = (along(this, Axis::X), along(this, Axis::Y));
                    let (x, y) = (this.op(Ir::FAbs, &[x]), this.op(Ir::FAbs, &[y]));
                    this.op(Ir::FAdd, &[x, y])
                }
            };
            this.wrap_to_width(scalar, reg)
        })
    }

    fn compare_integers(&mut self, it: &Instruction, how: &Comparison) -> Result<()> {
        let signed = matches!(how.narrow, Ir::SLt | Ir::SLe);
        self.binary(it, |this, [scalar_a, scalar_b], a, b| {
            let (a, b) = if signed {
                (this.sign_extend(scalar_a, a), this.sign_extend(scalar_b, b))
            } else {
                (this.zero_extend(scalar_a, a), this.zero_extend(scalar_b, b))
            };
            this.compare(scalar_a, how, a, b)
        })
    }

    fn compare_floats(&mut self, it: &Instruction, how: &Comparison) -> Result<()> {
        self.binary(it, |this, [scalar, _], a, b| {
            this.compare(scalar, how, a, b)
        })
    }

    fn compare(&mut self, scalar: Scalar, how: &Comparison, a: Reg, b: Reg) -> Reg {
        let (a, b) = if how.exchange { (b, a) } else { (a, b) };
        let reg = self.op(op_for_width(scalar, how.narrow, how.wide), &[a, b]);
        if how.negate {
            self.op(Ir::BNot, &[reg])
        } else {
            reg
        }
    }

    /// Everything that works component by component.
    pub fn arithmetic(&mut self, it: &Instruction) -> Result<()> {
        let how = |narrow, wide, exchange, negate| Comparison {
            narrow,
            wide,
            exchange,
            negate,
        };
        match it.opcode {
            Op::IAdd => self.wrapping(it, Ir::IAdd, Ir::IAdd64),
            Op::ISub => self.wrapping(it, Ir::ISub, Ir::ISub64),
            Op::IMul => self.wrapping(it, Ir::IMul, Ir::IMul64),
            Op::SDiv => self.signed(it, Ir::SDiv, Ir::SDiv64),
            Op::SRem => self.signed(it, Ir::SRem, Ir::SRem64),
            Op::SMod => self.signed(it, Ir::SMod, Ir::SMod64),
            Op::UDiv => self.unsigned(it, Ir::UDiv, Ir::UDiv64),
            Op::UMod => self.unsigned(it, Ir::URem, Ir::URem64),
            Op::FAdd => self.add(it),
            Op::FSub => self.float_op(it, Ir::FSub, Ir::FSub64),
            Op::FMul => self.multiply(it),
            Op::FDiv => self.float_op(it, Ir::FDiv, Ir::FDiv64),
            Op::FRem => self.float_op(it, Ir::FRem, Ir::FRem64),
            Op::FMod => self.float_op(it, Ir::FMod, Ir::FMod64),
            Op::SNegate => self.unary(it, |this, scalar, a| {
                let reg = this.op(op_for_width(scalar, Ir::INeg, Ir::INeg64), &[a]);
                this.wrap_to_width(scalar, reg)
            }),
            Op::FNegate => self.unary(it, |this, scalar, a| {
                this.op(op_for_width(scalar, Ir::FNeg, Ir::FNeg64), &[a])
            }),
            Op::IAddCarry | Op::ISubBorrow | Op::UMulExtended | Op::SMulExtended => {
                self.extended_arithmetic(it)
            }
            Op::BitwiseOr => self.wrapping(it, Ir::Or, Ir::Or64),
            Op::BitwiseXor => self.wrapping(it, Ir::Xor, Ir::Xor64),
            Op::BitwiseAnd => self.wrapping(it, Ir::And, Ir::And64),
            Op::ShiftLeftLogical | Op::ShiftRightLogical | Op::ShiftRightArithmetic => {
                self.shift(it)
            }
            Op::Not
            | Op::BitReverse
            | Op::BitCount
            | Op::BitFieldInsert
            | Op::BitFieldSExtract
            | Op::BitFieldUExtract => self.bits(it),
            Op::IEqual => self.compare_integers(it, &how(Ir::IEq, Ir::IEq64, false, false)),
            Op::INotEqual => self.compare_integers(it, &how(Ir::INe, Ir::INe64, false, false)),
            Op::ULessThan => self.compare_integers(it, &how(Ir::ULt, Ir::ULt64, false, false)),
            Op::SLessThan => self.compare_integers(it, &how(Ir::SLt, Ir::SLt64, false, false)),
            Op::UGreaterThan => self.compare_integers(it, &how(Ir::ULt, Ir::ULt64, true, false)),
            Op::SGreaterThan => self.compare_integers(it, &how(Ir::SLt, Ir::SLt64, true, false)),
            Op::ULessThanEqual => self.compare_integers(it, &how(Ir::ULe, Ir::ULe64, false, false)),
            Op::SLessThanEqual => self.compare_integers(it, &how(Ir::SLe, Ir::SLe64, false, false)),
            Op::UGreaterThanEqual => {
                self.compare_integers(it, &how(Ir::ULe, Ir::ULe64, true, false))
            }
            Op::SGreaterThanEqual => {
                self.compare_integers(it, &how(Ir::SLe, Ir::SLe64, true, false))
            }
            Op::FOrdEqual => self.compare_floats(it, &how(Ir::FEq, Ir::FEq64, false, false)),
            Op::FUnordNotEqual => self.compare_floats(it, &how(Ir::FNe, Ir::FNe64, false, false)),
            Op::FOrdNotEqual | Op::LessOrGreater => {
                self.compare_floats(it, &how(Ir::FLtGt, Ir::FLtGt64, false, false))
            }
            Op::FUnordEqual => self.compare_floats(it, &how(Ir::FLtGt, Ir::FLtGt64, false, true)),
            Op::FOrdLessThan => self.compare_floats(it, &how(Ir::FLt, Ir::FLt64, false, false)),
            Op::FOrdLessThanEqual => {
                self.compare_floats(it, &how(Ir::FLe, Ir::FLe64, false, false))
            }
            Op::FOrdGreaterThan => self.compare_floats(it, &how(Ir::FLt, Ir::FLt64, true, false)),
            Op::FOrdGreaterThanEqual => {
                self.compare_floats(it, &how(Ir::FLe, Ir::FLe64, true, false))
            }
            // Unordered comparisons are the opposite ones, negated.
            Op::FUnordLessThan => self.compare_floats(it, &how(Ir::FLe, Ir::FLe64, true, true)),
            Op::FUnordLessThanEqual => {
                self.compare_floats(it, &how(Ir::FLt, Ir::FLt64, true, true))
            }
            Op::FUnordGreaterThan => self.compare_floats(it, &how(Ir::FLe, Ir::FLe64, false, true)),
            Op::FUnordGreaterThanEqual => {
                self.compare_floats(it, &how(Ir::FLt, Ir::FLt64, false, true))
            }
            Op::IsNan => self.unary(it, |this, scalar, a| {
                this.op(op_for_width(scalar, Ir::FIsNan, Ir::FIsNan64), &[a])
            }),
            Op::IsInf => self.unary(it, |this, scalar, a| {
                this.op(op_for_width(scalar, Ir::FIsInf, Ir::FIsInf64), &[a])
            }),
            _ => self.logic(it),
        }
    }

    fn logic(&mut self, it: &Instruction) -> Result<()> {
        let mut two = |op| self.binary(it, |this, _, a, b| this.op(op, &[a, b]));
        match it.opcode {
            Op::LogicalOr => two(Ir::BOr),
            Op::LogicalAnd => two(Ir::BAnd),
            Op::LogicalNotEqual => two(Ir::BXor),
            Op::LogicalEqual => self.binary(it, |this, _, a, b| {
                let differ = this.op(Ir::BXor, &[a, b]);
                this.op(Ir::BNot, &[differ])
            }),
            Op::LogicalNot => self.unary(it, |this, _, a| this.op(Ir::BNot, &[a])),
            Op::Any => self.fold_bools(it, Ir::BOr),
            Op::All => self.fold_bools(it, Ir::BAnd),
            Op::Select => {
                let conditions = self.regs(it.id(0)?)?;
                let (a, b) = (self.regs(it.id(1)?)?, self.regs(it.id(2)?)?);
                if a.len() != b.len() || (conditions.len() != 1 && conditions.len() != a.len()) {
                    return malformed("the operands differ in size");
                }
                self.charge_budget(a.len())?;
                let condition = |index: usize| conditions[index % conditions.len()];
                let regs = (0..a.len())
                    .map(|index| self.select(condition(index), a[index], b[index]))
                    .collect();
                self.define(it, regs)
            }
            other => unsupported(format!("Op{other:?}")),
        }
    }

    fn fold_bools(&mut self, it: &Instruction, op: Ir) -> Result<()> {
        let regs = self.regs(it.id(0)?)?;
        let folded = regs.iter().copied().reduce(|a, b| self.op(op, &[a, b]));
        self.define(it, folded.into_iter().collect())
    }

    /// Operations with two results: the low half, then the carry or the high half.
    fn extended_arithmetic(&mut self, it: &Instruction) -> Result<()> {
        let (scalar, a) = self.vector(it.id(0)?)?;
        let (_, b) = self.vector(it.id(1)?)?;
        if !matches!(scalar, Scalar::Int { width: 32, .. }) || a.len() != b.len() {
            return unsupported("this on anything but two vectors of 32-bit integers");
        }
        let (low, high) = match it.opcode {
            Op::IAddCarry => (Ir::IAdd, Ir::UAddCarry),
            Op::ISubBorrow => (Ir::ISub, Ir::USubBorrow),
            Op::UMulExtended => (Ir::IMul, Ir::UMulHi),
            _ => (Ir::IMul, Ir::SMulHi),
        };
        let mut regs = Vec::with_capacity(2 * a.len());
        for op in [low, high] {
            regs.extend(a.iter().zip(b.iter()).map(|(a, b)| self.op(op, &[*a, *b])));
        }
        self.define(it, regs)
    }

    fn shift(&mut self, it: &Instruction) -> Result<()> {
        let (result, _) = self.globals.types.vector(it.ty()?)?;
        let opcode = it.opcode;
        self.binary(it, |this, [scalar, by], a, b| {
            let by = if by.is_wide() {
                this.op(Ir::Low32, &[b])
            } else {
                b
            };
            let (op, a) = match opcode {
                Op::ShiftLeftLogical => (op_for_width(scalar, Ir::Shl, Ir::Shl64), a),
                Op::ShiftRightLogical => (
                    op_for_width(scalar, Ir::UShr, Ir::UShr64),
                    this.zero_extend(scalar, a),
                ),
                _ => (
                    op_for_width(scalar, Ir::SShr, Ir::SShr64),
                    this.sign_extend(scalar, a),
                ),
            };
            let reg = this.op(op, &[a, by]);
            this.wrap_to_width(result, reg)
        })
    }

    fn bits(&mut self, it: &Instruction) -> Result<()> {
        let (scalar, a) = self.vector(it.id(0)?)?;
        let opcode = it.opcode;
        if opcode == Op::Not {
            return self.unary(it, |this, scalar, a| {
                let reg = this.op(op_for_width(scalar, Ir::Not, Ir::Not64), &[a]);
                this.wrap_to_width(scalar, reg)
            });
        }
        if !matches!(scalar, Scalar::Int { width: 32, .. }) {
            return unsupported("this on anything but 32-bit integers");
        }
        let mut others = Vec::new();
        let scalars_from = if opcode == Op::BitFieldInsert { 2 } else { 1 };
        if opcode == Op::BitFieldInsert {
            others.push(self.regs(it.id(1)?)?);
        }
        let op = match opcode {
            Op::BitReverse => Ir::BitReverse,
            Op::BitCount => Ir::BitCount,
            Op::BitFieldInsert => Ir::BitfieldInsert,
            Op::BitFieldSExtract => Ir::BitfieldSExtract,
            _ => Ir::BitfieldUExtract,
        };
        // Offset and count are one for all components.
        let operands = op.signature().operands.len();
        for index in scalars_from..operands {
            others.push(vec![self.reg(it.id(index)?)?; a.len()].into());
        }
        if others.iter().any(|other| other.len() != a.len()) {
            return malformed("the operands differ in size");
        }
        let regs = (0..a.len())
            .map(|index| {
                let mut src = vec![a[index]];
                src.extend(others.iter().map(|other| other[index]));
                self.op(op, &src)
            })
            .collect();
        self.define(it, regs)
    }
}
