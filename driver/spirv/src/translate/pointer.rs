//! Pointers and access chains.

use isa::ir::{Binding, Reg, Space};
use isa::op::Op as Ir;
use spirv::Op;

use super::descriptors::{descriptor_count, descriptors, resource};
use super::pointer_value::element_stride;
use super::translator::Translator;
use super::value::{DynamicIndex, MemoryLayout, MemoryRef, Pointer, Value, scalar_bytes};
use crate::error::{Result, malformed, unsupported};
use crate::instruction::Instruction;
use crate::types::{Scalar, Type};

/// An index of an access chain.
#[derive(Clone, Copy)]
enum Index {
    Constant(u32),
    Dynamic { reg: Reg, scalar: Scalar },
}

/// Translates `OpAccessChain` and its variants.
pub fn access_chain(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let by_element = matches!(instruction.opcode, Op::PtrAccessChain | Op::InBoundsPtrAccessChain);
    let mut pointer = t.pointer(instruction.id(0)?)?;
    if by_element {
        let element = index(t, instruction.id(1)?)?;
        pointer = next_element(t, pointer, t.type_of(instruction.id(0)?)?, element)?;
    }
    for id in instruction.ids(1 + usize::from(by_element)) {
        let index = index(t, id)?;
        pointer = pointer_to_part(t, pointer, index)?;
    }
    t.define_as(instruction, Value::Pointer(pointer.into()))
}

fn index(t: &mut Translator, id: u32) -> Result<Index> {
    if let Some(index) = t.globals.constant_u32(id) {
        return Ok(Index::Constant(index));
    }
    let (scalar, regs) = t.vector(id)?;
    match (scalar, &*regs) {
        (Scalar::Int { width: 64, .. }, [reg]) => {
            Ok(Index::Dynamic { reg: t.emit.op(Ir::Low32, &[*reg]), scalar: Scalar::Int { width: 32, signed: true } })
        }
        (Scalar::Int { .. }, [reg]) => Ok(Index::Dynamic { reg: *reg, scalar }),
        _ => malformed(format!("index %{id} isn't an integer")),
    }
}

/// A pointer moved by a number of elements of the array into which it points.
fn next_element(t: &mut Translator, pointer: Pointer, ty: u32, element: Index) -> Result<Pointer> {
    let Pointer::Memory(place) = pointer else {
        return unsupported("pointer arithmetic on this pointer");
    };
    let stride = element_stride(t, ty)?;
    Ok(Pointer::Memory(moved(t, place, element, stride)?))
}

fn pointer_to_part(t: &mut Translator, pointer: Pointer, index: Index) -> Result<Pointer> {
    match pointer {
        Pointer::PromotedVariable { variable, start, mut indices, ty } => {
            let (part, start) = match index {
                Index::Constant(index) if has_part(t, ty, index) => {
                    let (part, before) = t.globals.types.part(ty, index)?;
                    (part, start + before as usize)
                }
                // An index past the end may be in code that never runs.
                _ => {
                    let index = match index {
                        Index::Constant(index) => t.emit.u32(index),
                        Index::Dynamic { reg, .. } => reg,
                    };
                    let (part, count) = elements(t, ty)?;
                    let scalars = t.globals.types.scalars(part)?;
                    indices.push(DynamicIndex { index, count, scalars });
                    (part, start)
                }
            };
            Ok(Pointer::PromotedVariable { variable, start, indices, ty: part })
        }
        Pointer::Memory(place) => Ok(Pointer::Memory(place_of_part(t, place, index)?)),
        Pointer::Resource { binding, class, ty } => {
            let (element, _) = descriptors(t, ty)?;
            let each = descriptor_count(t, element)?;
            let binding = pick_descriptor(t, binding, index, each)?;
            resource(t, binding, class, element)
        }
        Pointer::Texel { .. } => malformed("a texel has no parts"),
    }
}

/// Reports whether a constant index is within a composite type. A member of a struct always is, unless the module is
/// malformed.
fn has_part(t: &Translator, ty: u32, index: u32) -> bool {
    elements(t, ty).map_or(true, |(_, count)| index < count)
}

/// The element type and the length of a type that can be indexed at run time.
fn elements(t: &Translator, ty: u32) -> Result<(u32, u32)> {
    match t.globals.types.get(ty)? {
        Type::Vector { element, count }
        | Type::Matrix { column: element, count }
        | Type::Array { element, count, .. } => Ok((*element, *count)),
        _ => malformed("an index that isn't constant into what isn't an array"),
    }
}

fn place_of_part(t: &mut Translator, mut memory: MemoryRef, index: Index) -> Result<MemoryRef> {
    let types = &t.globals.types;
    match types.get(memory.ty)? {
        Type::Struct(members) => {
            let Index::Constant(number) = index else {
                return malformed("the index of a member isn't a constant");
            };
            let Some(member) = members.get(number as usize) else {
                return malformed(format!("there is no member {number}"));
            };
            let offset = if memory.layout.explicit {
                memory.layout.matrix = member.matrix_stride.map(|stride| (stride, member.row_major));
                match member.offset {
                    Some(offset) => offset,
                    None => return malformed(format!("member {number} has no offset")),
                }
            } else {
                let mut before = 0_u64;
                for earlier in &members[..number as usize] {
                    before += types.tight_size(earlier.ty)?;
                }
                u32::try_from(before).unwrap_or(u32::MAX)
            };
            memory.offset = memory.offset.saturating_add(offset);
            memory.ty = member.ty;
            Ok(memory)
        }
        Type::Array { element, stride, .. } | Type::RuntimeArray { element, stride } => {
            let (element, stride) = (*element, *stride);
            let stride = if memory.layout.explicit {
                match stride {
                    Some(stride) => stride,
                    None => return malformed("the array has no stride"),
                }
            } else {
                u32::try_from(types.tight_size(element)?).unwrap_or(u32::MAX)
            };
            memory.ty = element;
            moved(t, memory, index, stride)
        }
        Type::Matrix { column, .. } => {
            let column = *column;
            let (scalar, rows) = types.vector(column)?;
            memory.ty = column;
            let bytes = scalar_bytes(scalar, memory.layout);
            let stride = match memory.layout {
                MemoryLayout { explicit: false, .. } => bytes * rows,
                MemoryLayout { matrix: Some((stride, row_major)), .. } => {
                    memory.layout.component_stride = row_major.then_some(stride);
                    if row_major { bytes } else { stride }
                }
                _ => return malformed("the matrix has no stride"),
            };
            moved(t, memory, index, stride)
        }
        Type::Vector { element, .. } => {
            let element = *element;
            let (scalar, _) = types.vector(element)?;
            memory.ty = element;
            let stride = memory.layout.component_stride;
            let stride = stride.unwrap_or(scalar_bytes(scalar, memory.layout));
            moved(t, memory, index, stride)
        }
        _ => malformed("an index into what has no parts"),
    }
}

/// A place moved by `index * stride` bytes.
fn moved(t: &mut Translator, mut memory: MemoryRef, index: Index, stride: u32) -> Result<MemoryRef> {
    match index {
        Index::Constant(index) => {
            let bytes = i64::from(index.cast_signed()) * i64::from(stride);
            let bytes = bytes.saturating_add(i64::from(memory.offset));
            match (u32::try_from(bytes), memory.base) {
                (Ok(bytes), _) => memory.offset = bytes,
                (Err(_), Some(base)) if memory.space == Space::Global => {
                    let bytes = t.emit.u64(bytes.cast_unsigned());
                    memory.base = Some(t.emit.op(Ir::IAdd64, &[base, bytes]));
                    memory.offset = 0;
                }
                // Back from what the base points to. The sum wraps around.
                (Err(_), Some(base)) if i32::try_from(bytes).is_ok() => {
                    let bytes = t.emit.u32((bytes as i32).cast_unsigned());
                    memory.base = Some(t.emit.op(Ir::IAdd, &[base, bytes]));
                    memory.offset = 0;
                }
                // Beyond all memory.
                _ => memory.offset = u32::MAX,
            }
        }
        Index::Dynamic { reg, scalar } if memory.space == Space::Global => {
            let signed = matches!(scalar, Scalar::Int { signed: true, .. });
            let widen = if signed { Ir::SToS64 } else { Ir::UToU64 };
            let wide = t.emit.op(widen, &[reg]);
            let stride = t.emit.u64(u64::from(stride));
            let bytes = t.emit.op(Ir::IMul64, &[wide, stride]);
            let base = memory.base.unwrap_or(bytes);
            memory.base = Some(t.emit.op(Ir::IAdd64, &[base, bytes]));
        }
        Index::Dynamic { reg, .. } => {
            let stride = t.emit.u32(stride);
            let bytes = t.emit.op(Ir::IMul, &[reg, stride]);
            memory.base = Some(match memory.base {
                Some(base) => t.emit.op(Ir::IAdd, &[base, bytes]),
                None => bytes,
            });
        }
    }
    Ok(memory)
}

/// Selects one element, of `each` descriptors, of an array of descriptors.
fn pick_descriptor(t: &mut Translator, array: Binding, index: Index, each: u32) -> Result<Binding> {
    let index = match index {
        Index::Constant(index) if array.index.is_none() => {
            let first = u64::from(index) * u64::from(each);
            if first + u64::from(each) > u64::from(array.count) {
                return malformed("the index is beyond the end of the array of descriptors");
            }
            return Ok(Binding { slot: array.slot + first as u32, count: each, index: None });
        }
        Index::Constant(index) => t.emit.u32(index),
        Index::Dynamic { reg, .. } => reg,
    };
    let each = t.emit.u32(each);
    let mut element = t.emit.op(Ir::IMul, &[index, each]);
    if let Some(outer) = array.index {
        element = t.emit.op(Ir::IAdd, &[outer, element]);
    }
    Ok(Binding { index: Some(element), ..array })
}

/// Translates `OpArrayLength`.
pub fn array_length(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let pointer = t.pointer(instruction.id(0)?)?;
    let member = instruction.number(1)?;
    let Pointer::Memory(MemoryRef { space: Space::Buffer(buffer), offset: before, base, ty, .. }) = pointer else {
        return malformed("the operand isn't a pointer to a buffer");
    };
    let (array, _) = t.globals.types.part(ty, member)?;
    let (Type::RuntimeArray { stride: Some(stride), .. }, Type::Struct(members)) =
        (t.globals.types.get(array)?, t.globals.types.get(ty)?)
    else {
        return malformed("the member isn't an array with a stride");
    };
    let offset = members[member as usize].offset.unwrap_or(0);
    let size = t.emit.builder.buffer_size(buffer);
    let offset = t.emit.u32(offset.saturating_add(before));
    let stride = t.emit.u32((*stride).max(1));
    let offset = match base {
        Some(base) => t.emit.op(Ir::IAdd, &[base, offset]),
        None => offset,
    };
    let end = t.emit.op(Ir::UMax, &[size, offset]);
    let bytes = t.emit.op(Ir::ISub, &[end, offset]);
    let length = t.emit.op(Ir::UDiv, &[bytes, stride]);
    t.define(instruction, vec![length])
}
