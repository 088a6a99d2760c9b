//! Loads and stores.

use std::rc::Rc;

use isa::ir::{Format, Reg};
use isa::op::Op as Ir;
use spirv::{BuiltIn, Decoration, MemoryAccess};

use super::descriptors::mark_written;
use super::promoted::PromotedPart;
use super::translator::Translator;
use super::value::{MemoryLayout, MemoryRef, Pointer, Value, scalar_bytes, scalar_format};
use crate::error::{Result, malformed};
use crate::instruction::Instruction;
use crate::types::{Scalar, Type};

/// The most elements of one load or store of the IR.
const MAX_ELEMENTS: usize = 16;

/// Adjacent scalars: their first byte, format, and their indices in the value.
struct ContiguousAccess {
    offset: u32,
    format: Format,
    places: Vec<usize>,
}

/// Translates `OpLoad`.
pub fn load(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let pointer = t.pointer(instruction.id(0)?)?;
    if let Pointer::Resource { binding, ty, .. } = pointer {
        let value = match t.globals.types.get(ty)? {
            Type::Image(image) => Value::Image(binding, *image),
            Type::Sampler => Value::Sampler(binding),
            Type::SampledImage { image } => match t.globals.types.get(*image)? {
                Type::Image(image) => Value::SampledImage(binding, *image, binding),
                _ => return malformed("a sampled image of no image"),
            },
            _ => return malformed("an array of descriptors can't be loaded"),
        };
        return t.define_as(instruction, value);
    }
    if is_current_helper(t, instruction, &pointer) {
        let helper = t.emit.builder.is_helper();
        return t.define(instruction, vec![helper]);
    }
    let regs = load_from(t, &pointer)?;
    t.define(instruction, regs)
}

/// Reports whether a load is of `HelperInvocation` and volatile, by its operands or the variable's decoration: then it
/// reads whether the invocation is a helper now. Otherwise it reads what was so at the beginning.
fn is_current_helper(t: &Translator, instruction: &Instruction, pointer: &Pointer) -> bool {
    let Pointer::PromotedVariable { variable, .. } = pointer else {
        return false;
    };
    let Some(input) = t.promoted.variables[*variable].input else {
        return false;
    };
    let is_helper = t.module.built_in(input) == Some(BuiltIn::HelperInvocation);
    let access = instruction.enumerant(1, MemoryAccess::from_bits).unwrap_or(MemoryAccess::NONE);
    is_helper && (access.contains(MemoryAccess::VOLATILE) || t.module.has(input, Decoration::Volatile))
}

/// Translates `OpStore`.
pub fn store(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let pointer = t.pointer(instruction.id(0)?)?;
    let regs = t.regs(instruction.id(1)?)?;
    store_to(t, &pointer, &regs)
}

/// Translates `OpCopyMemory`.
pub fn copy_memory(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let (target, source) = (t.pointer(instruction.id(0)?)?, t.pointer(instruction.id(1)?)?);
    let regs = load_from(t, &source)?;
    store_to(t, &target, &regs)
}

/// Loads the value to which a pointer points.
pub fn load_from(t: &mut Translator, pointer: &Pointer) -> Result<Vec<Reg>> {
    match pointer {
        Pointer::PromotedVariable { variable, start, indices, ty } => {
            let count = t.globals.types.scalars(*ty)? as usize;
            let part = PromotedPart { variable: *variable, start: *start, indices };
            t.promoted.read(&mut t.emit, &mut t.io, part, count)
        }
        Pointer::Memory(place) => load_place(t, place),
        _ => malformed("this pointer can't be loaded from"),
    }
}

/// Stores a value to which a pointer points.
pub fn store_to(t: &mut Translator, pointer: &Pointer, regs: &[Reg]) -> Result<()> {
    match pointer {
        Pointer::PromotedVariable { variable, start, indices, ty } => {
            if regs.len() != t.globals.types.scalars(*ty)? as usize {
                return malformed("the object doesn't fit the pointer");
            }
            let part = PromotedPart { variable: *variable, start: *start, indices };
            t.promoted.write(&mut t.emit, &mut t.io, part, regs, None)
        }
        Pointer::Memory(place) => store_place(t, place, regs),
        _ => malformed("this pointer can't be stored to"),
    }
}

fn load_place(t: &mut Translator, memory: &MemoryRef) -> Result<Vec<Reg>> {
    let scalars: Rc<[Scalar]> = t.globals.types.flatten(memory.ty)?.into();
    t.emit.charge_budget(scalars.len())?;
    let mut loaded = vec![None; scalars.len()];
    for run in runs(t, memory, &scalars)? {
        let regs = t.emit.builder.load(memory.at(run.offset), run.format, run.places.len());
        for (reg, index) in regs.into_iter().zip(run.places) {
            loaded[index] = Some(loaded_scalar(t, scalars[index], memory.layout, reg));
        }
    }
    match loaded.into_iter().collect() {
        Some(regs) => Ok(regs),
        None => malformed("a part of the value has no place in memory"),
    }
}

fn store_place(t: &mut Translator, memory: &MemoryRef, regs: &[Reg]) -> Result<()> {
    let scalars: Rc<[Scalar]> = t.globals.types.flatten(memory.ty)?.into();
    if scalars.len() != regs.len() {
        return malformed("the object doesn't fit the pointer");
    }
    t.emit.charge_budget(scalars.len())?;
    mark_written(t, memory);
    for run in runs(t, memory, &scalars)? {
        let src: Vec<Reg> =
            run.places.iter().map(|index| stored_scalar(t, scalars[*index], memory.layout, regs[*index])).collect();
        t.emit.builder.store(memory.at(run.offset), run.format, &src);
    }
    Ok(())
}

/// The scalars of a value in memory, grouped into runs of adjacent ones.
fn runs(t: &Translator, memory: &MemoryRef, scalars: &[Scalar]) -> Result<Vec<ContiguousAccess>> {
    let mut offsets = Vec::with_capacity(scalars.len());
    add_offsets(t, memory.ty, memory.layout, 0, &mut offsets)?;
    if offsets.len() != scalars.len() {
        return malformed("the type has no layout");
    }
    let mut order: Vec<usize> = (0..offsets.len()).collect();
    order.sort_by_key(|index| offsets[*index]);
    let mut runs: Vec<ContiguousAccess> = Vec::new();
    for index in order {
        let format = scalar_format(scalars[index], memory.layout);
        let offset = offsets[index];
        match runs.last_mut() {
            Some(run)
                if run.format == format
                    && run.places.len() < MAX_ELEMENTS
                    && run.offset.checked_add(format.bytes() * run.places.len() as u32) == Some(offset) =>
            {
                run.places.push(index);
            }
            _ => runs.push(ContiguousAccess { offset, format, places: vec![index] }),
        }
    }
    Ok(runs)
}

/// The byte offsets of a type's scalars.
fn add_offsets(t: &Translator, ty: u32, layout: MemoryLayout, start: u32, into: &mut Vec<u32>) -> Result<()> {
    let types = &t.globals.types;
    let at = |index: u32, stride: u32| start.saturating_add(index.saturating_mul(stride));
    match types.get(ty)? {
        Type::Scalar(_) | Type::Pointer { .. } => into.push(start),
        Type::Vector { element, count } => {
            let (scalar, _) = types.vector(*element)?;
            let stride = layout.component_stride;
            let stride = stride.unwrap_or(scalar_bytes(scalar, layout));
            into.extend((0..*count).map(|index| at(index, stride)));
        }
        Type::Matrix { column, count } => {
            let (scalar, rows) = types.vector(*column)?;
            let bytes = scalar_bytes(scalar, layout);
            let (column_stride, component_stride) = match layout {
                MemoryLayout { explicit: false, .. } => (bytes * rows, None),
                MemoryLayout { matrix: Some((stride, true)), .. } => (bytes, Some(stride)),
                MemoryLayout { matrix: Some((stride, false)), .. } => (stride, None),
                _ => return malformed("the matrix has no stride"),
            };
            let layout = MemoryLayout { component_stride, ..layout };
            for index in 0..*count {
                add_offsets(t, *column, layout, at(index, column_stride), into)?;
            }
        }
        Type::Array { element, count, stride } => {
            let stride = if layout.explicit {
                match stride {
                    Some(stride) => *stride,
                    None => return malformed("the array has no stride"),
                }
            } else {
                u32::try_from(types.tight_size(*element)?).unwrap_or(u32::MAX)
            };
            for index in 0..*count {
                add_offsets(t, *element, layout, at(index, stride), into)?;
            }
        }
        Type::Struct(members) => {
            let mut natural = 0_u32;
            for member in members.iter() {
                let offset = if layout.explicit {
                    match member.offset {
                        Some(offset) => offset,
                        None => return malformed("a member has no offset"),
                    }
                } else {
                    natural
                };
                let inner =
                    MemoryLayout { matrix: member.matrix_stride.map(|stride| (stride, member.row_major)), ..layout };
                add_offsets(t, member.ty, inner, start.saturating_add(offset), into)?;
                let size = types.tight_size(member.ty).unwrap_or(0);
                natural = natural.saturating_add(u32::try_from(size).unwrap_or(u32::MAX));
            }
        }
        _ => return malformed("the type has no layout"),
    }
    Ok(())
}

/// Converts a loaded register to that of the scalar.
fn loaded_scalar(t: &mut Translator, scalar: Scalar, layout: MemoryLayout, loaded: Reg) -> Reg {
    match scalar {
        Scalar::Bool => {
            let zero = t.emit.u32(0);
            t.emit.op(Ir::INe, &[loaded, zero])
        }
        Scalar::Float { width: 16 } if layout.explicit => t.emit.op(Ir::F16ToF, &[loaded]),
        _ => loaded,
    }
}

/// Converts a scalar's register to the one that is stored.
fn stored_scalar(t: &mut Translator, scalar: Scalar, layout: MemoryLayout, reg: Reg) -> Reg {
    match scalar {
        Scalar::Bool => {
            let (one, zero) = (t.emit.u32(1), t.emit.u32(0));
            t.emit.op(Ir::Select, &[reg, one, zero])
        }
        Scalar::Float { width: 16 } if layout.explicit => t.emit.op(Ir::FToF16, &[reg]),
        _ => reg,
    }
}
