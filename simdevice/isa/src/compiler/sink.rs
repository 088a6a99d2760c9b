//! Moves computations down to the assignment of their result.

use crate::ir::{Block, Program, Register, Role, Statement, contains};

/// The number of statements before an assignment in which [`sink`] looks for the computation.
const NEARBY: usize = 64;

/// Moves each computation whose result is only assigned to a variable to just before that assignment, so that the two
/// can be one step. A loop's continuing part becomes the end of its body where no lane continues early, for the same
/// reason: values for the next iteration are assigned there.
pub fn sink(program: &mut Program) {
    sink_block(&mut program.body, &program.registers);
}

fn sink_block(block: &mut Block, registers: &[Register]) {
    for statement in block.iter_mut() {
        if let Statement::Loop { label, body, continuing } = statement
            && !contains(body, &Statement::Continue(*label))
        {
            // All lanes that continue reach the end of the body.
            body.append(continuing);
        }
        statement.blocks_mut().into_iter().for_each(|inner| sink_block(inner, registers));
    }
    for at in 0..block.len() {
        let Statement::Assign { src, .. } = block[at] else {
            continue;
        };
        let defines = |statement: &Statement| matches!(statement, Statement::Compute { dst, .. } if *dst == src);
        let start = at.saturating_sub(NEARBY);
        let Some(from) = block[start..at].iter().position(defines).map(|index| start + index) else {
            continue;
        };
        let between = &block[from + 1..at];
        let movable = block[from].uses().into_iter().all(|operand| {
            registers[operand.0 as usize].role == Role::Value || !between.iter().any(|other| other.writes(operand))
        });
        // Lanes that leave in between may need the result at the place where they go.
        let all_stay = between.iter().all(keeps_lanes);
        if movable && all_stay && !between.iter().any(|other| other.reads(src)) {
            block[from..at].rotate_left(1);
        }
    }
}

/// Reports whether every lane that runs a statement runs the next one, too.
fn keeps_lanes(statement: &Statement) -> bool {
    let leaves =
        matches!(statement, Statement::Break(_) | Statement::Continue(_) | Statement::Return | Statement::Kill);
    !leaves && statement.blocks().into_iter().flatten().all(keeps_lanes)
}
