//! The extended instructions of GLSL.std.450.

use isa::ir::Reg;
use isa::op::Op as Ir;
use spirv::GlslStd450Op as G;

use super::composite::{determinant, dot, inverse, matrix};
use super::elementwise::{glsl_elementwise, inverse_sqrt, operands};
use super::emitter::op_for_width;
use super::interpolation::interpolate;
use super::memory::store_to;
use super::translator::Translator;
use crate::error::{Result, malformed};
use crate::instruction::Instruction;
use crate::types::Scalar;

/// Translates `OpExtInst` of GLSL.std.450.
pub fn glsl(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let Some(op) = G::from_u32(instruction.number(1)?) else {
        return malformed(format!("GLSL.std.450 has no instruction {}", instruction.number(1)?));
    };
    match op {
        G::Modf | G::ModfStruct | G::Frexp | G::FrexpStruct => split_float(t, instruction, op),
        G::Ldexp => {
            let (scalar, a) = t.vector(instruction.id(2)?)?;
            let (exponent, b) = t.vector(instruction.id(3)?)?;
            if a.len() != b.len() {
                return malformed("the operands don't fit each other");
            }
            let mut regs = Vec::with_capacity(a.len());
            for (a, b) in a.iter().zip(b.iter()) {
                let b = ldexp_exponent(t, exponent, *b);
                let reg = t.emit.op(op_for_width(scalar, Ir::FLdexp, Ir::FLdexp64), &[*a, b]);
                regs.push(t.emit.wrap_to_width(scalar, reg));
            }
            t.define(instruction, regs)
        }
        G::Determinant | G::MatrixInverse => {
            let ty = t.type_of(instruction.id(2)?)?;
            let (_, _, _, scalar) = t.globals.types.matrix(ty)?;
            let matrix = matrix(t, instruction.id(2)?)?;
            let regs = match op {
                G::Determinant => vec![determinant(t, scalar, &matrix)?],
                _ => inverse(t, scalar, &matrix)?,
            };
            t.define(instruction, regs)
        }
        G::Length | G::Distance | G::Normalize | G::Cross | G::FaceForward | G::Reflect | G::Refract => {
            geometric(t, instruction, op)
        }
        G::PackSnorm4x8
        | G::PackUnorm4x8
        | G::PackSnorm2x16
        | G::PackUnorm2x16
        | G::PackHalf2x16
        | G::PackDouble2x32 => pack(t, instruction, op),
        G::UnpackSnorm4x8
        | G::UnpackUnorm4x8
        | G::UnpackSnorm2x16
        | G::UnpackUnorm2x16
        | G::UnpackHalf2x16
        | G::UnpackDouble2x32 => unpack(t, instruction, op),
        G::InterpolateAtCentroid | G::InterpolateAtSample | G::InterpolateAtOffset => interpolate(t, instruction, op),
        _ => glsl_elementwise(t, instruction, op),
    }
}

/// An exponent of 32 bits. One of 64 bits is clamped to a range that still exceeds any float's exponent.
fn ldexp_exponent(t: &mut Translator, scalar: Scalar, exponent: Reg) -> Reg {
    const MOST: i64 = 1 << 16;
    if !scalar.is_wide() {
        return t.emit.sign_extend(scalar, exponent);
    }
    let (least, most) = (t.emit.u64((-MOST).cast_unsigned()), t.emit.u64(MOST.cast_unsigned()));
    let exponent = t.emit.op(Ir::SMax64, &[exponent, least]);
    let exponent = t.emit.op(Ir::SMin64, &[exponent, most]);
    t.emit.op(Ir::Low32, &[exponent])
}

fn split_float(t: &mut Translator, instruction: &Instruction, op: G) -> Result<()> {
    let (scalar, x) = t.vector(instruction.id(2)?)?;
    let (mut first, mut second) = (Vec::new(), Vec::new());
    for x in x.iter() {
        if matches!(op, G::Modf | G::ModfStruct) {
            let whole = t.emit.op(op_for_width(scalar, Ir::FTrunc, Ir::FTrunc64), &[*x]);
            let fraction = t.emit.minus(scalar, *x, whole);
            // Zero has the sign of x, also as the fraction of an infinity.
            let zero = t.emit.float(scalar, 0.0);
            let is_zero = t.emit.op(op_for_width(scalar, Ir::FEq, Ir::FEq64), &[fraction, zero]);
            let signed = t.emit.op(op_for_width(scalar, Ir::FMul, Ir::FMul64), &[whole, zero]);
            let fraction = t.emit.select(is_zero, signed, fraction);
            let infinite = t.emit.op(op_for_width(scalar, Ir::FIsInf, Ir::FIsInf64), &[*x]);
            let negative_zero = t.emit.float(scalar, -0.0);
            let is_negative = t.emit.op(op_for_width(scalar, Ir::FLt, Ir::FLt64), &[*x, zero]);
            let of_infinite = t.emit.select(is_negative, negative_zero, zero);
            first.push(t.emit.select(infinite, of_infinite, fraction));
            second.push(whole);
        } else {
            let significand = op_for_width(scalar, Ir::FFrexpSignificand, Ir::FFrexpSignificand64);
            first.push(t.emit.op(significand, &[*x]));
            second.push(t.emit.op(op_for_width(scalar, Ir::FFrexpExponent, Ir::FFrexpExponent64), &[*x]));
        }
    }
    if matches!(op, G::Modf | G::Frexp) {
        let pointer = t.pointer(instruction.id(3)?)?;
        store_to(t, &pointer, &second)?;
    } else {
        first.extend(second);
    }
    t.define(instruction, first)
}

fn length(t: &mut Translator, scalar: Scalar, x: &[Reg]) -> Result<Reg> {
    if let [one] = x {
        return Ok(t.emit.op(op_for_width(scalar, Ir::FAbs, Ir::FAbs64), &[*one]));
    }
    let square = dot(t, scalar, x, x, true)?;
    Ok(t.emit.op(op_for_width(scalar, Ir::FSqrt, Ir::FSqrt64), &[square]))
}

fn geometric(t: &mut Translator, instruction: &Instruction, op: G) -> Result<()> {
    let count = match op {
        G::Length | G::Normalize => 1,
        G::FaceForward => 3,
        _ => 2,
    };
    let (scalars, operands) = operands(t, instruction, 2, count)?;
    let result = scalars[0];
    // Squares of halves leave a half's range, and are rounded at the end alone.
    let scalar = if result == (Scalar::Float { width: 16 }) { Scalar::Float { width: 32 } } else { result };
    let x = &operands[0];
    let regs = match op {
        G::Length => vec![length(t, scalar, x)?],
        G::Distance => {
            let pairs = x.iter().zip(operands[1].iter());
            let apart: Vec<Reg> = pairs.map(|(a, b)| t.emit.minus(scalar, *a, *b)).collect();
            vec![length(t, scalar, &apart)?]
        }
        G::Normalize => {
            let square = dot(t, scalar, x, x, true)?;
            let inverse = inverse_sqrt(t, scalar, square);
            x.iter().map(|x| t.emit.mul(scalar, *x, inverse)).collect()
        }
        G::Cross => {
            let ([a0, a1, a2], [b0, b1, b2]) = (&**x, &*operands[1]) else {
                return malformed("the operands don't have three components");
            };
            [[a1, b2, a2, b1], [a2, b0, a0, b2], [a0, b1, a1, b0]]
                .map(|[a, b, c, d]| {
                    let (left, right) = (t.emit.mul(scalar, *a, *b), t.emit.mul(scalar, *c, *d));
                    t.emit.minus(scalar, left, right)
                })
                .to_vec()
        }
        G::FaceForward => {
            let along = dot(t, scalar, &operands[2], &operands[1], true)?;
            let zero = t.emit.float(scalar, 0.0);
            let facing = t.emit.op(op_for_width(scalar, Ir::FLt, Ir::FLt64), &[along, zero]);
            x.iter()
                .map(|x| {
                    let away = t.emit.op(op_for_width(scalar, Ir::FNeg, Ir::FNeg64), &[*x]);
                    t.emit.select(facing, *x, away)
                })
                .collect()
        }
        G::Reflect => {
            let along = dot(t, scalar, &operands[1], x, true)?;
            let two = t.emit.float(scalar, 2.0);
            let twice = t.emit.mul(scalar, two, along);
            let pairs = x.iter().zip(operands[1].iter());
            pairs
                .map(|(i, n)| {
                    let back = t.emit.mul(scalar, twice, *n);
                    t.emit.minus(scalar, *i, back)
                })
                .collect()
        }
        _ => refract(t, instruction, scalar, x, &operands[1])?,
    };
    let regs = regs.into_iter().map(|reg| t.emit.wrap_to_width(result, reg)).collect();
    t.define(instruction, regs)
}

fn refract(t: &mut Translator, instruction: &Instruction, scalar: Scalar, i: &[Reg], n: &[Reg]) -> Result<Vec<Reg>> {
    let eta = t.reg(instruction.id(4)?)?;
    let (zero, one) = (t.emit.float(scalar, 0.0), t.emit.float(scalar, 1.0));
    let along = dot(t, scalar, n, i, true)?;
    let (along_2, eta_2) = (t.emit.mul(scalar, along, along), t.emit.mul(scalar, eta, eta));
    let rest = t.emit.minus(scalar, one, along_2);
    let rest = t.emit.mul(scalar, eta_2, rest);
    let k = t.emit.minus(scalar, one, rest);
    let total = t.emit.op(op_for_width(scalar, Ir::FLt, Ir::FLt64), &[k, zero]);
    let root = t.emit.op(op_for_width(scalar, Ir::FSqrt, Ir::FSqrt64), &[k]);
    let forward = t.emit.mul(scalar, eta, along);
    let factor = t.emit.plus(scalar, forward, root);
    Ok(i.iter()
        .zip(n)
        .map(|(i, n)| {
            let (bent, normal) = (t.emit.mul(scalar, eta, *i), t.emit.mul(scalar, factor, *n));
            let refracted = t.emit.minus(scalar, bent, normal);
            t.emit.select(total, zero, refracted)
        })
        .collect())
}

fn pack(t: &mut Translator, instruction: &Instruction, op: G) -> Result<()> {
    let x = t.regs(instruction.id(2)?)?;
    if op == G::PackDouble2x32 {
        let [low, high] = *x else {
            return malformed("the operand doesn't have two components");
        };
        let joined = t.emit.op(Ir::Join64, &[low, high]);
        return t.define(instruction, vec![joined]);
    }
    let (count, bits, scale, least) = match op {
        G::PackSnorm4x8 => (4, 8, 127.0, -1.0),
        G::PackUnorm4x8 => (4, 8, 255.0, 0.0),
        G::PackSnorm2x16 => (2, 16, 32767.0, -1.0),
        G::PackUnorm2x16 => (2, 16, 65535.0, 0.0),
        _ => (2, 16, 0.0, 0.0),
    };
    if x.len() != count {
        return malformed("the operand has the wrong size");
    }
    let mut word = None;
    for (index, x) in (0..).zip(x.iter()) {
        let part = if op == G::PackHalf2x16 {
            t.emit.op(Ir::FToF16, &[*x])
        } else {
            let (least, most, scale) = (t.emit.f32(least), t.emit.f32(1.0), t.emit.f32(scale));
            let x = t.emit.op(Ir::FMax, &[*x, least]);
            let x = t.emit.op(Ir::FMin, &[x, most]);
            let x = t.emit.op(Ir::FMul, &[x, scale]);
            let x = t.emit.op(Ir::FRoundEven, &[x]);
            let x = t.emit.op(Ir::FToS, &[x]);
            let mask = t.emit.u32((1 << bits) - 1);
            t.emit.op(Ir::And, &[x, mask])
        };
        let by = t.emit.u32(bits * index);
        let placed = t.emit.op(Ir::Shl, &[part, by]);
        word = Some(match word {
            Some(word) => t.emit.op(Ir::Or, &[word, placed]),
            None => placed,
        });
    }
    t.define(instruction, word.into_iter().collect())
}

fn unpack(t: &mut Translator, instruction: &Instruction, op: G) -> Result<()> {
    let x = t.reg(instruction.id(2)?)?;
    if op == G::UnpackDouble2x32 {
        let halves = [Ir::Low32, Ir::High32].map(|half| t.emit.op(half, &[x]));
        return t.define(instruction, halves.to_vec());
    }
    let (count, bits, scale) = match op {
        G::UnpackSnorm4x8 => (4, 8, 127.0),
        G::UnpackUnorm4x8 => (4, 8, 255.0),
        G::UnpackSnorm2x16 => (2, 16, 32767.0),
        G::UnpackUnorm2x16 => (2, 16, 65535.0),
        _ => (2, 16, 1.0),
    };
    let signed = matches!(op, G::UnpackSnorm4x8 | G::UnpackSnorm2x16);
    let mut regs = Vec::with_capacity(count as usize);
    for index in 0..count {
        let (at, width) = (t.emit.u32(bits * index), t.emit.u32(bits));
        let extract = if signed { Ir::BitfieldSExtract } else { Ir::BitfieldUExtract };
        let part = t.emit.op(extract, &[x, at, width]);
        if op == G::UnpackHalf2x16 {
            regs.push(t.emit.op(Ir::F16ToF, &[part]));
            continue;
        }
        let value = t.emit.op(if signed { Ir::SToF } else { Ir::UToF }, &[part]);
        let scale = t.emit.f32(scale);
        let value = t.emit.op(Ir::FDiv, &[value, scale]);
        regs.push(if signed {
            let least = t.emit.f32(-1.0);
            t.emit.op(Ir::FMax, &[value, least])
        } else {
            value
        });
    }
    t.define(instruction, regs)
}
