//! Operations that work component by component: arithmetic, comparisons, logic, bits, conversions.
//!
//! Most are a row of one of two tables: SPIR-V's own operations, and those of GLSL.std.450.

use std::rc::Rc;

use isa::ir::{Axis, Reg};
use isa::op::Op as Ir;
use spirv::{Capability, GlslStd450Op as G, Op};

use super::emitter::op_for_width;
use super::translator::Translator;
use crate::error::{Result, malformed, unsupported};
use crate::instruction::Instruction;
use crate::types::Scalar;

/// The extension of narrow integers before an operation.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Extension {
    /// By their own type's signedness, as they are in registers.
    Own,
    Sign,
    Zero,
}

/// An operation of the IR on each component.
#[derive(Clone, Copy)]
struct Elementwise {
    /// The operation on registers of 32 bits, and on truth values.
    narrow: Ir,
    /// The operation on registers of 64 bits.
    wide: Ir,
    extension: Extension,
    /// True if the second operand comes first.
    exchange: bool,
    /// True if the resulting truth value is negated.
    negate: bool,
    /// True if the result is brought into its type's range: narrow integers wrap, halves are rounded.
    wrap: bool,
}

const fn plain(narrow: Ir, wide: Ir) -> Elementwise {
    Elementwise { narrow, wide, extension: Extension::Own, exchange: false, negate: false, wrap: false }
}

const fn wrapped(narrow: Ir, wide: Ir) -> Elementwise {
    Elementwise { wrap: true, ..plain(narrow, wide) }
}

impl Elementwise {
    const fn signed(self) -> Self {
        Self { extension: Extension::Sign, ..self }
    }

    const fn unsigned(self) -> Self {
        Self { extension: Extension::Zero, ..self }
    }

    const fn exchanged(self) -> Self {
        Self { exchange: true, ..self }
    }

    const fn negated(self) -> Self {
        Self { negate: true, ..self }
    }

    /// The row of a SPIR-V operation.
    fn of(op: Op) -> Option<Self> {
        Some(match op {
            Op::IAdd => wrapped(Ir::IAdd, Ir::IAdd64),
            Op::ISub => wrapped(Ir::ISub, Ir::ISub64),
            Op::IMul => wrapped(Ir::IMul, Ir::IMul64),
            Op::SNegate => wrapped(Ir::INeg, Ir::INeg64),
            Op::SDiv => wrapped(Ir::SDiv, Ir::SDiv64).signed(),
            Op::SRem => wrapped(Ir::SRem, Ir::SRem64).signed(),
            Op::SMod => wrapped(Ir::SMod, Ir::SMod64).signed(),
            Op::UDiv => wrapped(Ir::UDiv, Ir::UDiv64).unsigned(),
            Op::UMod => wrapped(Ir::URem, Ir::URem64).unsigned(),
            Op::BitwiseOr => wrapped(Ir::Or, Ir::Or64),
            Op::BitwiseXor => wrapped(Ir::Xor, Ir::Xor64),
            Op::BitwiseAnd => wrapped(Ir::And, Ir::And64),
            Op::Not => wrapped(Ir::Not, Ir::Not64),
            Op::FSub => wrapped(Ir::FSub, Ir::FSub64),
            Op::FDiv => wrapped(Ir::FDiv, Ir::FDiv64),
            Op::FRem => wrapped(Ir::FRem, Ir::FRem64),
            Op::FMod => wrapped(Ir::FMod, Ir::FMod64),
            Op::FNegate => plain(Ir::FNeg, Ir::FNeg64),
            Op::IEqual => plain(Ir::IEq, Ir::IEq64).unsigned(),
            Op::INotEqual => plain(Ir::INe, Ir::INe64).unsigned(),
            Op::ULessThan => plain(Ir::ULt, Ir::ULt64).unsigned(),
            Op::ULessThanEqual => plain(Ir::ULe, Ir::ULe64).unsigned(),
            Op::UGreaterThan => plain(Ir::ULt, Ir::ULt64).unsigned().exchanged(),
            Op::UGreaterThanEqual => plain(Ir::ULe, Ir::ULe64).unsigned().exchanged(),
            Op::SLessThan => plain(Ir::SLt, Ir::SLt64).signed(),
            Op::SLessThanEqual => plain(Ir::SLe, Ir::SLe64).signed(),
            Op::SGreaterThan => plain(Ir::SLt, Ir::SLt64).signed().exchanged(),
            Op::SGreaterThanEqual => plain(Ir::SLe, Ir::SLe64).signed().exchanged(),
            Op::FOrdEqual => plain(Ir::FEq, Ir::FEq64),
            Op::FUnordEqual => plain(Ir::FLtGt, Ir::FLtGt64).negated(),
            Op::FOrdNotEqual | Op::LessOrGreater => plain(Ir::FLtGt, Ir::FLtGt64),
            Op::FUnordNotEqual => plain(Ir::FNe, Ir::FNe64),
            Op::FOrdLessThan => plain(Ir::FLt, Ir::FLt64),
            Op::FOrdLessThanEqual => plain(Ir::FLe, Ir::FLe64),
            Op::FOrdGreaterThan => plain(Ir::FLt, Ir::FLt64).exchanged(),
            Op::FOrdGreaterThanEqual => plain(Ir::FLe, Ir::FLe64).exchanged(),
            // Unordered comparisons are the opposite ones, negated.
            Op::FUnordLessThan => plain(Ir::FLe, Ir::FLe64).exchanged().negated(),
            Op::FUnordLessThanEqual => plain(Ir::FLt, Ir::FLt64).exchanged().negated(),
            Op::FUnordGreaterThan => plain(Ir::FLe, Ir::FLe64).negated(),
            Op::FUnordGreaterThanEqual => plain(Ir::FLt, Ir::FLt64).negated(),
            Op::IsNan => plain(Ir::FIsNan, Ir::FIsNan64),
            Op::IsInf => plain(Ir::FIsInf, Ir::FIsInf64),
            Op::LogicalOr => plain(Ir::BOr, Ir::BOr),
            Op::LogicalAnd => plain(Ir::BAnd, Ir::BAnd),
            Op::LogicalNot => plain(Ir::BNot, Ir::BNot),
            Op::LogicalEqual => plain(Ir::BXor, Ir::BXor).negated(),
            Op::LogicalNotEqual => plain(Ir::BXor, Ir::BXor),
            _ => return None,
        })
    }

    /// The row of an extended instruction of GLSL.std.450.
    fn of_glsl(op: G) -> Option<Self> {
        Some(match op {
            G::Round | G::RoundEven => wrapped(Ir::FRoundEven, Ir::FRoundEven64),
            G::Trunc => wrapped(Ir::FTrunc, Ir::FTrunc64),
            G::FAbs => wrapped(Ir::FAbs, Ir::FAbs64),
            G::FSign => wrapped(Ir::FSign, Ir::FSign64),
            G::Floor => wrapped(Ir::FFloor, Ir::FFloor64),
            G::Ceil => wrapped(Ir::FCeil, Ir::FCeil64),
            G::Fract => wrapped(Ir::FFract, Ir::FFract64),
            G::Sqrt => wrapped(Ir::FSqrt, Ir::FSqrt64),
            G::FMin | G::NMin => wrapped(Ir::FMin, Ir::FMin64),
            G::FMax | G::NMax => wrapped(Ir::FMax, Ir::FMax64),
            G::Fma => wrapped(Ir::FFma, Ir::FFma64),
            G::Sin => wrapped(Ir::FSin, Ir::FSin),
            G::Cos => wrapped(Ir::FCos, Ir::FCos),
            G::Tan => wrapped(Ir::FTan, Ir::FTan),
            G::Asin => wrapped(Ir::FAsin, Ir::FAsin),
            G::Acos => wrapped(Ir::FAcos, Ir::FAcos),
            G::Atan => wrapped(Ir::FAtan, Ir::FAtan),
            G::Atan2 => wrapped(Ir::FAtan2, Ir::FAtan2),
            G::Sinh => wrapped(Ir::FSinh, Ir::FSinh),
            G::Cosh => wrapped(Ir::FCosh, Ir::FCosh),
            G::Tanh => wrapped(Ir::FTanh, Ir::FTanh),
            G::Asinh => wrapped(Ir::FAsinh, Ir::FAsinh),
            G::Acosh => wrapped(Ir::FAcosh, Ir::FAcosh),
            G::Atanh => wrapped(Ir::FAtanh, Ir::FAtanh),
            G::Pow => wrapped(Ir::FPow, Ir::FPow),
            G::Exp => wrapped(Ir::FExp, Ir::FExp),
            G::Exp2 => wrapped(Ir::FExp2, Ir::FExp2),
            G::Log => wrapped(Ir::FLog, Ir::FLog),
            G::Log2 => wrapped(Ir::FLog2, Ir::FLog2),
            G::SAbs => wrapped(Ir::SAbs, Ir::SAbs64).signed(),
            G::SSign => wrapped(Ir::SSign, Ir::SSign64).signed(),
            G::SMin => wrapped(Ir::SMin, Ir::SMin64).signed(),
            G::SMax => wrapped(Ir::SMax, Ir::SMax64).signed(),
            G::UMin => wrapped(Ir::UMin, Ir::UMin64).unsigned(),
            G::UMax => wrapped(Ir::UMax, Ir::UMax64).unsigned(),
            _ => return None,
        })
    }

    /// Applies the operation to the operands of an instruction, from a position on.
    fn apply(&self, t: &mut Translator, instruction: &Instruction, first: usize) -> Result<()> {
        let (result, _) = t.globals.types.vector(instruction.ty()?)?;
        let count = self.narrow.signature().operands.len();
        each(t, instruction, first, count, |t, scalars, src| {
            let mut src = extend(t, self.extension, scalars, src);
            if self.exchange {
                src.reverse();
            }
            let mut reg = t.emit.op(op_for_width(scalars[0], self.narrow, self.wide), &src);
            if self.negate {
                reg = t.emit.op(Ir::BNot, &[reg]);
            }
            if self.wrap {
                reg = t.emit.wrap_to_width(result, reg);
            }
            reg
        })
    }
}

fn extend(t: &mut Translator, extension: Extension, scalars: &[Scalar], src: &[Reg]) -> Vec<Reg> {
    scalars
        .iter()
        .zip(src)
        .map(|(scalar, reg)| match extension {
            Extension::Own => *reg,
            Extension::Sign => t.emit.sign_extend(*scalar, *reg),
            Extension::Zero => t.emit.zero_extend(*scalar, *reg),
        })
        .collect()
}

/// Operands of the same size: their scalar types, and the registers of each.
type Operands = (Vec<Scalar>, Vec<Rc<[Reg]>>);

/// `count` operands of an instruction, from a position on.
pub fn operands(t: &mut Translator, instruction: &Instruction, first: usize, count: usize) -> Result<Operands> {
    let mut scalars = Vec::with_capacity(count);
    let mut all: Vec<Rc<[Reg]>> = Vec::with_capacity(count);
    for index in first..first + count {
        let (scalar, regs) = t.vector(instruction.id(index)?)?;
        if all.first().is_some_and(|first| first.len() != regs.len()) {
            return malformed("the operands differ in size");
        }
        scalars.push(scalar);
        all.push(regs);
    }
    Ok((scalars, all))
}

/// Applies a function to each component of operands. The function also gets their scalar types.
fn each(
    t: &mut Translator,
    instruction: &Instruction,
    first: usize,
    count: usize,
    mut function: impl FnMut(&mut Translator, &[Scalar], &[Reg]) -> Reg,
) -> Result<()> {
    let (scalars, operands) = operands(t, instruction, first, count)?;
    let components = operands.first().map_or(0, |regs| regs.len());
    let regs = (0..components)
        .map(|component| {
            let src: Vec<Reg> = operands.iter().map(|regs| regs[component]).collect();
            function(t, &scalars, &src)
        })
        .collect();
    t.define(instruction, regs)
}

/// Translates everything that works component by component, except conversions.
pub fn elementwise(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    match instruction.opcode {
        Op::FAdd => add(t, instruction),
        Op::FMul => multiply(t, instruction),
        Op::IAddCarry | Op::ISubBorrow | Op::UMulExtended | Op::SMulExtended => extended_arithmetic(t, instruction),
        Op::ShiftLeftLogical | Op::ShiftRightLogical | Op::ShiftRightArithmetic => shift(t, instruction),
        Op::BitReverse | Op::BitCount | Op::BitFieldInsert | Op::BitFieldSExtract | Op::BitFieldUExtract => {
            bit_operation(t, instruction)
        }
        Op::Any => fold_bools(t, instruction, Ir::BOr),
        Op::All => fold_bools(t, instruction, Ir::BAnd),
        Op::Select => select(t, instruction),
        op => match Elementwise::of(op) {
            Some(row) => row.apply(t, instruction, 0),
            None => unsupported(format!("Op{op:?}")),
        },
    }
}

/// Translates `a * b`, which an addition may fuse later if that is allowed.
fn multiply(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let contract = t.may_contract(instruction)?;
    each(t, instruction, 0, 2, |t, scalars, src| {
        let scalar = scalars[0];
        let product = t.emit.op(op_for_width(scalar, Ir::FMul, Ir::FMul64), src);
        if contract && scalar != (Scalar::Float { width: 16 }) {
            t.emit.set_product(product, [src[0], src[1]]);
        }
        t.emit.wrap_to_width(scalar, product)
    })
}

/// Translates `a + b`, fused if one operand is a product.
fn add(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let contract = t.may_contract(instruction)?;
    each(t, instruction, 0, 2, |t, scalars, src| {
        let (scalar, a, b) = (scalars[0], src[0], src[1]);
        let find = |reg, other| Some((t.emit.product(reg)?, other));
        let fused = find(a, b).or_else(|| find(b, a)).filter(|_| contract);
        let sum = match fused {
            Some(([x, y], z)) => t.emit.op(op_for_width(scalar, Ir::FFma, Ir::FFma64), &[x, y, z]),
            None => t.emit.op(op_for_width(scalar, Ir::FAdd, Ir::FAdd64), &[a, b]),
        };
        t.emit.wrap_to_width(scalar, sum)
    })
}

/// The derivative along an axis, or the sum of absolute values along both.
pub fn derivative(t: &mut Translator, instruction: &Instruction, axes: &[Axis], fine: bool) -> Result<()> {
    each(t, instruction, 0, 1, |t, scalars, src| {
        let along = |t: &mut Translator, axis| t.emit.builder.derivative(src[0], axis, fine);
        let reg = match axes {
            [one] => along(t, *one),
            _ => {
                let (x, y) = (along(t, Axis::X), along(t, Axis::Y));
                let (x, y) = (t.emit.op(Ir::FAbs, &[x]), t.emit.op(Ir::FAbs, &[y]));
                t.emit.op(Ir::FAdd, &[x, y])
            }
        };
        t.emit.wrap_to_width(scalars[0], reg)
    })
}

/// Translates `OpSelect`, with a condition for each component or one for all.
fn select(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let conditions = t.regs(instruction.id(0)?)?;
    let (a, b) = (t.regs(instruction.id(1)?)?, t.regs(instruction.id(2)?)?);
    if a.len() != b.len() || (conditions.len() != 1 && conditions.len() != a.len()) {
        return malformed("the operands differ in size");
    }
    t.emit.charge_budget(a.len())?;
    let condition = |index: usize| conditions[index % conditions.len()];
    let regs = (0..a.len()).map(|index| t.emit.select(condition(index), a[index], b[index])).collect();
    t.define(instruction, regs)
}

fn fold_bools(t: &mut Translator, instruction: &Instruction, op: Ir) -> Result<()> {
    let regs = t.regs(instruction.id(0)?)?;
    let folded = regs.iter().copied().reduce(|a, b| t.emit.op(op, &[a, b]));
    t.define(instruction, folded.into_iter().collect())
}

/// Translates operations with two results: the low half, then the carry or the high half.
fn extended_arithmetic(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let (scalar, a) = t.vector(instruction.id(0)?)?;
    let (_, b) = t.vector(instruction.id(1)?)?;
    let Scalar::Int { width, .. } = scalar else {
        return malformed("the operands aren't integers");
    };
    if a.len() != b.len() {
        return malformed("the operands differ in size");
    }
    let (mut low, mut high) = (Vec::with_capacity(2 * a.len()), Vec::new());
    for (a, b) in a.iter().zip(b.iter()) {
        let halves = match width {
            64 => wide_halves(t, instruction.opcode, *a, *b),
            32 => word_halves(t, instruction.opcode, *a, *b),
            _ => narrow_halves(t, instruction.opcode, scalar, width, *a, *b),
        };
        low.push(halves.low);
        high.push(halves.high);
    }
    low.append(&mut high);
    t.define(instruction, low)
}

/// The two results of extended arithmetic.
struct Halves {
    low: Reg,
    /// The carry, the borrow or the high half of the product.
    high: Reg,
}

fn word_halves(t: &mut Translator, opcode: Op, a: Reg, b: Reg) -> Halves {
    let (low, high) = match opcode {
        Op::IAddCarry => (Ir::IAdd, Ir::UAddCarry),
        Op::ISubBorrow => (Ir::ISub, Ir::USubBorrow),
        Op::UMulExtended => (Ir::IMul, Ir::UMulHi),
        _ => (Ir::IMul, Ir::SMulHi),
    };
    Halves { low: t.emit.op(low, &[a, b]), high: t.emit.op(high, &[a, b]) }
}

/// Extended arithmetic on 8 or 16 bits: 32 bits hold the whole result, and the high half is extracted.
fn narrow_halves(t: &mut Translator, opcode: Op, scalar: Scalar, width: u32, a: Reg, b: Reg) -> Halves {
    let extend = |t: &mut Translator, reg| match opcode {
        Op::SMulExtended => t.emit.sign_extend(scalar, reg),
        _ => t.emit.zero_extend(scalar, reg),
    };
    let (a, b) = (extend(t, a), extend(t, b));
    let whole = match opcode {
        Op::IAddCarry => t.emit.op(Ir::IAdd, &[a, b]),
        Op::ISubBorrow => t.emit.op(Ir::ISub, &[a, b]),
        _ => t.emit.op(Ir::IMul, &[a, b]),
    };
    let high = if opcode == Op::ISubBorrow {
        t.emit.op(Ir::USubBorrow, &[a, b])
    } else {
        let by = t.emit.u32(width);
        t.emit.op(Ir::SShr, &[whole, by])
    };
    Halves { low: t.emit.wrap_to_width(scalar, whole), high: t.emit.wrap_to_width(scalar, high) }
}

/// Extended arithmetic on 64 bits.
fn wide_halves(t: &mut Translator, opcode: Op, a: Reg, b: Reg) -> Halves {
    match opcode {
        Op::IAddCarry | Op::ISubBorrow => {
            let (low, carries) = if opcode == Op::IAddCarry {
                let sum = t.emit.op(Ir::IAdd64, &[a, b]);
                (sum, t.emit.op(Ir::ULt64, &[sum, a]))
            } else {
                let difference = t.emit.op(Ir::ISub64, &[a, b]);
                (difference, t.emit.op(Ir::ULt64, &[a, b]))
            };
            let (one, zero) = (t.emit.u64(1), t.emit.u64(0));
            let high = t.emit.select(carries, one, zero);
            Halves { low, high }
        }
        _ => {
            let mut high = wide_product_high(t, a, b);
            if opcode == Op::SMulExtended {
                // A negative factor, read as unsigned, is greater by 2^64.
                let zero = t.emit.u64(0);
                for (factor, other) in [(a, b), (b, a)] {
                    let negative = t.emit.op(Ir::SLt64, &[factor, zero]);
                    let excess = t.emit.select(negative, other, zero);
                    high = t.emit.op(Ir::ISub64, &[high, excess]);
                }
            }
            let low = t.emit.op(Ir::IMul64, &[a, b]);
            Halves { low, high }
        }
    }
}

/// The high half of an unsigned product of 64 bits, from the four products of the factors' halves.
fn wide_product_high(t: &mut Translator, a: Reg, b: Reg) -> Reg {
    let by = t.emit.u32(32);
    let low_half = |t: &mut Translator, reg| {
        let low = t.emit.op(Ir::Low32, &[reg]);
        t.emit.op(Ir::UToU64, &[low])
    };
    let (a_low, b_low) = (low_half(t, a), low_half(t, b));
    let a_high = t.emit.op(Ir::UShr64, &[a, by]);
    let b_high = t.emit.op(Ir::UShr64, &[b, by]);
    let lowest = t.emit.op(Ir::IMul64, &[a_low, b_low]);
    let carry = t.emit.op(Ir::UShr64, &[lowest, by]);
    let first = t.emit.op(Ir::IMul64, &[a_high, b_low]);
    let first = t.emit.op(Ir::IAdd64, &[first, carry]);
    let second = t.emit.op(Ir::IMul64, &[a_low, b_high]);
    let first_low = low_half(t, first);
    let second = t.emit.op(Ir::IAdd64, &[second, first_low]);
    let first_high = t.emit.op(Ir::UShr64, &[first, by]);
    let second_high = t.emit.op(Ir::UShr64, &[second, by]);
    let highest = t.emit.op(Ir::IMul64, &[a_high, b_high]);
    let highest = t.emit.op(Ir::IAdd64, &[highest, first_high]);
    t.emit.op(Ir::IAdd64, &[highest, second_high])
}

fn shift(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let (result, _) = t.globals.types.vector(instruction.ty()?)?;
    each(t, instruction, 0, 2, |t, scalars, src| {
        let scalar = scalars[0];
        let by = if scalars[1].is_wide() { t.emit.op(Ir::Low32, &[src[1]]) } else { src[1] };
        let (narrow, wide, a) = match instruction.opcode {
            Op::ShiftLeftLogical => (Ir::Shl, Ir::Shl64, src[0]),
            Op::ShiftRightLogical => (Ir::UShr, Ir::UShr64, t.emit.zero_extend(scalar, src[0])),
            _ => (Ir::SShr, Ir::SShr64, t.emit.sign_extend(scalar, src[0])),
        };
        let reg = t.emit.op(op_for_width(scalar, narrow, wide), &[a, by]);
        t.emit.wrap_to_width(result, reg)
    })
}

/// Translates operations on the bits of integers of any width.
fn bit_operation(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let (scalar, base) = t.vector(instruction.id(0)?)?;
    let Scalar::Int { width, .. } = scalar else {
        return malformed("the operand isn't an integer");
    };
    let (result, _) = t.globals.types.vector(instruction.ty()?)?;
    let opcode = instruction.opcode;
    let mut next = 1;
    let insert = if opcode == Op::BitFieldInsert {
        next += 1;
        Some(t.regs(instruction.id(1)?)?)
    } else {
        None
    };
    if insert.as_ref().is_some_and(|regs| regs.len() != base.len()) {
        return malformed("the operands differ in size");
    }
    let field = match opcode {
        Op::BitReverse | Op::BitCount => None,
        // Offset and count are one for all components.
        _ => Some(BitField {
            offset: bit_number(t, instruction.id(next)?)?,
            count: bit_number(t, instruction.id(next + 1)?)?,
        }),
    };
    let mut regs = Vec::with_capacity(base.len());
    for (index, base) in base.iter().enumerate() {
        let insert = insert.as_ref().map(|regs| regs[index]);
        let reg = match (opcode, field) {
            (Op::BitCount, _) => bit_count(t, scalar, *base, result),
            (Op::BitReverse, _) => reversed_bits(t, scalar, width, *base),
            (_, Some(field)) if scalar.is_wide() => wide_bit_field(t, opcode, *base, insert, field),
            (_, Some(field)) => bit_field(t, opcode, *base, insert, field),
            _ => return unsupported(format!("Op{opcode:?}")),
        };
        regs.push(t.emit.wrap_to_width(result, reg));
    }
    t.define(instruction, regs)
}

/// A range of bits; both members are registers of 32 bits.
#[derive(Clone, Copy)]
struct BitField {
    offset: Reg,
    count: Reg,
}

/// An offset or a number of bits, in a register of 32 bits.
fn bit_number(t: &mut Translator, id: u32) -> Result<Reg> {
    let (scalar, regs) = t.vector(id)?;
    match *regs {
        [reg] if scalar.is_wide() => Ok(t.emit.op(Ir::Low32, &[reg])),
        [reg] => Ok(t.emit.zero_extend(scalar, reg)),
        _ => malformed(format!("%{id} isn't a scalar")),
    }
}

fn bit_count(t: &mut Translator, scalar: Scalar, base: Reg, result: Scalar) -> Reg {
    let count = if scalar.is_wide() {
        let [low, high] = [Ir::Low32, Ir::High32].map(|half| {
            let half = t.emit.op(half, &[base]);
            t.emit.op(Ir::BitCount, &[half])
        });
        t.emit.op(Ir::IAdd, &[low, high])
    } else {
        let base = t.emit.zero_extend(scalar, base);
        t.emit.op(Ir::BitCount, &[base])
    };
    if result.is_wide() { t.emit.op(Ir::UToU64, &[count]) } else { count }
}

fn reversed_bits(t: &mut Translator, scalar: Scalar, width: u32, base: Reg) -> Reg {
    match width {
        64 => {
            let [low, high] = [Ir::Low32, Ir::High32].map(|half| {
                let half = t.emit.op(half, &[base]);
                t.emit.op(Ir::BitReverse, &[half])
            });
            t.emit.op(Ir::Join64, &[high, low])
        }
        32 => t.emit.op(Ir::BitReverse, &[base]),
        _ => {
            let base = t.emit.zero_extend(scalar, base);
            let reversed = t.emit.op(Ir::BitReverse, &[base]);
            let by = t.emit.u32(32 - width);
            t.emit.op(Ir::UShr, &[reversed, by])
        }
    }
}

fn bit_field(t: &mut Translator, opcode: Op, base: Reg, insert: Option<Reg>, field: BitField) -> Reg {
    let BitField { offset, count } = field;
    match (opcode, insert) {
        (_, Some(insert)) => t.emit.op(Ir::BitfieldInsert, &[base, insert, offset, count]),
        (Op::BitFieldSExtract, _) => t.emit.op(Ir::BitfieldSExtract, &[base, offset, count]),
        _ => t.emit.op(Ir::BitfieldUExtract, &[base, offset, count]),
    }
}

/// As [`bit_field`], of 64 bits.
fn wide_bit_field(
    t: &mut Translator,
    opcode: Op,
    base: Reg,
    insert: Option<Reg>,
    BitField { offset, count }: BitField,
) -> Reg {
    let (zero, whole) = (t.emit.u32(0), t.emit.u32(64));
    let none = t.emit.op(Ir::IEq, &[count, zero]);
    let (wide_zero, ones) = (t.emit.u64(0), t.emit.u64(u64::MAX));
    let above = t.emit.op(Ir::ISub, &[whole, count]);
    match (opcode, insert) {
        (_, Some(insert)) => {
            let mask = t.emit.op(Ir::UShr64, &[ones, above]);
            let mask = t.emit.op(Ir::Shl64, &[mask, offset]);
            let mask = t.emit.select(none, wide_zero, mask);
            let others = t.emit.op(Ir::Not64, &[mask]);
            let kept = t.emit.op(Ir::And64, &[base, others]);
            let moved = t.emit.op(Ir::Shl64, &[insert, offset]);
            let moved = t.emit.op(Ir::And64, &[moved, mask]);
            t.emit.op(Ir::Or64, &[kept, moved])
        }
        _ => {
            let shift = if opcode == Op::BitFieldSExtract { Ir::SShr64 } else { Ir::UShr64 };
            let left = t.emit.op(Ir::ISub, &[above, offset]);
            let top = t.emit.op(Ir::Shl64, &[base, left]);
            let extracted = t.emit.op(shift, &[top, above]);
            t.emit.select(none, wide_zero, extracted)
        }
    }
}

/// Translates an extended instruction of GLSL.std.450 that works component by component.
pub fn glsl_elementwise(t: &mut Translator, instruction: &Instruction, op: G) -> Result<()> {
    let is_extreme = matches!(op, G::FMin | G::NMin | G::FMax | G::NMax);
    if is_extreme && t.module.declares(Capability::FloatControls2) {
        return glsl_each(t, instruction, 2, |t, scalar, src| extreme_of_signed(t, scalar, op, src));
    }
    if let Some(row) = Elementwise::of_glsl(op) {
        return row.apply(t, instruction, 2);
    }
    match op {
        G::InverseSqrt => glsl_each(t, instruction, 1, |t, scalar, src| inverse_sqrt(t, scalar, src[0])),
        G::Radians => scaled(t, instruction, std::f64::consts::PI / 180.0),
        G::Degrees => scaled(t, instruction, 180.0 / std::f64::consts::PI),
        G::FClamp | G::NClamp => glsl_each(t, instruction, 3, |t, scalar, src| {
            let low = t.emit.op(op_for_width(scalar, Ir::FMax, Ir::FMax64), &src[..2]);
            t.emit.op(op_for_width(scalar, Ir::FMin, Ir::FMin64), &[low, src[2]])
        }),
        G::SClamp => clamp_integers(t, instruction, Extension::Sign),
        G::UClamp => clamp_integers(t, instruction, Extension::Zero),
        G::FMix => glsl_each(t, instruction, 3, mix),
        G::Step => glsl_each(t, instruction, 2, |t, scalar, src| {
            let below = t.emit.op(op_for_width(scalar, Ir::FLt, Ir::FLt64), &[src[1], src[0]]);
            let (one, zero) = (t.emit.float(scalar, 1.0), t.emit.float(scalar, 0.0));
            t.emit.select(below, zero, one)
        }),
        G::SmoothStep => glsl_each(t, instruction, 3, smooth_step),
        G::FindILsb => find_bit(t, instruction, Ir::FindLsb, Extension::Zero),
        G::FindSMsb => find_bit(t, instruction, Ir::FindSMsb, Extension::Sign),
        G::FindUMsb => find_bit(t, instruction, Ir::FindUMsb, Extension::Zero),
        other => unsupported(format!("GLSL.std.450 {other:?}")),
    }
}

/// Applies a function of GLSL to each component; results are brought into the range of the operands' type.
fn glsl_each(
    t: &mut Translator,
    instruction: &Instruction,
    count: usize,
    mut function: impl FnMut(&mut Translator, Scalar, &[Reg]) -> Reg,
) -> Result<()> {
    each(t, instruction, 2, count, |t, scalars, src| {
        let reg = function(t, scalars[0], src);
        t.emit.wrap_to_width(scalars[0], reg)
    })
}

/// The minimum or maximum of two numbers, where -0 is less than 0: modules that say which operations may ignore the sign of zeros
/// expect it of the others.
fn extreme_of_signed(t: &mut Translator, scalar: Scalar, op: G, src: &[Reg]) -> Reg {
    let (extreme, of_equal) = match (op, scalar.is_wide()) {
        (G::FMin | G::NMin, false) => (Ir::FMin, Ir::Or),
        (G::FMin | G::NMin, true) => (Ir::FMin64, Ir::Or64),
        (_, false) => (Ir::FMax, Ir::And),
        (_, true) => (Ir::FMax64, Ir::And64),
    };
    let extreme = t.emit.op(extreme, src);
    // The bits of equal numbers are the same, but for zeros.
    let is_equal = t.emit.op(op_for_width(scalar, Ir::FEq, Ir::FEq64), src);
    let of_equal = t.emit.op(of_equal, src);
    t.emit.select(is_equal, of_equal, extreme)
}

fn clamp_integers(t: &mut Translator, instruction: &Instruction, extension: Extension) -> Result<()> {
    let (result, _) = t.globals.types.vector(instruction.ty()?)?;
    each(t, instruction, 2, 3, |t, scalars, src| {
        let src = extend(t, extension, scalars, src);
        let (max, min) = match (extension, scalars[0].is_wide()) {
            (Extension::Sign, false) => (Ir::SMax, Ir::SMin),
            (Extension::Sign, true) => (Ir::SMax64, Ir::SMin64),
            (_, false) => (Ir::UMax, Ir::UMin),
            (_, true) => (Ir::UMax64, Ir::UMin64),
        };
        let low = t.emit.op(max, &src[..2]);
        let reg = t.emit.op(min, &[low, src[2]]);
        t.emit.wrap_to_width(result, reg)
    })
}

fn find_bit(t: &mut Translator, instruction: &Instruction, find: Ir, extension: Extension) -> Result<()> {
    let (scalar, _) = t.vector(instruction.id(2)?)?;
    if scalar.is_wide() {
        return unsupported("this on 64-bit integers");
    }
    let (result, _) = t.globals.types.vector(instruction.ty()?)?;
    each(t, instruction, 2, 1, |t, scalars, src| {
        let src = extend(t, extension, scalars, src);
        let reg = t.emit.op(find, &src);
        t.emit.wrap_to_width(result, reg)
    })
}

/// `1 / sqrt(reg)`.
pub fn inverse_sqrt(t: &mut Translator, scalar: Scalar, reg: Reg) -> Reg {
    if scalar.is_wide() {
        let (one, root) = (t.emit.f64(1.0), t.emit.op(Ir::FSqrt64, &[reg]));
        t.emit.op(Ir::FDiv64, &[one, root])
    } else {
        t.emit.op(Ir::FInverseSqrt, &[reg])
    }
}

fn scaled(t: &mut Translator, instruction: &Instruction, factor: f64) -> Result<()> {
    glsl_each(t, instruction, 1, |t, scalar, src| {
        let factor = t.emit.float(scalar, factor);
        t.emit.mul(scalar, src[0], factor)
    })
}

/// `x (1 - a) + y a`, exact at both ends.
fn mix(t: &mut Translator, scalar: Scalar, src: &[Reg]) -> Reg {
    let one = t.emit.float(scalar, 1.0);
    let rest = t.emit.minus(scalar, one, src[2]);
    let near = t.emit.mul(scalar, src[0], rest);
    t.emit.op(op_for_width(scalar, Ir::FFma, Ir::FFma64), &[src[1], src[2], near])
}

fn smooth_step(t: &mut Translator, scalar: Scalar, src: &[Reg]) -> Reg {
    let (zero, one) = (t.emit.float(scalar, 0.0), t.emit.float(scalar, 1.0));
    let (two, three) = (t.emit.float(scalar, 2.0), t.emit.float(scalar, 3.0));
    let (top, span) = (t.emit.minus(scalar, src[2], src[0]), t.emit.minus(scalar, src[1], src[0]));
    let x = t.emit.over(scalar, top, span);
    let x = t.emit.op(op_for_width(scalar, Ir::FMax, Ir::FMax64), &[x, zero]);
    let x = t.emit.op(op_for_width(scalar, Ir::FMin, Ir::FMin64), &[x, one]);
    let twice = t.emit.mul(scalar, two, x);
    let slope = t.emit.minus(scalar, three, twice);
    let square = t.emit.mul(scalar, x, x);
    t.emit.mul(scalar, square, slope)
}

/// Translates conversions, `OpBitcast`, and conversions between addresses and integers.
pub fn conversion(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let opcode = instruction.opcode;
    if matches!(opcode, Op::Bitcast | Op::ConvertPtrToU | Op::ConvertUToPtr) {
        return bitcast(t, instruction);
    }
    let (to, _) = t.globals.types.vector(instruction.ty()?)?;
    let (from, regs) = t.vector(instruction.id(0)?)?;
    let truncates = opcode == Op::FConvert
        && to == (Scalar::Float { width: 16 })
        && t.module.rounds_towards_zero(instruction.result()?);
    let regs = regs
        .iter()
        .map(|reg| if truncates { Ok(truncate_to_half(t, from, *reg)) } else { convert(t, opcode, from, to, *reg) })
        .collect::<Result<_>>()?;
    t.define(instruction, regs)
}

/// A float rounded towards zero to binary16.
fn truncate_to_half(t: &mut Translator, from: Scalar, reg: Reg) -> Reg {
    // The bit that rounding to odd may set is below those of a binary16.
    let exact = if from.is_wide() { round_to_odd(t, reg) } else { reg };
    let half = t.emit.op(Ir::FToF16, &[exact]);
    let near = t.emit.op(Ir::F16ToF, &[half]);
    let [found, wanted] = [near, exact].map(|reg| t.emit.op(Ir::FAbs, &[reg]));
    let is_outwards = t.emit.op(Ir::FLt, &[wanted, found]);
    let one = t.emit.u32(1);
    let below = t.emit.op(Ir::ISub, &[half, one]);
    let inwards = t.emit.select(is_outwards, below, half);
    t.emit.op(Ir::F16ToF, &[inwards])
}

fn convert(t: &mut Translator, opcode: Op, from: Scalar, to: Scalar, reg: Reg) -> Result<Reg> {
    let wide = (from.is_wide(), to.is_wide());
    Ok(match opcode {
        Op::ConvertFToU | Op::ConvertFToS => {
            let signed = opcode == Op::ConvertFToS;
            let op = match (signed, wide) {
                (true, (false, false)) => Ir::FToS,
                (true, (false, true)) => Ir::FToS64,
                (true, (true, false)) => Ir::F64ToS,
                (true, (true, true)) => Ir::F64ToS64,
                (false, (false, false)) => Ir::FToU,
                (false, (false, true)) => Ir::FToU64,
                (false, (true, false)) => Ir::F64ToU,
                (false, (true, true)) => Ir::F64ToU64,
            };
            let reg = t.emit.op(op, &[reg]);
            t.emit.wrap_to_width(to, reg)
        }
        Op::ConvertSToF | Op::ConvertUToF => {
            let signed = opcode == Op::ConvertSToF;
            let reg = if signed { t.emit.sign_extend(from, reg) } else { t.emit.zero_extend(from, reg) };
            let op = match (signed, wide) {
                (true, (false, false)) => Ir::SToF,
                (true, (false, true)) => Ir::SToF64,
                (true, (true, false)) => Ir::S64ToF,
                (true, (true, true)) => Ir::S64ToF64,
                (false, (false, false)) => Ir::UToF,
                (false, (false, true)) => Ir::UToF64,
                (false, (true, false)) => Ir::U64ToF,
                (false, (true, true)) => Ir::U64ToF64,
            };
            let reg = t.emit.op(op, &[reg]);
            t.emit.wrap_to_width(to, reg)
        }
        Op::UConvert | Op::SConvert => {
            let signed = opcode == Op::SConvert;
            let reg = if signed { t.emit.sign_extend(from, reg) } else { t.emit.zero_extend(from, reg) };
            match wide {
                (false, true) if signed => t.emit.op(Ir::SToS64, &[reg]),
                (false, true) => t.emit.op(Ir::UToU64, &[reg]),
                (true, false) => {
                    let low = t.emit.op(Ir::Low32, &[reg]);
                    t.emit.wrap_to_width(to, low)
                }
                (false, false) => t.emit.wrap_to_width(to, reg),
                (true, true) => reg,
            }
        }
        Op::FConvert => match wide {
            (false, true) => t.emit.op(Ir::FToF64, &[reg]),
            (true, false) if to == (Scalar::Float { width: 16 }) => {
                let odd = round_to_odd(t, reg);
                t.emit.wrap_to_width(to, odd)
            }
            (true, false) => t.emit.op(Ir::F64ToF, &[reg]),
            (false, false) => t.emit.wrap_to_width(to, reg),
            (true, true) => reg,
        },
        Op::QuantizeToF16 => quantize(t, reg),
        other => return unsupported(format!("Op{other:?}")),
    })
}

/// A binary64 rounded to odd in binary32: towards zero, with the lowest bit set if that was inexact. Rounding it
/// further to binary16 gives the same result as rounding the binary64 once.
fn round_to_odd(t: &mut Translator, reg: Reg) -> Reg {
    let near = t.emit.op(Ir::F64ToF, &[reg]);
    let back = t.emit.op(Ir::FToF64, &[near]);
    let inexact = t.emit.op(Ir::FNe64, &[back, reg]);
    let (found, exact) = (t.emit.op(Ir::FAbs64, &[back]), t.emit.op(Ir::FAbs64, &[reg]));
    let outwards = t.emit.op(Ir::FLt64, &[exact, found]);
    let one = t.emit.u32(1);
    let below = t.emit.op(Ir::ISub, &[near, one]);
    let inwards = t.emit.select(outwards, below, near);
    let odd = t.emit.op(Ir::Or, &[inwards, one]);
    t.emit.select(inexact, odd, near)
}

/// Translates `OpQuantizeToF16`: rounds to a half, with denormals flushed to zero of the same sign.
fn quantize(t: &mut Translator, reg: Reg) -> Reg {
    let rounded = t.emit.op(Ir::RoundToF16, &[reg]);
    let size = t.emit.op(Ir::FAbs, &[rounded]);
    let least = t.emit.f32(f32::from_bits(0x3880_0000));
    let denormal = t.emit.op(Ir::FLt, &[size, least]);
    let mask = t.emit.u32(0x8000_0000);
    let zero = t.emit.op(Ir::And, &[rounded, mask]);
    t.emit.select(denormal, zero, rounded)
}

/// Translates a bitcast. The type with fewer components has wider ones.
fn bitcast(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let from = match t.globals.types.vector(t.type_of(instruction.id(0)?)?) {
        Ok((scalar, _)) => scalar,
        Err(_) => return unsupported("this pointer"),
    };
    let regs = t.regs(instruction.id(0)?)?;
    let (to, count) = t.globals.types.vector(instruction.ty()?)?;
    let (from_bits, to_bits) = (from.bits(), to.bits());
    if from_bits * regs.len() as u32 != to_bits * count || from_bits == 0 {
        return malformed("the types differ in size");
    }
    if from == to {
        return t.define(instruction, regs.to_vec());
    }
    if from_bits == to_bits {
        let regs = regs.iter().map(|reg| {
            let raw = raw_bits(t, from, *reg);
            typed_bits(t, to, raw)
        });
        let regs = regs.collect();
        return t.define(instruction, regs);
    }
    let words = pack_words(t, from, &regs);
    let regs = unpack_words(t, to, count, &words);
    t.define(instruction, regs)
}

/// A scalar's own bits, zero-extended: 32 of them, or 64 if it is wide.
fn raw_bits(t: &mut Translator, scalar: Scalar, reg: Reg) -> Reg {
    match scalar {
        Scalar::Float { width: 16 } => t.emit.op(Ir::FToF16, &[reg]),
        _ => t.emit.zero_extend(scalar, reg),
    }
}

fn typed_bits(t: &mut Translator, scalar: Scalar, reg: Reg) -> Reg {
    match scalar {
        Scalar::Float { width: 16 } => t.emit.op(Ir::F16ToF, &[reg]),
        _ => t.emit.wrap_to_width(scalar, reg),
    }
}

/// The bits of scalars in order, in words of 32 bits.
fn pack_words(t: &mut Translator, scalar: Scalar, regs: &[Reg]) -> Vec<Reg> {
    let width = scalar.bits();
    if width == 64 {
        return regs.iter().flat_map(|reg| [Ir::Low32, Ir::High32].map(|half| t.emit.op(half, &[*reg]))).collect();
    }
    let mut words = Vec::new();
    for group in regs.chunks((32 / width.max(8)) as usize) {
        let mut word = None;
        for (index, reg) in group.iter().enumerate() {
            let mut part = raw_bits(t, scalar, *reg);
            if index > 0 {
                let by = t.emit.u32(width * index as u32);
                part = t.emit.op(Ir::Shl, &[part, by]);
            }
            word = Some(match word {
                Some(word) => t.emit.op(Ir::Or, &[word, part]),
                None => part,
            });
        }
        words.extend(word);
    }
    words
}

/// Scalars from words of 32 bits.
fn unpack_words(t: &mut Translator, scalar: Scalar, count: u32, words: &[Reg]) -> Vec<Reg> {
    let width = scalar.bits();
    if width == 64 {
        return words.chunks_exact(2).map(|pair| t.emit.op(Ir::Join64, pair)).collect();
    }
    (0..count)
        .filter_map(|index| {
            let bit = index * width;
            let word = *words.get((bit / 32) as usize)?;
            let by = t.emit.u32(bit % 32);
            let part = t.emit.op(Ir::UShr, &[word, by]);
            let part = match scalar {
                Scalar::Float { width: 16 } => {
                    let mask = t.emit.u32(0xffff);
                    t.emit.op(Ir::And, &[part, mask])
                }
                _ => part,
            };
            Some(typed_bits(t, scalar, part))
        })
        .collect()
}
