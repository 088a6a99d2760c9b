//! Taking composites apart and putting them together.

use std::rc::Rc;

use isa::ir::Reg;
use isa::op::Op as Ir;
use spirv::Op;

use super::super::error::{Result, malformed};
use super::super::instruction::Instruction;
use super::Translator;

impl Translator<'_> {
    /// Composite instructions.
    pub fn composite(&mut self, it: &Instruction) -> Result<()> {
        match it.opcode {
            Op::CompositeConstruct => {
                let limit = self.globals.types.scalars(it.ty()?)? as usize;
                self.charge_budget(limit)?;
                let mut regs = Vec::with_capacity(limit);
                for part in it.ids(0) {
                    regs.extend_from_slice(&self.regs(part)?);
                    if regs.len() > limit {
                        return malformed("there are more parts than the type has");
                    }
                }
                self.define(it, regs)
            }
            Op::CompositeExtract => {
                let whole = self.regs(it.id(0)?)?;
                let (start, count) = self.part(self.type_of(it.id(0)?)?, &it.numbers(1))?;
                self.charge_budget(count)?;
                self.define(it, whole[start..start + count].to_vec())
            }
            Op::CompositeInsert => {
                let (object, whole) = (self.regs(it.id(0)?)?, self.regs(it.id(1)?)?);
                let (start, count) = self.part(self.type_of(it.id(1)?)?, &it.numbers(2))?;
                if object.len() != count {
                    return malformed("the object doesn't fit its place");
                }
                self.charge_budget(whole.len())?;
                let mut regs = whole.to_vec();
                regs[start..start + count].copy_from_slice(&object);
                self.define(it, regs)
            }
            Op::CopyLogical => {
                let regs = self.regs(it.id(0)?)?;
                self.charge_budget(regs.len())?;
                self.define(it, regs.to_vec())
            }
            Op::VectorShuffle => {
                let (a, b) = (self.regs(it.id(0)?)?, self.regs(it.id(1)?)?);
                let mut regs = Vec::new();
                for index in it.numbers(2).into_iter().take(4) {
                    let both = a.iter().chain(b.iter()).copied();
                    let picked = both.clone().nth(index as usize);
                    // All ones stands for an undefined component.
                    match picked.or(both.clone().next().filter(|_| index == u32::MAX)) {
                        Some(reg) => regs.push(reg),
                        None => return malformed(format!("there is no component {index}")),
                    }
                }
                self.define(it, regs)
            }
            Op::VectorExtractDynamic => {
                let (vector, index) = (self.regs(it.id(0)?)?, self.reg(it.id(1)?)?);
                let Some((first, rest)) = vector.split_first() else {
                    return malformed("the operand has no components");
                };
                self.charge_budget(2 * rest.len())?;
                let mut found = *first;
                for (element, reg) in (1..).zip(rest) {
                    let element = self.u32(element);
                    let this = self.op(Ir::IEq, &[index, element]);
                    found = self.select(this, *reg, found);
                }
                self.define(it, vec![found])
            }
            Op::VectorInsertDynamic => {
                let vector = self.regs(it.id(0)?)?;
                let (object, index) = (self.reg(it.id(1)?)?, self.reg(it.id(2)?)?);
                self.charge_budget(2 * vector.len())?;
                let mut regs = Vec::with_capacity(vector.len());
                for (element, reg) in (0..).zip(vector.iter()) {
                    let element = self.u32(element);
                    let this = self.op(Ir::IEq, &[index, element]);
                    regs.push(self.select(this, object, *reg));
                }
                self.define(it, regs)
            }
            _ => {
                let matrix = self.matrix(it.id(0)?)?;
                let regs = matrix.transposed().regs;
                self.define(it, regs.to_vec())
            }
        }
    }

    /// Where a path of indices leads: the scalars before the part and those in it.
    fn part(&self, mut ty: u32, indices: &[u32]) -> Result<(usize, usize)> {
        let mut start = 0;
        for index in indices {
            let (part, before) = self.globals.types.part(ty, *index)?;
            ty = part;
            start += before as usize;
        }
        Ok((start, self.globals.types.scalars(ty)? as usize))
    }

    /// A matrix operand.
    pub fn matrix(&mut self, id: u32) -> Result<Matrix> {
        let (columns, rows, _, _) = self.globals.types.matrix(self.type_of(id)?)?;
        Ok(Matrix {
            columns: columns as usize,
            rows: rows as usize,
            regs: self.regs(id)?,
        })
    }
}

/// A matrix: its columns one after the other.
#[derive(Clone, Debug)]
pub struct Matrix {
    pub columns: usize,
    pub rows: usize,
    pub regs: Rc<[Reg]>,
}

impl Matrix {
    /// An element.
    pub fn at(&self, row: usize, column: usize) -> Reg {
        self.regs[column * self.rows + row]
    }

    /// A row.
    pub fn row(&self, row: usize) -> Vec<Reg> {
        (0..self.columns)
            .map(|column| self.at(row, column))
            .collect()
    }

    /// A column.
    pub fn column(&self, column: usize) -> &[Reg] {
        &self.regs[column * self.rows..(column + 1) * self.rows]
    }

    /// Rows and columns exchanged.
    pub fn transposed(&self) -> Self {
        Self {
            columns: self.rows,
            rows: self.columns,
            regs: (0..self.rows).flat_map(|row| self.row(row)).collect(),
        }
    }
}
