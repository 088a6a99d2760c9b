//! Variables held in registers.

use std::collections::HashMap;
use std::rc::Rc;

use isa::ir::Reg;
use isa::op::Op as Ir;

use super::emitter::Emitter;
use super::inputs_outputs::InputsOutputs;
use super::value::DynamicIndex;
use crate::error::{Result, malformed};
use crate::types::Scalar;

/// A variable, with the registers that hold it at the current place of the translation.
#[derive(Clone, Debug)]
pub struct PromotedVariable {
    pub scalars: Rc<[Scalar]>,
    /// The current registers; None for a scalar that has not been stored to.
    pub now: Vec<Option<Reg>>,
    /// For an input, the id of the variable, which gives the source of a scalar.
    pub input: Option<u32>,
    /// True for scalars that were stored to.
    pub written: Vec<bool>,
}

/// A part of a variable.
#[derive(Clone, Copy, Debug)]
pub struct PromotedPart<'a> {
    /// The variable's number.
    pub variable: usize,
    /// The number of scalars before the part.
    pub start: usize,
    /// Dynamic indices from there, known only at run time.
    pub indices: &'a [DynamicIndex],
}

impl PromotedPart<'_> {
    /// The part selected by an element of its first dynamic index.
    fn element(&self, dynamic: &DynamicIndex, element: u32) -> Self {
        Self { start: self.start + (element * dynamic.scalars) as usize, indices: &self.indices[1..], ..*self }
    }
}

/// All variables that are held in registers, by number.
#[derive(Debug, Default)]
pub struct PromotedVariables {
    pub variables: Vec<PromotedVariable>,
    /// Numbers by the ids of variables, and of parameters that point to them.
    numbers: HashMap<u32, usize>,
}

impl PromotedVariables {
    /// Adds a variable with these scalars. Returns its number.
    pub fn add(&mut self, scalars: Rc<[Scalar]>, input: Option<u32>) -> usize {
        self.variables.push(PromotedVariable {
            now: vec![None; scalars.len()],
            written: vec![false; scalars.len()],
            scalars,
            input,
        });
        self.variables.len() - 1
    }

    /// Makes an id refer to a variable.
    pub fn bind(&mut self, id: u32, variable: usize) {
        self.numbers.insert(id, variable);
    }

    /// Removes the variable of an id.
    pub fn unbind(&mut self, id: u32) {
        self.numbers.remove(&id);
    }

    /// The variable to which the id of a variable or parameter refers, if it is held in registers.
    pub fn find(&self, id: u32) -> Option<usize> {
        self.numbers.get(&id).copied()
    }

    /// The register that holds a scalar of a variable. Zero if nothing was ever stored.
    pub fn read_scalar(
        &mut self,
        emit: &mut Emitter,
        io: &mut InputsOutputs<'_>,
        variable: usize,
        index: usize,
    ) -> Result<Reg> {
        let found = &self.variables[variable];
        let Some(scalar) = found.scalars.get(index).copied() else {
            return malformed("an access beyond the end of a variable");
        };
        if let Some(reg) = found.now[index] {
            return Ok(reg);
        }
        let reg = match found.input {
            Some(input) => io.input_scalar(emit, input, index, scalar)?,
            None => emit.constant(scalar.register(), 0),
        };
        self.variables[variable].now[index] = Some(reg);
        Ok(reg)
    }

    fn write_scalar(&mut self, emit: &Emitter, variable: usize, index: usize, reg: Reg) -> Result<()> {
        let found = &mut self.variables[variable];
        match found.scalars.get(index) {
            Some(scalar) if scalar.register() == emit.builder.type_of(reg) => {
                found.now[index] = Some(reg);
                found.written[index] = true;
                Ok(())
            }
            _ => malformed("the object doesn't fit the variable"),
        }
    }

    /// Reads `count` scalars of a part.
    pub fn read(
        &mut self,
        emit: &mut Emitter,
        io: &mut InputsOutputs<'_>,
        part: PromotedPart<'_>,
        count: usize,
    ) -> Result<Vec<Reg>> {
        emit.charge_budget(count)?;
        let Some(dynamic) = part.indices.first() else {
            return (part.start..part.start + count)
                .map(|index| self.read_scalar(emit, io, part.variable, index))
                .collect();
        };
        // An index out of range reads the first element.
        let mut result = self.read(emit, io, part.element(dynamic, 0), count)?;
        for element in 1..dynamic.count {
            let candidate = self.read(emit, io, part.element(dynamic, element), count)?;
            let picked = emit.index_is(dynamic.index, element);
            for (result, candidate) in result.iter_mut().zip(candidate) {
                *result = emit.select(picked, candidate, *result);
            }
        }
        Ok(result)
    }

    /// Writes scalars of a part, only where `condition` holds if there is one.
    pub fn write(
        &mut self,
        emit: &mut Emitter,
        io: &mut InputsOutputs<'_>,
        part: PromotedPart<'_>,
        regs: &[Reg],
        condition: Option<Reg>,
    ) -> Result<()> {
        emit.charge_budget(regs.len())?;
        let Some(dynamic) = part.indices.first() else {
            for (index, new) in (part.start..).zip(regs) {
                let reg = match condition {
                    Some(condition) => {
                        let old = self.read_scalar(emit, io, part.variable, index)?;
                        if emit.builder.type_of(old) != emit.builder.type_of(*new) {
                            return malformed("the object doesn't fit the variable");
                        }
                        emit.select(condition, *new, old)
                    }
                    None => *new,
                };
                self.write_scalar(emit, part.variable, index, reg)?;
            }
            return Ok(());
        };
        for element in 0..dynamic.count {
            let picked = emit.index_is(dynamic.index, element);
            let both = match condition {
                Some(condition) => emit.op(Ir::BAnd, &[condition, picked]),
                None => picked,
            };
            self.write(emit, io, part.element(dynamic, element), regs, Some(both))?;
        }
        Ok(())
    }
}
