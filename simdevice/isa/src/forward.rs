//! Lets the caller read outputs where they were computed, where else each batch would copy them.

use super::ir::{Block, Program, Reg, Role, Statement};

/// Makes outputs that all lanes assign once, to a value of each lane, that value. `varying` says which registers have a
/// value for each lane.
pub fn forward(program: &mut Program, varying: &[bool]) {
    let stay = program.body.iter().position(leaves);
    let stay = stay.unwrap_or(program.body.len());
    let mut copied = vec![false; program.body.len()];
    for output in &mut program.outputs {
        let variable = output.reg;
        if assignments(&program.body, variable) != 1 || is_read(&program.body, variable) {
            continue;
        }
        let assigned = program.body[..stay].iter().position(
            |statement| matches!(statement, Statement::Assign { dst, .. } if *dst == variable),
        );
        let Some(at) = assigned else { continue };
        let Statement::Assign { src, .. } = program.body[at] else {
            continue;
        };
        let is_value = program.registers[src.0 as usize].role == Role::Value;
        if is_value && varying[src.0 as usize] {
            output.reg = src;
            copied[at] = true;
        }
    }
    let mut copied = copied.into_iter();
    program.body.retain(|_| copied.next() != Some(true));
}

/// Whether lanes may end in a statement.
fn leaves(statement: &Statement) -> bool {
    matches!(statement, Statement::Return | Statement::Kill)
        || statement.blocks().into_iter().flatten().any(leaves)
}

/// How many statements assign to a variable.
fn assignments(block: &Block, variable: Reg) -> usize {
    let of = |statement: &Statement| {
        let own = usize::from(statement.definitions().contains(&variable));
        let inner = statement.blocks().into_iter();
        own + inner
            .map(|block| assignments(block, variable))
            .sum::<usize>()
    };
    block.iter().map(of).sum()
}

fn is_read(block: &Block, variable: Reg) -> bool {
    block.iter().any(|statement| {
        statement.uses().contains(&variable)
            || statement
                .blocks()
                .into_iter()
                .any(|block| is_read(block, variable))
    })
}
