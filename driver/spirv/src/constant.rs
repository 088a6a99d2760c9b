//! Arithmetic on constants, for `OpSpecConstantOp`.

use half::f16;
use spirv::Op;

use super::error::{Outcome, malformed, unsupported};
use super::globals::{Constant, Globals};
use super::types::Scalar;

/// The register form of a constant's bits in memory.
pub(crate) fn from_memory(scalar: Scalar, bits: u64) -> u64 {
    match scalar {
        Scalar::Bool => u64::from(bits != 0),
        Scalar::Float { width: 16 } => u64::from(f16::from_bits(bits as u16).to_f32().to_bits()),
        Scalar::Int { .. } | Scalar::Float { .. } | Scalar::Address => normalize(scalar, bits),
    }
}

/// Cuts an integer to its width and extends it by its own signedness to its register.
fn normalize(scalar: Scalar, bits: u64) -> u64 {
    match scalar {
        Scalar::Int {
            width: 8,
            signed: true,
        } => u64::from(i32::from(bits as i8).cast_unsigned()),
        Scalar::Int { width: 8, .. } => bits & 0xff,
        Scalar::Int {
            width: 16,
            signed: true,
        } => u64::from(i32::from(bits as i16).cast_unsigned()),
        Scalar::Int { width: 16, .. } => bits & 0xffff,
        _ if scalar.is_wide() => bits,
        _ => bits & 0xffff_ffff,
    }
}

/// An integer's value from its register form.
fn number(scalar: Scalar, bits: u64) -> Number {
    let Scalar::Int { width, .. } = scalar else {
        return Number {
            width: 32,
            unsigned: bits,
            signed: bits.cast_signed(),
        };
    };
    let shift = 64 - width.min(64);
    Number {
        width,
        unsigned: bits << shift >> shift,
        signed: (bits << shift).cast_signed() >> shift,
    }
}

/// An integer, read both ways.
#[derive(Clone, Copy)]
struct Number {
    width: u32,
    unsigned: u64,
    signed: i64,
}

/// The value of an operation on constants: `words` are its opcode and its operands.
pub(crate) fn evaluate(globals: &Globals, ty: u32, words: &[u32]) -> Outcome<Vec<u64>> {
    let Some((opcode, operands)) = words.split_first() else {
        return malformed("there is no operation");
    };
    let Some(op) = Op::from_u32(*opcode) else {
        return malformed(format!("there is no operation {opcode}"));
    };
    let operand = |index: usize| -> Outcome<&Constant> {
        let id = operands.get(index).copied().unwrap_or(0);
        match globals.constants.get(&id) {
            Some(constant) => Ok(constant),
            None => malformed(format!("operand {index} isn't a constant")),
        }
    };
    match op {
        Op::CompositeExtract => {
            let whole = operand(0)?;
            let indices = operands.get(1..).unwrap_or_default();
            let (part, start) = path(globals, whole.ty, indices)?;
            let count = globals.types.scalars(part)? as usize;
            return Ok(whole.bits[start..start + count].to_vec());
        }
        Op::CompositeInsert => {
            let (object, whole) = (operand(0)?, operand(1)?);
            let indices = operands.get(2..).unwrap_or_default();
            let (part, start) = path(globals, whole.ty, indices)?;
            let count = globals.types.scalars(part)? as usize;
            if object.bits.len() != count {
                return malformed("the object doesn't fit its place");
            }
            let mut bits = whole.bits.to_vec();
            bits[start..start + count].copy_from_slice(&object.bits);
            return Ok(bits);
        }
        Op::VectorShuffle => {
            let (a, b) = (operand(0)?, operand(1)?);
            let pick = |index: &u32| {
                let both = a.bits.iter().chain(b.bits.iter());
                both.copied().nth(*index as usize).unwrap_or(0)
            };
            let indices = operands.get(2..).unwrap_or_default();
            return Ok(indices.iter().take(4).map(pick).collect());
        }
        Op::Select => {
            let (condition, a, b) = (operand(0)?, operand(1)?, operand(2)?);
            if a.bits.len() != b.bits.len() || condition.bits.is_empty() {
                return malformed("the operands differ in size");
            }
            let pick = |index: usize| {
                let condition = condition.bits[index.min(condition.bits.len() - 1)];
                if condition != 0 {
                    a.bits[index]
                } else {
                    b.bits[index]
                }
            };
            return Ok((0..a.bits.len()).map(pick).collect());
        }
        _ => {}
    }
    let (result, count) = globals.types.vector(ty)?;
    let first = operand(0)?;
    let (from, _) = globals.types.vector(first.ty)?;
    let second = match operands.len() {
        1 => first,
        _ => operand(1)?,
    };
    let (from_second, _) = globals.types.vector(second.ty)?;
    if first.bits.len() != count as usize || second.bits.len() != count as usize {
        return malformed("the operands differ in size");
    }
    let pairs = first.bits.iter().zip(second.bits.iter());
    pairs
        .map(|(a, b)| match (from, result) {
            (Scalar::Float { .. }, _) => float(op, from, result, *a),
            (Scalar::Bool, _) => logical(op, *a != 0, *b != 0).map(u64::from),
            _ => {
                let value = integer(op, number(from, *a), number(from_second, *b))?;
                Ok(normalize(result, value))
            }
        })
        .collect()
}

/// Where a path of indices leads in a composite: the part's type and the scalars before it.
fn path(globals: &Globals, mut ty: u32, indices: &[u32]) -> Outcome<(u32, usize)> {
    let mut start = 0;
    for index in indices {
        let (part, before) = globals.types.part(ty, *index)?;
        ty = part;
        start += before as usize;
    }
    Ok((ty, start))
}

fn float(op: Op, from: Scalar, result: Scalar, bits: u64) -> Outcome<u64> {
    let value = match from {
        Scalar::Float { width: 64 } => f64::from_bits(bits),
        _ => f64::from(f32::from_bits(bits as u32)),
    };
    match (op, result) {
        (Op::FConvert, Scalar::Float { width: 64 }) => Ok(value.to_bits()),
        (Op::FConvert, Scalar::Float { width: 16 }) | (Op::QuantizeToF16, _) => {
            Ok(u64::from(f16::from_f64(value).to_f32().to_bits()))
        }
        (Op::FConvert, Scalar::Float { .. }) => Ok(u64::from((value as f32).to_bits())),
        _ => unsupported(format!("Op{op:?} on constant floats")),
    }
}

fn logical(op: Op, a: bool, b: bool) -> Outcome<bool> {
    Ok(match op {
        Op::LogicalOr => a || b,
        Op::LogicalAnd => a && b,
        Op::LogicalNot => !a,
        Op::LogicalEqual => a == b,
        Op::LogicalNotEqual => a != b,
        _ => return unsupported(format!("Op{op:?} on constant booleans")),
    })
}

fn integer(op: Op, a: Number, b: Number) -> Outcome<u64> {
    let (ua, ub, sa, sb) = (a.unsigned, b.unsigned, a.signed, b.signed);
    // Shifting by the width or more isn't defined; it is taken modulo the width, as the device does.
    let shift = (ub % u64::from(a.width)) as u32;
    let signed = |value: i64| value.cast_unsigned();
    Ok(match op {
        Op::SConvert => signed(sa),
        Op::UConvert => ua,
        Op::SNegate => signed(sa.wrapping_neg()),
        Op::Not => !ua,
        Op::IAdd => ua.wrapping_add(ub),
        Op::ISub => ua.wrapping_sub(ub),
        Op::IMul => ua.wrapping_mul(ub),
        Op::UDiv => ua.checked_div(ub).unwrap_or(u64::MAX),
        Op::SDiv if sb == 0 => u64::MAX,
        Op::SDiv => signed(sa.wrapping_div(sb)),
        Op::UMod => ua.checked_rem(ub).unwrap_or(ua),
        Op::SRem | Op::SMod if sb == 0 => ua,
        Op::SRem => signed(sa.wrapping_rem(sb)),
        Op::SMod => {
            let remainder = sa.wrapping_rem(sb);
            let differs = remainder != 0 && (remainder < 0) != (sb < 0);
            signed(if differs {
                remainder.wrapping_add(sb)
            } else {
                remainder
            })
        }
        Op::ShiftRightLogical => ua >> shift,
        Op::ShiftRightArithmetic => signed(sa >> shift),
        Op::ShiftLeftLogical => ua << shift,
        Op::BitwiseOr => ua | ub,
        Op::BitwiseXor => ua ^ ub,
        Op::BitwiseAnd => ua & ub,
        Op::IEqual => u64::from(ua == ub),
        Op::INotEqual => u64::from(ua != ub),
        Op::ULessThan => u64::from(ua < ub),
        Op::SLessThan => u64::from(sa < sb),
        Op::UGreaterThan => u64::from(ua > ub),
        Op::SGreaterThan => u64::from(sa > sb),
        Op::ULessThanEqual => u64::from(ua <= ub),
        Op::SLessThanEqual => u64::from(sa <= sb),
        Op::UGreaterThanEqual => u64::from(ua >= ub),
        Op::SGreaterThanEqual => u64::from(sa >= sb),
        _ => return unsupported(format!("Op{op:?} on constants")),
    })
}
