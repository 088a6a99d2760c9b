//! Atomic operations on buffers, workgroup memory, device addresses and texels.

use isa::ir::{AtomicOp, Format, ImageAtomic, ImageRead, ImageWrite, Reg, Space, Statement};
use isa::op::Op as Ir;
use spirv::Op;

use super::descriptors::{mark_binding_written, mark_written};
use super::emitter::op_for_width;
use super::memory::{load_from, store_to};
use super::translator::Translator;
use super::value::Pointer;
use crate::error::{Result, malformed, unsupported};
use crate::instruction::Instruction;
use crate::types::Scalar;

fn atomic_op(op: Op) -> Result<AtomicOp> {
    Ok(match op {
        Op::AtomicExchange => AtomicOp::Exchange,
        Op::AtomicIAdd => AtomicOp::IAdd,
        Op::AtomicSMin => AtomicOp::SMin,
        Op::AtomicUMin => AtomicOp::UMin,
        Op::AtomicSMax => AtomicOp::SMax,
        Op::AtomicUMax => AtomicOp::UMax,
        Op::AtomicAnd => AtomicOp::And,
        Op::AtomicOr => AtomicOp::Or,
        Op::AtomicXor => AtomicOp::Xor,
        Op::AtomicFAddEXT => AtomicOp::FAdd,
        Op::AtomicFMinEXT => AtomicOp::FMin,
        Op::AtomicFMaxEXT => AtomicOp::FMax,
        other => return unsupported(format!("Op{other:?}")),
    })
}

/// Translates atomic instructions.
pub fn atomic(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let pointer = t.pointer(instruction.id(0)?)?;
    match instruction.opcode {
        Op::AtomicLoad => match &pointer {
            Pointer::Texel { .. } => {
                let reg = load_texel(t, &pointer)?;
                t.define(instruction, vec![reg])
            }
            _ => {
                let regs = load_from(t, &pointer)?;
                t.define(instruction, regs)
            }
        },
        Op::AtomicStore => {
            let value = t.reg(instruction.id(3)?)?;
            match &pointer {
                Pointer::Texel { .. } => store_texel(t, &pointer, value),
                _ => store_to(t, &pointer, &[value]),
            }
        }
        _ => read_modify_write(t, instruction, &pointer),
    }
}

fn read_modify_write(t: &mut Translator, instruction: &Instruction, pointer: &Pointer) -> Result<()> {
    let (scalar, count) = t.globals.types.vector(instruction.ty()?)?;
    if count != 1 {
        return malformed("the result isn't a scalar");
    }
    let one = |t: &mut Translator| match scalar.is_wide() {
        true => t.emit.u64(1),
        false => t.emit.u32(1),
    };
    let mut comparator = None;
    let (op, value) = match instruction.opcode {
        Op::AtomicIIncrement => (AtomicOp::IAdd, one(t)),
        Op::AtomicIDecrement => {
            let one = one(t);
            (AtomicOp::IAdd, t.emit.op(op_for_width(scalar, Ir::INeg, Ir::INeg64), &[one]))
        }
        Op::AtomicISub => {
            let value = t.reg(instruction.id(3)?)?;
            (AtomicOp::IAdd, t.emit.op(op_for_width(scalar, Ir::INeg, Ir::INeg64), &[value]))
        }
        Op::AtomicCompareExchange => {
            comparator = Some(t.reg(instruction.id(5)?)?);
            (AtomicOp::CompareExchange, t.reg(instruction.id(4)?)?)
        }
        other => (atomic_op(other)?, t.reg(instruction.id(3)?)?),
    };
    let float = matches!(op, AtomicOp::FAdd | AtomicOp::FMin | AtomicOp::FMax);
    if float && scalar != (Scalar::Float { width: 32 }) {
        return unsupported("atomics on floats that aren't 32 bits");
    }
    let old = apply(t, pointer, op, scalar, value, comparator)?;
    t.define(instruction, vec![old])
}

fn apply(
    t: &mut Translator,
    pointer: &Pointer,
    op: AtomicOp,
    scalar: Scalar,
    value: Reg,
    comparator: Option<Reg>,
) -> Result<Reg> {
    match pointer {
        Pointer::Memory(place) if !matches!(place.space, Space::Private | Space::PushConstants) => {
            let format = match scalar.format() {
                format @ (Format::B32 | Format::B64) => format,
                _ => return unsupported("atomics on narrow integers"),
            };
            mark_written(t, place);
            Ok(t.emit.builder.atomic(op, place.at(0), format, value, comparator))
        }
        Pointer::Texel { image, image_type, coordinate, sample } => {
            mark_binding_written(t, *image);
            let dst = t.emit.builder.value(scalar.register());
            t.emit.builder.statement(Statement::ImageAtomic(Box::new(ImageAtomic {
                dst: Some(dst),
                op,
                image: *image,
                shape: image_type.shape()?,
                coordinate: coordinate.clone(),
                sample: image_type.multisampled.then_some(*sample),
                value,
                comparator,
            })));
            Ok(dst)
        }
        _ => malformed("atomics on this pointer"),
    }
}

fn load_texel(t: &mut Translator, pointer: &Pointer) -> Result<Reg> {
    let Pointer::Texel { image, image_type, coordinate, sample } = pointer else {
        return malformed("the pointer isn't to a texel");
    };
    let dst = t.emit.builder.value(isa::ir::Type::B32);
    t.emit.builder.statement(Statement::ImageRead(Box::new(ImageRead {
        dst: [Some(dst), None, None, None],
        image: *image,
        shape: image_type.shape()?,
        coordinate: coordinate.clone(),
        level: None,
        sample: image_type.multisampled.then_some(*sample),
    })));
    Ok(dst)
}

fn store_texel(t: &mut Translator, pointer: &Pointer, value: Reg) -> Result<()> {
    let Pointer::Texel { image, image_type, coordinate, sample } = pointer else {
        return malformed("the pointer isn't to a texel");
    };
    mark_binding_written(t, *image);
    let zero = t.emit.u32(0);
    t.emit.builder.statement(Statement::ImageWrite(Box::new(ImageWrite {
        image: *image,
        shape: image_type.shape()?,
        coordinate: coordinate.clone(),
        sample: image_type.multisampled.then_some(*sample),
        texel: [value, zero, zero, zero],
    })));
    Ok(())
}
