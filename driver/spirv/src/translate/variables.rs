//! An entry point's variables: their storage in registers or memory, their initializers, and the outputs at the end.

use isa::ir::{MAX_MEMORY_BYTES, Space};
use spirv::{BuiltIn, Decoration, StorageClass};

use super::descriptors::{descriptor, resource};
use super::inputs_outputs::{IoLocation, is_computed};
use super::memory::store_to;
use super::translator::{Translator, workgroup_blocks, workgroup_layout};
use super::value::{EXPLICIT, MemoryRef, Pointer, TIGHT, Value};
use crate::error::{Diagnostic, Error, Result, malformed, unsupported};
use crate::globals::GlobalVariable;
use crate::instruction::Instruction;
use crate::interface::Stage;
use crate::types::Type;

/// Reports whether variables of a storage class may be held in registers.
fn is_in_registers(class: StorageClass) -> bool {
    matches!(class, StorageClass::Function | StorageClass::Private | StorageClass::Input | StorageClass::Output)
}

/// Creates all variables outside functions that are used, with resource variables in order of set and binding.
pub fn global_variables(t: &mut Translator) -> Result<(), Error> {
    let mut used: Vec<u32> = t.analysis.used.iter().copied().collect();
    let number = |id, decoration| t.module.literal(id, decoration).unwrap_or(0);
    used.sort_unstable_by_key(|id| {
        let set = number(*id, Decoration::DescriptorSet);
        (set, number(*id, Decoration::Binding), *id)
    });
    for id in used {
        let made = match global_variable(t, id) {
            Ok(_) if t.globals.variables[&id].class == StorageClass::Input => compute_inputs(t, id),
            other => other.map(|_| ()),
        };
        if let Err(diagnostic) = made {
            let mut declarations = t.module.sections.globals.iter();
            return Err(match (declarations.find(|it| it.result_id == Some(id)), diagnostic) {
                (Some(declaration), diagnostic) => diagnostic.locate(declaration.reference()),
                (None, Diagnostic::Located(error)) => error,
                (None, Diagnostic::Malformed(reason) | Diagnostic::Unsupported(reason)) => Error::Binary { reason },
            });
        }
    }
    Ok(())
}

/// The pointer to a variable outside functions, which is created once.
fn global_variable(t: &mut Translator, id: u32) -> Result<Value> {
    if let Some(value) = t.values.get(&id) {
        return Ok(value.clone());
    }
    let Some(variable) = t.globals.variables.get(&id).copied() else {
        return malformed(format!("%{id} isn't a variable"));
    };
    let GlobalVariable { class, pointee, .. } = variable;
    let pointer = match class {
        StorageClass::Private if t.analysis.in_memory.contains(&id) => private_variable(t, id, pointee)?,
        StorageClass::Input | StorageClass::Output if let Some(place) = t.vertex_memory.place(id) => {
            Pointer::Memory(place)
        }
        _ if is_in_registers(class) => {
            let input = (class == StorageClass::Input).then_some(id);
            let variable = t.promote(pointee, input)?;
            t.promoted.bind(id, variable);
            Pointer::PromotedVariable { variable, start: 0, indices: Vec::new(), ty: pointee }
        }
        StorageClass::Workgroup => {
            let layout = workgroup_layout(t);
            let offset = if layout.explicit {
                workgroup_block(t)?
            } else {
                let bytes = tight_bytes(t, pointee)?;
                t.emit.builder.allocate_shared(bytes, 8)
            };
            Pointer::Memory(MemoryRef { space: Space::Shared, base: None, offset, layout, ty: pointee })
        }
        StorageClass::PushConstant => Pointer::Memory(MemoryRef {
            space: Space::PushConstants,
            base: None,
            offset: 0,
            layout: EXPLICIT,
            ty: pointee,
        }),
        StorageClass::Uniform | StorageClass::StorageBuffer | StorageClass::UniformConstant => {
            let binding = descriptor(t, id, variable)?;
            resource(t, binding, class, pointee)?
        }
        other => return unsupported(format!("a variable of storage class {other:?}")),
    };
    // Workgroup memory is zero at the beginning, which is the only initializer that it may have.
    if let Some(initializer) = variable.initializer
        && class != StorageClass::Workgroup
    {
        if let Some(target) = variable.initial_variable {
            global_variable(t, target)?;
        }
        let regs = t.regs(initializer)?;
        store_to(t, &pointer, &regs)?;
    }
    let value = Value::Pointer(pointer.into());
    t.values.insert(id, value.clone());
    Ok(value)
}

/// A variable in private memory. It is allocated once, however often its function is inlined.
fn private_variable(t: &mut Translator, id: u32, pointee: u32) -> Result<Pointer> {
    if let Some(Value::Pointer(pointer)) = t.values.get(&id)
        && let Pointer::Memory(_) = **pointer
    {
        return Ok((**pointer).clone());
    }
    let bytes = tight_bytes(t, pointee)?;
    let offset = t.emit.builder.allocate_private(bytes);
    Ok(Pointer::Memory(MemoryRef { space: Space::Private, base: None, offset, layout: TIGHT, ty: pointee }))
}

/// Translates `OpVariable` in a function.
pub fn local_variable(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let id = instruction.result()?;
    let (class, pointee) = t.globals.types.pointer(instruction.ty()?)?;
    if class != StorageClass::Function {
        return unsupported(format!("a variable of storage class {class:?} in a function"));
    }
    t.promoted.unbind(id);
    let pointer = if t.analysis.in_memory.contains(&id) {
        private_variable(t, id, pointee)?
    } else {
        let variable = t.promote(pointee, None)?;
        t.promoted.bind(id, variable);
        Pointer::PromotedVariable { variable, start: 0, indices: Vec::new(), ty: pointee }
    };
    if let Ok(initializer) = instruction.id(1) {
        let regs = t.regs(initializer)?;
        store_to(t, &pointer, &regs)?;
    }
    t.define_as(instruction, Value::Pointer(pointer.into()))
}

/// The place of the blocks in workgroup memory, which they all share.
fn workgroup_block(t: &mut Translator) -> Result<u32> {
    if let Some(offset) = t.workgroup_block {
        return Ok(offset);
    }
    let mut size = 0;
    for ty in workgroup_blocks(t) {
        size = size.max(t.globals.types.explicit_size(ty)?);
    }
    let offset = t.emit.builder.allocate_shared(memory_bytes(size)?, 8);
    t.workgroup_block = Some(offset);
    Ok(offset)
}

fn tight_bytes(t: &Translator, ty: u32) -> Result<u32> {
    memory_bytes(t.globals.types.tight_size(ty)?)
}

/// Checks a number of bytes of workgroup or private memory.
fn memory_bytes(size: u64) -> Result<u32> {
    match u32::try_from(size) {
        Ok(bytes) if bytes <= MAX_MEMORY_BYTES => Ok(bytes),
        _ => Err(Diagnostic::Located(Error::TooLarge {
            what: "bytes of workgroup or private memory",
            limit: MAX_MEMORY_BYTES.into(),
        })),
    }
}

/// Computes the scalars of an input that isn't a plain register. They are computed before anything else, so that they
/// are defined wherever they are read.
fn compute_inputs(t: &mut Translator, id: u32) -> Result<()> {
    let Some(variable) = t.promoted.find(id) else {
        return Ok(());
    };
    for (index, location) in t.io.locations(id)?.iter().enumerate() {
        let is_computed = match location {
            IoLocation::BuiltIn { built_in, .. } => is_computed(*built_in),
            IoLocation::Location { .. } => t.promoted.variables[variable].scalars[index].is_wide(),
        };
        if is_computed {
            let (emit, io) = (&mut t.emit, &mut t.io);
            t.promoted.read_scalar(emit, io, variable, index)?;
        }
    }
    Ok(())
}

/// Reports whether an entry point's interface, by its ids, has an input that differs between samples. Such an input
/// requires a run for each sample, even if no code reads it.
pub fn has_an_input_of_samples(t: &Translator, interface: &[u32]) -> bool {
    let is_of_sample = |built_in| matches!(built_in, Some(BuiltIn::SampleId | BuiltIn::SamplePosition));
    interface.iter().any(|id| {
        let Some(variable) = t.globals.variables.get(id) else {
            return false;
        };
        let members = match t.globals.types.get(variable.pointee) {
            Ok(Type::Struct(members)) => members.as_ref(),
            _ => &[],
        };
        variable.class == StorageClass::Input
            && (is_of_sample(t.module.built_in(*id))
                || t.module.has(*id, Decoration::Sample)
                || members.iter().any(|it| is_of_sample(it.built_in)))
    })
}

/// Assigns the stored values to the output variables.
pub fn assign_outputs(t: &mut Translator) -> Result<()> {
    if t.interface.stage == Stage::Geometry {
        return Ok(());
    }
    let mut outputs: Vec<u32> = t.analysis.used.iter().copied().collect();
    outputs.retain(|id| {
        let class = t.globals.variables.get(id).map(|it| it.class);
        class == Some(StorageClass::Output)
    });
    outputs.sort_unstable();
    for id in outputs {
        let Some(variable) = t.promoted.find(id) else {
            continue;
        };
        let locations = t.io.locations(id)?;
        for (index, location) in locations.iter().enumerate() {
            if !t.promoted.variables[variable].written[index] {
                continue;
            }
            let scalar = t.promoted.variables[variable].scalars[index];
            let (emit, io) = (&mut t.emit, &mut t.io);
            let reg = t.promoted.read_scalar(emit, io, variable, index)?;
            io.write_output(emit, *location, scalar, reg)?;
        }
    }
    Ok(())
}

/// Records the declared push constants in the interface.
pub fn declare_push_constants(t: &mut Translator) {
    for id in &t.analysis.used {
        let Some(variable) = t.globals.variables.get(id) else {
            continue;
        };
        if variable.class != StorageClass::PushConstant {
            continue;
        }
        let size = t.globals.types.explicit_size(variable.pointee);
        let begin = match t.globals.types.get(variable.pointee) {
            Ok(Type::Struct(members)) => members.iter().filter_map(|member| member.offset).min(),
            _ => None,
        };
        let end = u32::try_from(size.unwrap_or(u64::MAX)).unwrap_or(u32::MAX);
        t.interface.push_constants = Some(begin.unwrap_or(0).min(end)..end);
    }
}
