//! Propagation of values through variables.

use std::collections::{HashMap, HashSet};

use crate::ir::{Block, Program, Reg, Register, Role, Statement};

/// Replaces reads of variables by the values that were assigned to them in the same block or one around it, and removes
/// assignments that another one overwrites before a read.
pub fn propagate(program: &mut Program) {
    let registers = &program.registers;
    forward(&mut program.body, registers, HashMap::new());
    remove_overwritten(&mut program.body);
}

/// `values` are those of variables at the block's beginning: what a lane assigned last.
fn forward(block: &mut Block, registers: &[Register], mut values: HashMap<Reg, Reg>) {
    for statement in block {
        statement.replace_uses(&values);
        if let Statement::Assign { dst, src } = statement {
            match registers[src.0 as usize].role {
                Role::Value => values.insert(*dst, *src),
                Role::Variable => values.remove(dst),
            };
            continue;
        }
        let mut assigned = HashSet::new();
        statement.collect_definitions(&mut assigned);
        // What a block within assigns may come before the beginning of it or of another one.
        let repeats = matches!(statement, Statement::Loop { .. } | Statement::Switch { .. });
        if repeats {
            values.retain(|variable, _| !assigned.contains(variable));
        }
        statement.blocks_mut().into_iter().for_each(|inner| forward(inner, registers, values.clone()));
        values.retain(|variable, _| !assigned.contains(variable));
    }
}

fn remove_overwritten(block: &mut Block) {
    // Variables that are assigned before they are read, by all lanes that come here.
    let mut overwritten = HashSet::new();
    for mut statement in std::mem::take(block).into_iter().rev() {
        statement.blocks_mut().into_iter().for_each(remove_overwritten);
        if let Statement::Assign { dst, .. } = &statement
            && !overwritten.insert(*dst)
        {
            continue;
        }
        if may_leave(&statement) {
            overwritten.clear();
        }
        remove_read(&statement, &mut overwritten);
        block.push(statement);
    }
    block.reverse();
}

/// True if a lane that runs a statement may not run the next one.
fn may_leave(statement: &Statement) -> bool {
    matches!(statement, Statement::Break(_) | Statement::Continue(_) | Statement::Return | Statement::Kill)
        || statement.blocks().into_iter().flatten().any(may_leave)
}

fn remove_read(statement: &Statement, overwritten: &mut HashSet<Reg>) {
    for reg in statement.uses() {
        overwritten.remove(&reg);
    }
    statement.blocks().into_iter().flatten().for_each(|inner| remove_read(inner, overwritten));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::Builder;
    use crate::compiler::forwarding::assignments;
    use crate::ir::op::Op;
    use crate::ir::{Rate, Type};

    /// The number of assignments of a variable that are left, and whether it is read: of one that is assigned, read within
    /// what `between` writes, assigned again and read by an output.
    fn left(between: impl FnOnce(&mut Builder, Reg)) -> (usize, bool) {
        let mut b = Builder::new();
        let x = b.input(0, Type::B32, Rate::Varying);
        let variable = b.variable(Type::B32);
        b.assign(variable, x);
        between(&mut b, variable);
        let twice = b.compute(Op::IAdd, &[variable, x]);
        b.assign(variable, twice);
        let output = b.output(0, Type::B32);
        b.assign(output, variable);
        let mut program = b.finish().expect("a valid program");
        propagate(&mut program);
        (assignments(&program.body, variable), program.body.iter().any(|statement| statement.reads(variable)))
    }

    #[gaurast_runner::test]
    fn values_take_the_place_of_variables_in_their_block() {
        assert_eq!(left(|_, _| {}), (1, false));
    }

    #[gaurast_runner::test]
    fn a_variable_that_some_lanes_assign_is_read() {
        let by_some = |b: &mut Builder, variable| {
            let some = b.input(1, Type::Bool, Rate::Varying);
            let zero = b.u32(0);
            b.begin_if(some);
            b.assign(variable, zero);
            b.end();
        };
        assert_eq!(left(by_some), (3, true));
    }

    #[gaurast_runner::test]
    fn a_variable_that_an_iteration_assigns_is_read_in_the_next() {
        let in_a_loop = |b: &mut Builder, variable| {
            let some = b.input(1, Type::Bool, Rate::Varying);
            let label = b.begin_loop();
            let next = b.compute(Op::IMul, &[variable, variable]);
            b.assign(variable, next);
            b.begin_if(some);
            b.break_to(label);
            b.end();
            b.end();
        };
        assert_eq!(left(in_a_loop), (3, true));
    }

    #[gaurast_runner::test]
    fn assignments_before_lanes_leave_stay() {
        let leave = |b: &mut Builder, _| {
            let some = b.input(1, Type::Bool, Rate::Varying);
            b.begin_if(some);
            b.ret();
            b.end();
        };
        assert_eq!(left(leave), (2, false));
    }
}
