//! Dot products of integers: of vectors, or of words with four bytes each.

use isa::ir::Reg;
use isa::op::Op as Ir;
use spirv::Op;

use super::translator::Translator;
use crate::error::{Result, malformed, unsupported};
use crate::instruction::Instruction;
use crate::types::Scalar;

/// The signedness of an operation: of the factors, and of the sum.
#[derive(Clone, Copy)]
struct Signs {
    left: bool,
    right: bool,
}

impl Signs {
    fn of(opcode: Op) -> Self {
        let left = !matches!(opcode, Op::UDot | Op::UDotAccSat);
        let right = matches!(opcode, Op::SDot | Op::SDotAccSat);
        Self { left, right }
    }

    /// Reports whether the sum is signed, which it is if a factor is.
    fn sum(self) -> bool {
        self.left || self.right
    }
}

/// Translates `OpSDot`, `OpUDot`, `OpSUDot`, and their forms with an accumulator, to which the sum is added with
/// saturation.
pub fn integer_dot(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let signs = Signs::of(instruction.opcode);
    let accumulates = matches!(instruction.opcode, Op::SDotAccSat | Op::UDotAccSat | Op::SUDotAccSat);
    let (result, count) = t.globals.types.vector(instruction.ty()?)?;
    let Scalar::Int { width, .. } = result else {
        return malformed("the result isn't an integer");
    };
    if count != 1 {
        return malformed("the result isn't a scalar");
    }
    let a = factors(t, instruction.id(0)?, signs.left)?;
    let b = factors(t, instruction.id(1)?, signs.right)?;
    if a.len() != b.len() || a.is_empty() {
        return malformed("the operands differ in size");
    }
    let mut sum: Option<Reg> = None;
    for (a, b) in a.iter().zip(&b) {
        let product = t.emit.op(Ir::IMul64, &[*a, *b]);
        sum = Some(match sum {
            Some(sum) => t.emit.op(Ir::IAdd64, &[sum, product]),
            None => product,
        });
    }
    let Some(sum) = sum else {
        return malformed("the operands are empty");
    };
    let sum = if accumulates {
        let (scalar, accumulator) = t.vector(instruction.id(2)?)?;
        let [accumulator] = *accumulator else {
            return malformed("the accumulator isn't a scalar");
        };
        let accumulator = widened(t, scalar, accumulator, signs.sum());
        saturated_sum(t, width, signs.sum(), sum, accumulator)
    } else {
        sum
    };
    let reg = if result.is_wide() {
        sum
    } else {
        let low = t.emit.op(Ir::Low32, &[sum]);
        t.emit.wrap_to_width(result, low)
    };
    t.define(instruction, vec![reg])
}

/// The components of an operand, each extended to 64 bits; for a single word, its four bytes.
fn factors(t: &mut Translator, id: u32, signed: bool) -> Result<Vec<Reg>> {
    let (scalar, regs) = t.vector(id)?;
    match (scalar, &*regs) {
        (Scalar::Int { width: 32, .. }, [word]) => {
            let extract = if signed { Ir::BitfieldSExtract } else { Ir::BitfieldUExtract };
            let bytes = (0..4).map(|index| {
                let (at, width) = (t.emit.u32(8 * index), t.emit.u32(8));
                let byte = t.emit.op(extract, &[*word, at, width]);
                t.emit.op(if signed { Ir::SToS64 } else { Ir::UToU64 }, &[byte])
            });
            Ok(bytes.collect())
        }
        (Scalar::Int { .. }, regs) if regs.len() > 1 => {
            Ok(regs.iter().map(|reg| widened(t, scalar, *reg, signed)).collect())
        }
        _ => unsupported("a dot product of these operands"),
    }
}

/// An integer extended to 64 bits.
fn widened(t: &mut Translator, scalar: Scalar, reg: Reg, signed: bool) -> Reg {
    match (scalar.is_wide(), signed) {
        (true, _) => reg,
        (false, true) => {
            let reg = t.emit.sign_extend(scalar, reg);
            t.emit.op(Ir::SToS64, &[reg])
        }
        (false, false) => {
            let reg = t.emit.zero_extend(scalar, reg);
            t.emit.op(Ir::UToU64, &[reg])
        }
    }
}

/// The sum of two integers in 64 bits, clamped to the range of integers of a width.
fn saturated_sum(t: &mut Translator, width: u32, signed: bool, a: Reg, b: Reg) -> Reg {
    let sum = t.emit.op(Ir::IAdd64, &[a, b]);
    match (width, signed) {
        (64, false) => {
            let ones = t.emit.u64(u64::MAX);
            let overflows = t.emit.op(Ir::ULt64, &[sum, a]);
            t.emit.select(overflows, ones, sum)
        }
        (64, true) => {
            // It overflows if both have the sign that the sum doesn't have.
            let changed = [a, b].map(|reg| t.emit.op(Ir::Xor64, &[sum, reg]));
            let changed = t.emit.op(Ir::And64, &changed);
            let (zero, most) = (t.emit.u64(0), t.emit.u64(i64::MAX.cast_unsigned()));
            let overflows = t.emit.op(Ir::SLt64, &[changed, zero]);
            let by = t.emit.u32(63);
            let sign = t.emit.op(Ir::SShr64, &[a, by]);
            let limit = t.emit.op(Ir::Xor64, &[sign, most]);
            t.emit.select(overflows, limit, sum)
        }
        (_, false) => {
            let most = t.emit.u64((1 << width) - 1);
            t.emit.op(Ir::UMin64, &[sum, most])
        }
        (_, true) => {
            let most = (1_i64 << (width - 1)) - 1;
            let (least, most) = (t.emit.u64((!most).cast_unsigned()), t.emit.u64(most.cast_unsigned()));
            let sum = t.emit.op(Ir::SMax64, &[sum, least]);
            t.emit.op(Ir::SMin64, &[sum, most])
        }
    }
}
