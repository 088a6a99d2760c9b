//! Pointers as values: device addresses, and variable pointers into storage buffers and workgroup memory.
//!
//! The registers that stand for a pointer are those of [`pointer_scalars`](crate::types::pointer_scalars). A pointer that
//! isn't chosen at run time stays what it is and takes no registers.

use std::rc::Rc;

use isa::ir::{Binding, Reg, Space};
use isa::op::Op as Ir;
use spirv::{Decoration, Op, StorageClass};

use super::translator::Translator;
use super::value::{EXPLICIT, MemoryLayout, MemoryRef, Pointer};
use super::variables::workgroup_layout;
use crate::error::{Result, malformed, unsupported};
use crate::instruction::Instruction;

/// The registers of a pointer.
pub fn pointer_to_value(t: &mut Translator, pointer: &Pointer) -> Result<Rc<[Reg]>> {
    let Pointer::Memory(place) = pointer else {
        return unsupported("this pointer as a value");
    };
    if place.space != Space::Global {
        check_layout(t, place)?;
    }
    match place.space {
        Space::Global => Ok([address(t, place)?].into()),
        Space::Buffer(binding) => {
            let slot = slot_number(t, binding);
            Ok([slot, bytes_before(t, place, 0)].into())
        }
        Space::Shared => Ok([bytes_before(t, place, 1)].into()),
        Space::PushConstants | Space::Private => unsupported("this pointer as a value"),
    }
}

/// The pointer that registers stand for.
pub fn pointer_from_value(t: &mut Translator, ty: u32, regs: &[Reg]) -> Result<Pointer> {
    let (class, pointee) = t.globals.types.pointer(ty)?;
    let at = |space, base, layout| {
        Pointer::Memory(MemoryRef {
            space,
            base: Some(base),
            offset: 0,
            layout,
            ty: pointee,
        })
    };
    match (class, regs) {
        (StorageClass::PhysicalStorageBuffer, [address]) => {
            t.interface.uses_addresses = true;
            Ok(at(Space::Global, *address, EXPLICIT))
        }
        (StorageClass::StorageBuffer, [slot, bytes]) => {
            let layout = pointee_layout(t, pointee, EXPLICIT)?;
            let one = t.emit.u32(1);
            let binding = Binding {
                slot: 0,
                count: t.next_resource_slot,
                index: Some(t.emit.op(Ir::ISub, &[*slot, one])),
            };
            Ok(at(Space::Buffer(binding), *bytes, layout))
        }
        (StorageClass::Workgroup, [bytes]) => {
            let layout = pointee_layout(t, pointee, workgroup_layout(t))?;
            let one = t.emit.u32(1);
            let base = t.emit.op(Ir::ISub, &[*bytes, one]);
            Ok(at(Space::Shared, base, layout))
        }
        _ => unsupported("this value as a pointer"),
    }
}

/// Refuses a pointer whose type doesn't say how what it points to lies in memory.
fn check_layout(t: &Translator, place: &MemoryRef) -> Result<()> {
    if place.layout.component_stride.is_some() {
        return unsupported("a variable pointer into a matrix whose rows are in order");
    }
    pointee_layout(t, place.ty, place.layout).map(|_| ())
}

/// The layout of what a variable pointer leads to. Only its type is known then: of a matrix, all members of its type must
/// have one layout.
fn pointee_layout(t: &Translator, pointee: u32, layout: MemoryLayout) -> Result<MemoryLayout> {
    let Some(matrix) = t
        .globals
        .types
        .matrix_in(pointee)
        .filter(|_| layout.explicit)
    else {
        return Ok(layout);
    };
    match t.globals.types.matrix_layout(matrix) {
        Some(layout_of_all) => Ok(MemoryLayout {
            matrix: Some(layout_of_all),
            ..layout
        }),
        None => unsupported("a variable pointer to a matrix that has several layouts"),
    }
}

/// The 64-bit address of a place.
fn address(t: &mut Translator, place: &MemoryRef) -> Result<Reg> {
    let Some(base) = place.base else {
        return malformed("the pointer has no address");
    };
    if place.offset == 0 {
        return Ok(base);
    }
    let offset = t.emit.u64(u64::from(place.offset));
    Ok(t.emit.op(Ir::IAdd64, &[base, offset]))
}

/// The number of a descriptor's slot, counted from 1; 0 if there is no such descriptor.
fn slot_number(t: &mut Translator, binding: Binding) -> Reg {
    let first = t.emit.u32(binding.slot + 1);
    match binding.index {
        None => first,
        Some(index) => {
            let (count, zero) = (t.emit.u32(binding.count), t.emit.u32(0));
            let within = t.emit.op(Ir::ULt, &[index, count]);
            let slot = t.emit.op(Ir::IAdd, &[first, index]);
            t.emit.select(within, slot, zero)
        }
    }
}

/// Bytes from the start of a place's memory, and some more.
fn bytes_before(t: &mut Translator, place: &MemoryRef, more: u32) -> Reg {
    let constant = t.emit.u32(place.offset.saturating_add(more));
    match place.base {
        Some(base) => t.emit.op(Ir::IAdd, &[base, constant]),
        None => constant,
    }
}

/// `OpPtrEqual`, `OpPtrNotEqual` and `OpPtrDiff`.
pub fn compare_pointers(t: &mut Translator, it: &Instruction) -> Result<()> {
    let (a, b) = (t.regs(it.id(0)?)?, t.regs(it.id(1)?)?);
    if a.len() != b.len() {
        return malformed("the pointers are of different storage classes");
    }
    if it.opcode == Op::PtrDiff {
        return pointer_difference(t, it, &a, &b);
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
    let result = if it.opcode == Op::PtrEqual {
        equal
    } else {
        t.emit.op(Ir::BNot, &[equal])
    };
    t.define(it, vec![result])
}

/// Elements from one pointer to another into the same array.
fn pointer_difference(t: &mut Translator, it: &Instruction, a: &[Reg], b: &[Reg]) -> Result<()> {
    let ty = t.type_of(it.id(0)?)?;
    let stride = element_stride(t, ty)?;
    let (result, _) = t.globals.types.vector(it.ty()?)?;
    let elements = match (a, b) {
        ([.., a], [.., b]) if t.emit.builder.type_of(*a) == isa::ir::Type::B32 => {
            let bytes = t.emit.op(Ir::ISub, &[*a, *b]);
            let stride = t.emit.u32(stride);
            t.emit.op(Ir::SDiv, &[bytes, stride])
        }
        _ => return unsupported("the difference of these pointers"),
    };
    let elements = if result.is_wide() {
        t.emit.op(Ir::SToS64, &[elements])
    } else {
        t.emit.wrap_to_width(result, elements)
    };
    t.define(it, vec![elements])
}

/// Bytes from one element to the next of the array that a pointer of a type leads into; never zero.
pub fn element_stride(t: &Translator, ty: u32) -> Result<u32> {
    let (class, pointee) = t.globals.types.pointer(ty)?;
    if class == StorageClass::Workgroup && !workgroup_layout(t).explicit {
        let bytes = t.globals.types.tight_size(pointee)?;
        return Ok(u32::try_from(bytes).unwrap_or(u32::MAX).max(1));
    }
    match t.module.literal(ty, Decoration::ArrayStride) {
        Some(stride) => Ok(stride.max(1)),
        None => malformed("the pointer's type has no stride"),
    }
}
