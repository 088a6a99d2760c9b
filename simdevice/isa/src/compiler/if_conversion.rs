//! Turns short branches into selections, which need no masks.

use std::collections::HashMap;

use crate::ir::op::{Kind, Op};
use crate::ir::{Block, Program, Reg, Register, Role, Statement, Type};

/// The most computations in a branch for which running both sides is better than a branch.
const SHORT: usize = 6;

/// Replaces each short branch, which only computes and assigns variables, by selections.
pub fn convert_branches(program: &mut Program) {
    let Program { registers, body, .. } = program;
    block(body, registers);
}

fn block(statements: &mut Block, registers: &mut Vec<Register>) {
    for mut statement in std::mem::take(statements) {
        for inner in statement.blocks_mut() {
            block(inner, registers);
        }
        match statement {
            Statement::If { condition, then, otherwise } if is_short(&then, &otherwise, registers) => {
                flatten(statements, condition, then, otherwise, registers);
            }
            other => statements.push(other),
        }
    }
}

/// Reports whether a branch only computes and assigns, and reads nothing that it assigns.
fn is_short(then: &Block, otherwise: &Block, registers: &[Register]) -> bool {
    let both = || then.iter().chain(otherwise);
    let mut computations = 0;
    for statement in both() {
        match statement {
            Statement::Compute { op, .. } => {
                computations += 1;
                if matches!(op.kind(), Kind::Special | Kind::Wide) {
                    return false;
                }
            }
            Statement::Assign { .. } => {}
            _ => return false,
        }
    }
    let is_assigned = |reg: Reg| {
        registers[reg.0 as usize].role == Role::Variable
            && both().any(|other| matches!(other, Statement::Assign { dst, .. } if *dst == reg))
    };
    computations <= SHORT && !both().any(|statement| statement.uses().into_iter().any(is_assigned))
}

/// Appends the computations of both sides of a short branch, and selections of their results.
fn flatten(to: &mut Block, condition: Reg, then: Block, otherwise: Block, registers: &mut Vec<Register>) {
    // In order of their first assignment.
    let mut variables = Vec::new();
    let mut values = [HashMap::new(), HashMap::new()];
    for (values, side) in values.iter_mut().zip([then, otherwise]) {
        for statement in side {
            if let Statement::Assign { dst, src } = statement {
                values.insert(dst, src);
                if !variables.contains(&dst) {
                    variables.push(dst);
                }
            } else {
                to.push(statement);
            }
        }
    }
    let mut assignments = Vec::new();
    for variable in variables {
        let ty = registers[variable.0 as usize].ty;
        let selected = Reg(registers.len() as u32);
        registers.push(Register { ty, role: Role::Value });
        let of = |side: &HashMap<Reg, Reg>| side.get(&variable).copied().unwrap_or(variable);
        to.push(Statement::Compute {
            op: match ty {
                Type::Bool => Op::BSelect,
                Type::B32 => Op::Select,
                Type::B64 => Op::Select64,
            },
            dst: selected,
            src: vec![condition, of(&values[0]), of(&values[1])],
        });
        assignments.push(Statement::Assign { dst: variable, src: selected });
    }
    to.append(&mut assignments);
}
