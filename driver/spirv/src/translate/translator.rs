//! The state of a translation: the meanings of ids, and the program under construction.

use std::collections::HashMap;
use std::rc::Rc;

use isa::ir::{Binding, Reg, Space};
use isa::op::Op as Ir;
use spirv::{Decoration, FPFastMathMode, StorageClass};

use super::analysis::Analysis;
use super::emitter::Emitter;
use super::inputs_outputs::InputsOutputs;
use super::options::Options;
use super::promoted::PromotedVariables;
use super::value::{EXPLICIT, MemoryLayout, MemoryRef, Pointer, TIGHT, Value};
use super::vertex_places::VertexPlaces;
use crate::error::{Result, malformed, unsupported};
use crate::globals::Globals;
use crate::instruction::Instruction;
use crate::interface::Interface;
use crate::module::Module;
use crate::types::{Scalar, Type};

/// The translation of an entry point.
pub struct Translator<'a> {
    pub module: &'a Module,
    pub globals: &'a Globals,
    pub analysis: &'a Analysis,
    pub options: Options,
    pub emit: Emitter,
    pub io: InputsOutputs<'a>,
    pub promoted: PromotedVariables,
    pub interface: Interface,
    /// Floating-point types whose operations are not contracted unless their decorations allow it.
    pub never_contracted: Vec<Scalar>,
    pub next_resource_slot: u32,
    /// The place of the blocks in workgroup memory, once allocated.
    pub workgroup_block: Option<u32>,
    /// The places of vertices' values in workgroup memory.
    pub vertex_memory: VertexPlaces,
    pub values: HashMap<u32, Value>,
    /// Types of the ids in `values`.
    pub types: HashMap<u32, u32>,
}

impl Translator<'_> {
    /// The type of an id.
    pub fn type_of(&self, id: u32) -> Result<u32> {
        let globals = self.globals;
        let constant = || globals.constants.get(&id).map(|constant| constant.ty);
        let variable = || globals.variables.get(&id).map(|variable| variable.ty);
        let known = self.types.get(&id).copied();
        match known.or_else(constant).or_else(variable) {
            Some(ty) => Ok(ty),
            None => malformed(format!("%{id} has no type here")),
        }
    }

    /// The meaning of an id.
    pub fn value(&mut self, id: u32) -> Result<Value> {
        if let Some(value) = self.values.get(&id) {
            return Ok(value.clone());
        }
        if let Some(constant) = self.globals.constants.get(&id) {
            let scalars = self.globals.types.flatten(constant.ty)?;
            self.emit.charge_budget(scalars.len())?;
            let bits = constant.bits.clone();
            let regs: Rc<[Reg]> = scalars
                .iter()
                .zip(bits.iter())
                .map(|(scalar, bits)| self.emit.constant(scalar.register(), *bits))
                .collect();
            self.values.insert(id, Value::Regs(regs.clone()));
            self.types.insert(id, constant.ty);
            return Ok(Value::Regs(regs));
        }
        if let Some(ty) = self.globals.undefined.get(&id).copied() {
            self.types.insert(id, ty);
            return self.undefined(ty);
        }
        malformed(format!("%{id} isn't defined before its use"))
    }

    /// An undefined value of a type. Undefined images, samplers and pointers read as zero, and an array without a length
    /// has no elements.
    pub fn undefined(&mut self, ty: u32) -> Result<Value> {
        let index = self.emit.u32(0);
        let nowhere = Binding { slot: 0, count: 0, index: Some(index) };
        let types = &self.globals.types;
        Ok(match types.get(ty)? {
            Type::Image(image) => Value::Image(nowhere, *image),
            Type::Sampler => Value::Sampler(nowhere),
            Type::SampledImage { image } => match types.get(*image)? {
                Type::Image(image) => Value::SampledImage(nowhere, *image, nowhere),
                _ => return malformed("a sampled image of no image"),
            },
            Type::Pointer { pointee, .. } if types.is_opaque(ty) => Value::Pointer(
                Pointer::Memory(MemoryRef {
                    space: Space::Buffer(nowhere),
                    base: None,
                    offset: 0,
                    layout: TIGHT,
                    ty: *pointee,
                })
                .into(),
            ),
            Type::RuntimeArray { .. } => Value::Regs(Rc::default()),
            _ => {
                let scalars = types.flatten(ty)?;
                self.emit.charge_budget(scalars.len())?;
                let zeros = scalars.iter();
                Value::Regs(zeros.map(|it| self.emit.constant(it.register(), 0)).collect())
            }
        })
    }

    /// The registers of a value, or of a pointer if its storage class allows it.
    pub fn regs(&mut self, id: u32) -> Result<Rc<[Reg]>> {
        match self.value(id)? {
            Value::Regs(regs) => Ok(regs),
            Value::Pointer(pointer) => pointer_to_value(self, &pointer),
            _ => malformed(format!("%{id} isn't a value")),
        }
    }

    /// The registers of a pointer that is only compared, so that the layout of its target doesn't matter.
    pub fn pointer_regs(&mut self, id: u32) -> Result<Rc<[Reg]>> {
        match self.value(id)? {
            Value::Pointer(pointer) => place_to_value(self, &pointer),
            _ => self.regs(id),
        }
    }

    /// The register of a scalar.
    pub fn reg(&mut self, id: u32) -> Result<Reg> {
        match *self.regs(id)? {
            [reg] => Ok(reg),
            _ => malformed(format!("%{id} isn't a scalar")),
        }
    }

    /// The scalar type of a scalar or vector, and its registers.
    pub fn vector(&mut self, id: u32) -> Result<(Scalar, Rc<[Reg]>)> {
        let (scalar, _) = self.globals.types.vector(self.type_of(id)?)?;
        Ok((scalar, self.regs(id)?))
    }

    /// A constant 32-bit operand.
    pub fn literal(&self, id: u32) -> Result<u32> {
        match self.globals.constant_u32(id) {
            Some(value) => Ok(value),
            None => unsupported(format!("%{id} isn't a constant")),
        }
    }

    /// Sets the registers of an instruction's result, which must fit its type.
    pub fn define(&mut self, instruction: &Instruction, regs: Vec<Reg>) -> Result<()> {
        let (id, ty) = (instruction.result()?, instruction.ty()?);
        self.emit.charge_budget(regs.len())?;
        let scalars = self.globals.types.flatten(ty)?;
        let fits = scalars.len() == regs.len()
            && scalars.iter().zip(&regs).all(|(scalar, reg)| scalar.register() == self.emit.builder.type_of(*reg));
        if !fits {
            return malformed("the operands don't fit the result type");
        }
        self.define_as(instruction, Value::Regs(regs.into()))?;
        self.types.insert(id, ty);
        Ok(())
    }

    /// Sets the meaning of an instruction's result.
    pub fn define_as(&mut self, instruction: &Instruction, value: Value) -> Result<()> {
        let id = instruction.result()?;
        self.values.insert(id, value);
        self.types.insert(id, instruction.ty()?);
        Ok(())
    }

    /// The pointer to which an id refers.
    pub fn pointer(&mut self, id: u32) -> Result<Pointer> {
        match self.value(id)? {
            Value::Pointer(pointer) => Ok((*pointer).clone()),
            Value::Regs(regs) => {
                let ty = self.type_of(id)?;
                pointer_from_value(self, ty, &regs)
            }
            _ => malformed(format!("%{id} isn't a pointer")),
        }
    }

    /// Reports whether an instruction's product and sum may be fused: by its own decorations, or else by the entry
    /// point's default for its type.
    pub fn may_contract(&self, instruction: &Instruction) -> Result<bool> {
        let id = instruction.result()?;
        if self.module.has(id, Decoration::NoContraction) {
            return Ok(false);
        }
        if let Some(mode) = self.module.fast_math(id) {
            return Ok(mode.contains(FPFastMathMode::ALLOW_CONTRACT));
        }
        if self.never_contracted.is_empty() {
            return Ok(true);
        }
        let ty = instruction.ty()?;
        let types = &self.globals.types;
        let scalar = match types.matrix(ty) {
            Ok((_, _, _, scalar)) => scalar,
            Err(_) => types.vector(ty)?.0,
        };
        Ok(!self.never_contracted.contains(&scalar))
    }

    /// Creates a variable of a type that is held in registers. Returns its number.
    pub fn promote(&mut self, ty: u32, input: Option<u32>) -> Result<usize> {
        let scalars: Rc<[Scalar]> = self.globals.types.flatten(ty)?.into();
        self.emit.charge_budget(scalars.len())?;
        Ok(self.promoted.add(scalars, input))
    }
}

/// The registers of a pointer through which a value may be read.
fn pointer_to_value(t: &mut Translator, pointer: &Pointer) -> Result<Rc<[Reg]>> {
    if let Pointer::Memory(place) = pointer
        && place.space != Space::Global
    {
        check_layout(t, place)?;
    }
    place_to_value(t, pointer)
}

/// The registers that say where a pointer points.
fn place_to_value(t: &mut Translator, pointer: &Pointer) -> Result<Rc<[Reg]>> {
    let Pointer::Memory(place) = pointer else {
        return unsupported("this pointer as a value");
    };
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

/// The pointer that registers encode.
fn pointer_from_value(t: &mut Translator, ty: u32, regs: &[Reg]) -> Result<Pointer> {
    let (class, pointee) = t.globals.types.pointer(ty)?;
    let at =
        |space, base, layout| Pointer::Memory(MemoryRef { space, base: Some(base), offset: 0, layout, ty: pointee });
    match (class, regs) {
        (StorageClass::PhysicalStorageBuffer, [address]) => {
            t.interface.uses_addresses = true;
            Ok(at(Space::Global, *address, EXPLICIT))
        }
        (StorageClass::StorageBuffer, [slot, bytes]) => {
            let layout = pointee_layout(t, pointee, EXPLICIT)?;
            let one = t.emit.u32(1);
            let binding =
                Binding { slot: 0, count: t.next_resource_slot, index: Some(t.emit.op(Ir::ISub, &[*slot, one])) };
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

/// Refuses a variable pointer whose type doesn't determine the layout of its target.
fn check_layout(t: &Translator, memory: &MemoryRef) -> Result<()> {
    if memory.layout.component_stride.is_some() {
        return unsupported("a variable pointer into a matrix whose rows are in order");
    }
    pointee_layout(t, memory.ty, memory.layout).map(|_| ())
}

/// The layout of the target of a variable pointer, of which only the type is known: all members of a matrix type must
/// have the same layout.
fn pointee_layout(t: &Translator, pointee: u32, layout: MemoryLayout) -> Result<MemoryLayout> {
    let Some(matrix) = t.globals.types.matrix_in(pointee).filter(|_| layout.explicit) else {
        return Ok(layout);
    };
    match t.globals.types.matrix_layout(matrix) {
        Some(layout_of_all) => Ok(MemoryLayout { matrix: Some(layout_of_all), ..layout }),
        None => unsupported("a variable pointer to a matrix that has several layouts"),
    }
}

/// The 64-bit address of a place.
fn address(t: &mut Translator, memory: &MemoryRef) -> Result<Reg> {
    let Some(base) = memory.base else {
        return malformed("the pointer has no address");
    };
    if memory.offset == 0 {
        return Ok(base);
    }
    let offset = t.emit.u64(u64::from(memory.offset));
    Ok(t.emit.op(Ir::IAdd64, &[base, offset]))
}

/// The slot number of a descriptor, counted from 1; 0 if there is no such descriptor.
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

/// The number of bytes from the start of a place's memory to the place, plus `more`.
fn bytes_before(t: &mut Translator, memory: &MemoryRef, more: u32) -> Reg {
    let constant = t.emit.u32(memory.offset.saturating_add(more));
    match memory.base {
        Some(base) => t.emit.op(Ir::IAdd, &[base, constant]),
        None => constant,
    }
}

/// The blocks among the entry point's workgroup variables, by their types.
pub fn workgroup_blocks(t: &Translator) -> impl Iterator<Item = u32> {
    let used = t.analysis.used.iter();
    let variables = used.filter_map(|id| t.globals.variables.get(id));
    variables
        .filter(|it| it.class == StorageClass::Workgroup)
        .map(|it| it.pointee)
        .filter(|ty| t.module.has(*ty, Decoration::Block))
}

/// The layout of workgroup memory: explicit if an entry point's workgroup variables are blocks, because then all are.
pub fn workgroup_layout(t: &Translator) -> MemoryLayout {
    if workgroup_blocks(t).next().is_some() { EXPLICIT } else { TIGHT }
}
