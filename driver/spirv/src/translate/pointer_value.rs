//! Comparison and subtraction of pointers.

use isa::ir::Reg;
use isa::op::Op as Ir;
use spirv::{Decoration, Op, StorageClass};

use super::translator::{Translator, workgroup_layout};
use crate::error::{Result, malformed, unsupported};
use crate::instruction::Instruction;

/// Translates `OpPtrEqual`, `OpPtrNotEqual` and `OpPtrDiff`.
pub fn compare_pointers(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let (a, b) = (t.pointer_regs(instruction.id(0)?)?, t.pointer_regs(instruction.id(1)?)?);
    if a.len() != b.len() {
        return malformed("the pointers are of different storage classes");
    }
    if instruction.opcode == Op::PtrDiff {
        return pointer_difference(t, instruction, &a, &b);
    }
    let mut equal = None;
    for (a, b) in a.iter().zip(b.iter()) {
        let op = match t.emit.builder.type_of(*a) {
            isa::ir::Type::B64 => Ir::IEq64,
            _ => Ir::IEq,
        };
        let same = t.emit.op(op, &[*a, *b]);
        equal = Some(match equal {
            Some(equal) => t.emit.op(Ir::BAnd, &[equal, same]),
            None => same,
        });
    }
    let Some(equal) = equal else {
        return malformed("the pointers have no values");
    };
    let result = if instruction.opcode == Op::PtrEqual { equal } else { t.emit.op(Ir::BNot, &[equal]) };
    t.define(instruction, vec![result])
}

/// The number of elements from one pointer to another into the same array.
fn pointer_difference(t: &mut Translator, instruction: &Instruction, a: &[Reg], b: &[Reg]) -> Result<()> {
    let ty = t.type_of(instruction.id(0)?)?;
    let stride = element_stride(t, ty)?;
    let (result, _) = t.globals.types.vector(instruction.ty()?)?;
    let elements = match (a, b) {
        ([.., a], [.., b]) if t.emit.builder.type_of(*a) == isa::ir::Type::B32 => {
            let bytes = t.emit.op(Ir::ISub, &[*a, *b]);
            let stride = t.emit.u32(stride);
            t.emit.op(Ir::SDiv, &[bytes, stride])
        }
        _ => return unsupported("the difference of these pointers"),
    };
    let elements =
        if result.is_wide() { t.emit.op(Ir::SToS64, &[elements]) } else { t.emit.wrap_to_width(result, elements) };
    t.define(instruction, vec![elements])
}

/// The bytes between elements of the array into which a pointer of a type points; never zero.
pub fn element_stride(t: &Translator, ty: u32) -> Result<u32> {
    let (class, pointee) = t.globals.types.pointer(ty)?;
    if class == StorageClass::Workgroup && !workgroup_layout(t).explicit {
        let bytes = t.globals.types.tight_size(pointee)?;
        return Ok(u32::try_from(bytes).unwrap_or(u32::MAX).max(1));
    }
    // A pointer whose type has no stride points into an array whose type has one.
    let stride = t.module.literal(ty, Decoration::ArrayStride);
    match stride.or_else(|| t.globals.types.stride_of_arrays(pointee)) {
        Some(stride) => Ok(stride.max(1)),
        None => malformed("the pointer's type has no stride"),
    }
}
