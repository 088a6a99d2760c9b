//! Dead code elimination.

use crate::ir::{Block, Program, Reg, Statement};

/// Removes computations, loads and assignments that nothing reads, and branches that are empty.
pub fn remove_dead(program: &mut Program) {
    let mut live = vec![false; program.registers.len()];
    for output in &program.outputs {
        live[output.reg.0 as usize] = true;
    }
    while mark(&program.body, &mut live) {}
    sweep(&mut program.body, &live);
    program.constants.retain(|constant| live[constant.reg.0 as usize]);
    program.inputs.retain(|input| live[input.reg.0 as usize]);
}

/// Reports whether a statement must stay even if nothing reads its results.
fn has_effect(statement: &Statement) -> bool {
    !matches!(
        statement,
        Statement::Compute { .. }
            | Statement::Assign { .. }
            | Statement::LaneIndex { .. }
            | Statement::IsHelper { .. }
            | Statement::Clock { .. }
            | Statement::Load { .. }
            | Statement::BufferSize { .. }
            | Statement::Sample(_)
            | Statement::ImageRead(_)
            | Statement::ImageQuery { .. }
            | Statement::Derivative { .. }
            | Statement::Subgroup { .. }
    )
}

/// Marks the registers that live statements read, from the last to the first. Returns true if it marked a new one.
fn mark(block: &Block, live: &mut [bool]) -> bool {
    let mut found = false;
    for statement in block.iter().rev() {
        for inner in statement.blocks().into_iter().rev() {
            found |= mark(inner, live);
        }
        if has_effect(statement) || statement.definitions().iter().any(|reg| live[reg.0 as usize]) {
            for reg in statement.uses() {
                found |= !std::mem::replace(&mut live[reg.0 as usize], true);
            }
        }
    }
    found
}

fn sweep(block: &mut Block, live: &[bool]) {
    let is_live = |reg: &Reg| live[reg.0 as usize];
    block.retain_mut(|statement| {
        for inner in statement.blocks_mut() {
            sweep(inner, live);
        }
        match statement {
            Statement::If { then, otherwise, .. } => !then.is_empty() || !otherwise.is_empty(),
            Statement::Scope { body, .. } => !body.is_empty(),
            Statement::Sample(sample) => keep_live(&mut sample.dst, live),
            Statement::ImageRead(read) => keep_live(&mut read.dst, live),
            Statement::Atomic { dst, .. } => {
                *dst = dst.filter(is_live);
                true
            }
            Statement::ImageAtomic(atomic) => {
                atomic.dst = atomic.dst.filter(is_live);
                true
            }
            other => has_effect(other) || other.definitions().iter().any(is_live),
        }
    });
}

/// Drops results that nothing reads. Returns false if none is left.
fn keep_live(dst: &mut [Option<Reg>; 4], live: &[bool]) -> bool {
    for reg in dst.iter_mut() {
        *reg = reg.filter(|reg| live[reg.0 as usize]);
    }
    dst.iter().any(Option::is_some)
}
