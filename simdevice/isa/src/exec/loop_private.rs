//! Variables that only their loop looks at.
//!
//! An assignment acts on active lanes alone, because lanes that have left a loop may read the variable later. Where they
//! can't, the mask is not needed: the result may go straight to the variable, in all lanes.

use std::collections::{HashMap, HashSet};

use super::super::ir::{Block, Label, Program, Reg, Role, Statement};

/// For each loop, the variables that are read only within it, and that every lane which enters it has assigned just
/// before (in the block that the loop is in).
pub fn loop_private_variables(program: &Program) -> HashMap<Label, HashSet<Reg>> {
    let mut reads = HashMap::new();
    count_reads(program, &program.body, &mut reads);
    for output in &program.outputs {
        *reads.entry(output.reg).or_default() += 1;
    }
    let mut found = HashMap::new();
    search(program, &program.body, &reads, &mut found);
    found
}

/// Counts reads of variables.
fn count_reads(program: &Program, block: &Block, reads: &mut HashMap<Reg, usize>) {
    for statement in block {
        for reg in statement.uses() {
            if program.registers[reg.0 as usize].role == Role::Variable {
                *reads.entry(reg).or_default() += 1;
            }
        }
        statement
            .blocks()
            .into_iter()
            .for_each(|block| count_reads(program, block, reads));
    }
}

fn search(
    program: &Program,
    block: &Block,
    reads: &HashMap<Reg, usize>,
    found: &mut HashMap<Label, HashSet<Reg>>,
) {
    let mut assigned = HashSet::new();
    for statement in block {
        match statement {
            Statement::Assign { dst, .. } => {
                assigned.insert(*dst);
            }
            Statement::Loop { label, .. } => {
                let mut within = HashMap::new();
                statement
                    .blocks()
                    .into_iter()
                    .for_each(|block| count_reads(program, block, &mut within));
                let private = within.iter().filter(|(reg, count)| {
                    assigned.contains(*reg) && reads.get(*reg) == Some(*count)
                });
                found.insert(*label, private.map(|(reg, _)| *reg).collect());
            }
            _ => {}
        }
        statement
            .blocks()
            .into_iter()
            .for_each(|block| search(program, block, reads, found));
    }
}
