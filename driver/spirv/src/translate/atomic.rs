//! Atomic operations on buffers, workgroup memory, device addresses and texels.

use isa::ir::{AtomicOp, Format, ImageAtomic, ImageRead, ImageWrite, Reg, Space, Statement};
use isa::op::Op as Ir;
use spirv::Op;

use super::super::error::{Result, malformed, unsupported};
use super::super::instruction::Instruction;
use super::super::types::Scalar;
use super::Translator;
use super::access::Pointer;
use super::arithmetic::op_for_width;
use super::resource::shape;

impl Translator<'_> {
    /// Atomic instructions.
    pub fn atomic(&mut self, it: &Instruction) -> Result<()> {
        let pointer = self.pointer(it.id(0)?)?;
        match it.opcode {
            Op::AtomicLoad => match &pointer {
                Pointer::Texel { .. } => {
                    let reg = self.load_texel(&pointer)?;
                    self.define(it, vec![reg])
                }
                _ => {
                    let regs = self.load_from(&pointer)?;
                    self.define(it, regs)
                }
            },
            Op::AtomicStore => {
                let value = self.reg(it.id(3)?)?;
                match &pointer {
                    Pointer::Texel { .. } => self.store_texel(&pointer, value),
                    _ => self.store_to(&pointer, &[value]),
                }
            }
            _ => self.read_modify_write(it, &pointer),
        }
    }

    fn read_modify_write(&mut self, it: &Instruction, pointer: &Pointer) -> Result<()> {
        let (scalar, count) = self.globals.types.vector(it.ty()?)?;
        if count != 1 {
            return malformed("the result isn't a scalar");
        }
        let one = |this: &mut Self| match scalar.is_wide() {
            true => this.u64(1),
            false => this.u32(1),
        };
        let mut comparator = None;
        let (op, value) = match it.opcode {
            Op::AtomicIIncrement => (AtomicOp::IAdd, one(self)),
            Op::AtomicIDecrement => {
                let one = one(self);
                (
                    AtomicOp::IAdd,
                    self.op(op_for_width(scalar, Ir::INeg, Ir::INeg64), &[one]),
                )
            }
            Op::AtomicISub => {
                let value = self.reg(it.id(3)?)?;
                (
                    AtomicOp::IAdd,
                    self.op(op_for_width(scalar, Ir::INeg, Ir::INeg64), &[value]),
                )
            }
            Op::AtomicCompareExchange => {
                comparator = Some(self.reg(it.id(5)?)?);
                (AtomicOp::CompareExchange, self.reg(it.id(4)?)?)
            }
            other => (atomic_op(other)?, self.reg(it.id(3)?)?),
        };
        let float = matches!(op, AtomicOp::FAdd | AtomicOp::FMin | AtomicOp::FMax);
        if float && scalar != (Scalar::Float { width: 32 }) {
            return unsupported("atomics on floats that aren't 32 bits");
        }
        let old = self.apply(pointer, op, scalar, value, comparator)?;
        self.define(it, vec![old])
    }

    fn apply(
        &mut self,
        pointer: &Pointer,
        op: AtomicOp,
        scalar: Scalar,
        value: Reg,
        comparator: Option<Reg>,
    ) -> Result<Reg> {
        match pointer {
            Pointer::Memory(place)
                if !matches!(place.space, Space::Private | Space::PushConstants) =>
            {
                let format = match scalar.format() {
                    format @ (Format::B32 | Format::B64) => format,
                    _ => return unsupported("atomics on narrow integers"),
                };
                self.note_write(place);
                Ok(self
                    .builder
                    .atomic(op, place.at(0), format, value, comparator))
            }
            Pointer::Texel {
                image,
                image_type,
                coordinate,
                sample,
            } => {
                self.note_binding_write(*image);
                let dst = self.builder.value(scalar.register());
                self.builder
                    .statement(Statement::ImageAtomic(Box::new(ImageAtomic {
                        dst: Some(dst),
                        op,
                        image: *image,
                        shape: shape(image_type)?,
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

    fn load_texel(&mut self, pointer: &Pointer) -> Result<Reg> {
        let Pointer::Texel {
            image,
            image_type,
            coordinate,
            sample,
        } = pointer
        else {
            return malformed("the pointer isn't to a texel");
        };
        let dst = self.builder.value(isa::ir::Type::B32);
        self.builder
            .statement(Statement::ImageRead(Box::new(ImageRead {
                dst: [Some(dst), None, None, None],
                image: *image,
                shape: shape(image_type)?,
                coordinate: coordinate.clone(),
                level: None,
                sample: image_type.multisampled.then_some(*sample),
            })));
        Ok(dst)
    }

    fn store_texel(&mut self, pointer: &Pointer, value: Reg) -> Result<()> {
        let Pointer::Texel {
            image,
            image_type,
            coordinate,
            sample,
        } = pointer
        else {
            return malformed("the pointer isn't to a texel");
        };
        self.note_binding_write(*image);
        let zero = self.u32(0);
        self.builder
            .statement(Statement::ImageWrite(Box::new(ImageWrite {
                image: *image,
                shape: shape(image_type)?,
                coordinate: coordinate.clone(),
                sample: image_type.multisampled.then_some(*sample),
                texel: [value, zero, zero, zero],
            })));
        Ok(())
    }
}

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
