//! Lets the caller read outputs from the registers that compute them, which saves a copy in each batch. Outputs of killed
//! lanes are not read, so that a lane may be killed before.

use crate::ir::{Block, Program, Reg, Role, Statement};

/// Replaces each output that all lanes assign once by the varying value assigned to it. `varying` says which registers
/// have a value for each lane.
pub fn forward(program: &mut Program, varying: &[bool]) {
    let stay = program.body.iter().position(returns);
    let stay = stay.unwrap_or(program.body.len());
    let mut copied = vec![false; program.body.len()];
    for output in &mut program.outputs {
        let variable = output.reg;
        let is_read = program.body.iter().any(|statement| statement.reads(variable));
        if is_read || assignments(&program.body, variable) != 1 {
            continue;
        }
        let assigned = program.body[..stay]
            .iter()
            .position(|statement| matches!(statement, Statement::Assign { dst, .. } if *dst == variable));
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

/// Reports whether lanes may return in a statement.
fn returns(statement: &Statement) -> bool {
    matches!(statement, Statement::Return) || statement.blocks().into_iter().flatten().any(returns)
}

/// The number of statements that assign to a variable.
pub(super) fn assignments(block: &Block, variable: Reg) -> usize {
    let of = |statement: &Statement| {
        let own = usize::from(statement.definitions().contains(&variable));
        let inner = statement.blocks().into_iter();
        own + inner.map(|block| assignments(block, variable)).sum::<usize>()
    };
    block.iter().map(of).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::Builder;
    use crate::compiler::uniformity::{SameInAllLanes, varying_registers};
    use crate::ir::{Rate, Type};

    /// Reports whether the only output of a program is read from the register that computes it.
    fn is_forwarded(rate: Rate, write: impl FnOnce(&mut Builder, Reg, Reg)) -> bool {
        let mut builder = Builder::new();
        let input = builder.input(0, Type::B32, rate);
        let output = builder.output(0, Type::B32);
        write(&mut builder, input, output);
        let mut program = builder.finish().expect("a valid program");
        let varying = varying_registers(&program, SameInAllLanes { private: false, shared: true });
        forward(&mut program, &varying);
        program.outputs[0].reg != output
    }

    #[gaurast_runner::test]
    fn what_every_lane_assigns_once_is_forwarded() {
        let once = |b: &mut Builder, input, output| b.assign(output, input);
        assert!(is_forwarded(Rate::Varying, once));
        assert!(!is_forwarded(Rate::Uniform, once), "it has one value for all");
        let twice = |b: &mut Builder, input, output| {
            b.assign(output, input);
            b.assign(output, input);
        };
        assert!(!is_forwarded(Rate::Varying, twice));
        let after = |leave: fn(&mut Builder)| {
            move |b: &mut Builder, input, output| {
                let condition = b.compute(crate::ir::op::Op::INe, &[input, input]);
                b.begin_if(condition);
                leave(b);
                b.end();
                b.assign(output, input);
            }
        };
        assert!(!is_forwarded(Rate::Varying, after(|b| b.statement(Statement::Return))));
        assert!(is_forwarded(Rate::Varying, after(Builder::kill)), "killed lanes have no output");
    }
}
