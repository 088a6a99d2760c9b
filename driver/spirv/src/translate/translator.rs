//! The state of a translation: ids and their meanings, and the program that grows.

use std::collections::HashMap;
use std::rc::Rc;

use isa::ir::{Reg, Space};
use isa::op::Op as Ir;
use spirv::{Decoration, StorageClass};

use super::analysis::Analysis;
use super::emitter::Emitter;
use super::inputs_outputs::InputsOutputs;
use super::options::Options;
use super::promoted::PromotedVariables;
use super::value::{EXPLICIT, MemoryRef, Pointer, Value};
use crate::error::{Result, malformed, unsupported};
use crate::globals::Globals;
use crate::instruction::Instruction;
use crate::interface::Interface;
use crate::module::Module;
use crate::types::Scalar;

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
    pub next_resource_slot: u32,
    pub values: HashMap<u32, Value>,
    /// Types of the ids in `values`.
    pub types: HashMap<u32, u32>,
}

impl Translator<'_> {
    /// The type of an id.
    pub fn type_of(&self, id: u32) -> Result<u32> {
        let constant = || self.globals.constants.get(&id).map(|constant| constant.ty);
        match self.types.get(&id).copied().or_else(constant) {
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
        malformed(format!("%{id} isn't defined before its use"))
    }

    /// The registers of a value; a device address counts as one.
    pub fn regs(&mut self, id: u32) -> Result<Rc<[Reg]>> {
        match self.value(id)? {
            Value::Regs(regs) => Ok(regs),
            Value::Pointer(pointer) => match pointer.address() {
                Some(address) => {
                    let address = self.pointer_to_address(address)?;
                    Ok([address].into())
                }
                None => unsupported(format!("pointer %{id} as a value")),
            },
            _ => malformed(format!("%{id} isn't a value")),
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

    /// Gives an instruction's result its registers, which must fit its type.
    pub fn define(&mut self, it: &Instruction, regs: Vec<Reg>) -> Result<()> {
        let (id, ty) = (it.result()?, it.ty()?);
        self.emit.charge_budget(regs.len())?;
        let scalars = self.globals.types.flatten(ty)?;
        let fits = scalars.len() == regs.len()
            && scalars
                .iter()
                .zip(&regs)
                .all(|(scalar, reg)| scalar.register() == self.emit.builder.type_of(*reg));
        if !fits {
            return malformed("the operands don't fit the result type");
        }
        self.define_as(it, Value::Regs(regs.into()))?;
        self.types.insert(id, ty);
        Ok(())
    }

    /// Gives an instruction's result a meaning.
    pub fn define_as(&mut self, it: &Instruction, value: Value) -> Result<()> {
        let id = it.result()?;
        self.values.insert(id, value);
        self.types.insert(id, it.ty()?);
        Ok(())
    }

    /// The pointer that an id stands for.
    pub fn pointer(&mut self, id: u32) -> Result<Pointer> {
        match self.value(id)? {
            Value::Pointer(pointer) => Ok((*pointer).clone()),
            Value::Regs(regs) => {
                let (class, pointee) = self.globals.types.pointer(self.type_of(id)?)?;
                match (class, &*regs) {
                    (StorageClass::PhysicalStorageBuffer, [address]) => {
                        self.interface.uses_addresses = true;
                        Ok(Pointer::Memory(MemoryRef {
                            space: Space::Global,
                            base: Some(*address),
                            offset: 0,
                            layout: EXPLICIT,
                            ty: pointee,
                        }))
                    }
                    _ => unsupported(format!("%{id} as a pointer")),
                }
            }
            _ => malformed(format!("%{id} isn't a pointer")),
        }
    }

    /// The 64-bit address of a place.
    pub fn pointer_to_address(&mut self, place: &MemoryRef) -> Result<Reg> {
        let Some(base) = place.base else {
            return malformed("the pointer has no address");
        };
        if place.offset == 0 {
            return Ok(base);
        }
        let offset = self.emit.u64(u64::from(place.offset));
        Ok(self.emit.op(Ir::IAdd64, &[base, offset]))
    }

    /// Tells if an instruction's product and a sum may be fused.
    pub fn may_contract(&self, it: &Instruction) -> bool {
        let id = it.result_id.unwrap_or(0);
        !self.module.has(id, Decoration::NoContraction)
    }

    /// Makes a variable of a type that is held in registers; returns its number.
    pub fn promote(&mut self, ty: u32, input: Option<u32>) -> Result<usize> {
        let scalars: Rc<[Scalar]> = self.globals.types.flatten(ty)?.into();
        self.emit.charge_budget(scalars.len())?;
        Ok(self.promoted.add(scalars, input))
    }
}
