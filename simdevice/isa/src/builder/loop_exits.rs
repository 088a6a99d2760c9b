//! Values that are used after their loop.
//!
//! An instruction computes all lanes, also those that have left the loop around it. So a value that is read after its
//! loop must be kept in a variable, which keeps, for each lane, the value of the last iteration that the lane was in.

use crate::ir::{Block, Program, Reg, Register, Role, Statement};

/// Rewrites each value that is used outside the innermost loop around its definition into a variable.
pub fn keep_escaping_values(program: &mut Program) {
    let mut search = Search { loop_of: vec![None; program.registers.len()], parents: Vec::new(), escaping: Vec::new() };
    search.block(&program.body, None);
    let mut kept: Vec<Option<Reg>> = vec![None; program.registers.len()];
    for value in search.escaping {
        let slot = &mut kept[value.0 as usize];
        if slot.is_none() && program.registers[value.0 as usize].role == Role::Value {
            let ty = program.registers[value.0 as usize].ty;
            *slot = Some(Reg(program.registers.len() as u32));
            program.registers.push(Register { ty, role: Role::Variable });
        }
    }
    if kept.iter().any(Option::is_some) {
        let mut loops = 0;
        rewrite(&mut program.body, None, &mut loops, &search.loop_of, &search.parents, &kept);
    }
}

/// A loop, numbered in order of appearance.
type Loop = usize;

struct Search {
    /// The innermost loop around each register's definition, once defined within one.
    loop_of: Vec<Option<Loop>>,
    /// Each loop's enclosing loop.
    parents: Vec<Option<Loop>>,
    escaping: Vec<Reg>,
}

impl Search {
    fn block(&mut self, block: &Block, inside: Option<Loop>) {
        for statement in block {
            for used in statement.uses() {
                let defined_in = self.loop_of.get(used.0 as usize).copied().flatten();
                if escapes(defined_in, inside, &self.parents) {
                    self.escaping.push(used);
                }
            }
            for defined in statement.definitions() {
                if let Some(entry) = self.loop_of.get_mut(defined.0 as usize) {
                    *entry = inside;
                }
            }
            let inside = if matches!(statement, Statement::Loop { .. }) {
                self.parents.push(inside);
                Some(self.parents.len() - 1)
            } else {
                inside
            };
            for block in statement.blocks() {
                self.block(block, inside);
            }
        }
    }
}

/// Reports whether a use in loop `at` is outside loop `defined_in`.
fn escapes(defined_in: Option<Loop>, mut at: Option<Loop>, parents: &[Option<Loop>]) -> bool {
    if defined_in.is_none() {
        return false;
    }
    while at.is_some() {
        if at == defined_in {
            return false;
        }
        at = at.and_then(|inner| parents[inner]);
    }
    true
}

fn rewrite(
    block: &mut Block,
    inside: Option<Loop>,
    loops: &mut usize,
    loop_of: &[Option<Loop>],
    parents: &[Option<Loop>],
    kept: &[Option<Reg>],
) {
    for mut statement in std::mem::take(block) {
        statement.for_each_use(&mut |reg| {
            let index = reg.0 as usize;
            if let Some(variable) = kept.get(index).copied().flatten()
                && escapes(loop_of[index], inside, parents)
            {
                *reg = variable;
            }
        });
        let within = if matches!(statement, Statement::Loop { .. }) {
            *loops += 1;
            Some(*loops - 1)
        } else {
            inside
        };
        for inner in statement.blocks_mut() {
            rewrite(inner, within, loops, loop_of, parents, kept);
        }
        let defined = statement.definitions();
        block.push(statement);
        for src in defined {
            if let Some(dst) = kept.get(src.0 as usize).copied().flatten() {
                block.push(Statement::Assign { dst, src });
            }
        }
    }
}
