//! Variables that are held in registers.

use std::rc::Rc;

use isa::ir::Reg;
use isa::op::Op as Ir;
use spirv::StorageClass;

use super::super::error::{Result, malformed};
use super::super::types::Scalar;
use super::Translator;
use super::access::DynamicIndex;

/// A variable: the registers that hold it where the translation is now.
#[derive(Clone, Debug)]
pub struct PromotedVariable {
    pub scalars: Rc<[Scalar]>,
    /// None where nothing was stored yet.
    pub now: Vec<Option<Reg>>,
    /// Inputs: the variable, to find out where a scalar comes from.
    pub input: Option<u32>,
    /// Whether each scalar was ever stored to.
    pub written: Vec<bool>,
}

impl Translator<'_> {
    /// Makes a variable of a type.
    pub fn new_slot(&mut self, ty: u32, input: Option<u32>) -> Result<usize> {
        let scalars: Rc<[Scalar]> = self.globals.types.flatten(ty)?.into();
        self.charge_budget(scalars.len())?;
        self.slots.push(PromotedVariable {
            now: vec![None; scalars.len()],
            written: vec![false; scalars.len()],
            scalars,
            input,
        });
        Ok(self.slots.len() - 1)
    }

    /// The register that holds a scalar of a variable. Zero if nothing was ever stored.
    pub fn read_scalar(&mut self, slot: usize, index: usize) -> Result<Reg> {
        let found = &self.slots[slot];
        let Some(scalar) = found.scalars.get(index).copied() else {
            return malformed("an access beyond the end of a variable");
        };
        if let Some(reg) = found.now[index] {
            return Ok(reg);
        }
        let reg = match found.input {
            Some(variable) => self.input_scalar(variable, index, scalar)?,
            None => self.constant(scalar.register(), 0),
        };
        self.slots[slot].now[index] = Some(reg);
        Ok(reg)
    }

    fn write_scalar(&mut self, slot: usize, index: usize, reg: Reg) -> Result<()> {
        let found = &mut self.slots[slot];
        match found.scalars.get(index) {
            Some(scalar) if scalar.register() == self.builder.type_of(reg) => {
                found.now[index] = Some(reg);
                found.written[index] = true;
                Ok(())
            }
            _ => malformed("the object doesn't fit the variable"),
        }
    }

    /// Reads scalars from `start`, moved by the steps that are known at run time only.
    pub fn read_slot(
        &mut self,
        slot: usize,
        start: usize,
        steps: &[DynamicIndex],
        count: usize,
    ) -> Result<Vec<Reg>> {
        self.charge_budget(count)?;
        let Some((step, rest)) = steps.split_first() else {
            return (start..start + count)
                .map(|index| self.read_scalar(slot, index))
                .collect();
        };
        // An index out of range reads the first element.
        let mut result = self.read_slot(slot, start, rest, count)?;
        for element in 1..step.count {
            let at = start + (element * step.scalars) as usize;
            let candidate = self.read_slot(slot, at, rest, count)?;
            let this = self.index_is(step.index, element);
            for (result, candidate) in result.iter_mut().zip(candidate) {
                *result = self.select(this, candidate, *result);
            }
        }
        Ok(result)
    }

    /// Writes scalars from `start`, moved by steps, where `condition` holds if there is one.
    pub fn write_slot(
        &mut self,
        slot: usize,
        start: usize,
        steps: &[DynamicIndex],
        regs: &[Reg],
        condition: Option<Reg>,
    ) -> Result<()> {
        self.charge_budget(regs.len())?;
        let Some((step, rest)) = steps.split_first() else {
            for (offset, new) in regs.iter().enumerate() {
                let reg = match condition {
                    Some(condition) => {
                        let old = self.read_scalar(slot, start + offset)?;
                        if self.builder.type_of(old) != self.builder.type_of(*new) {
                            return malformed("the object doesn't fit the variable");
                        }
                        self.select(condition, *new, old)
                    }
                    None => *new,
                };
                self.write_scalar(slot, start + offset, reg)?;
            }
            return Ok(());
        };
        for element in 0..step.count {
            let this = self.index_is(step.index, element);
            let both = match condition {
                Some(condition) => self.op(Ir::BAnd, &[condition, this]),
                None => this,
            };
            let at = start + (element * step.scalars) as usize;
            self.write_slot(slot, at, rest, regs, Some(both))?;
        }
        Ok(())
    }

    fn index_is(&mut self, index: Reg, element: u32) -> Reg {
        let element = self.u32(element);
        self.op(Ir::IEq, &[index, element])
    }

    /// `if condition { a } else { b }` on registers of one type.
    pub fn select(&mut self, condition: Reg, a: Reg, b: Reg) -> Reg {
        use isa::ir::Type;
        if a == b {
            return a;
        }
        let op = match self.builder.type_of(a) {
            Type::Bool => Ir::BSelect,
            Type::B32 => Ir::Select,
            Type::B64 => Ir::Select64,
        };
        self.op(op, &[condition, a, b])
    }

    /// What an id of a variable or parameter stands for, if it is held in registers.
    pub fn slot_of_root(&self, root: u32) -> Option<usize> {
        self.slot_of.get(&root).copied()
    }

    /// The slot of a variable outside functions.
    pub fn is_in_registers(class: StorageClass) -> bool {
        matches!(
            class,
            StorageClass::Function
                | StorageClass::Private
                | StorageClass::Input
                | StorageClass::Output
        )
    }
}
