//! Constant folding and common subexpressions.

use std::collections::HashMap;

use fearless_simd::Level;

use crate::ir::op::Op;
use crate::ir::{Block, Constant, Program, Reg, Register, Role, Statement, Type};
use crate::kernels::evaluate;

/// Folds constants, takes branches on constants, and shares equal computations.
pub fn fold(program: &mut Program, level: Level) {
    let mut folding = Folding {
        known: program.constants.iter().map(|constant| (constant.reg, constant.bits)).collect(),
        constants: HashMap::new(),
        alias: HashMap::new(),
        seen: vec![HashMap::new()],
        level,
        registers: std::mem::take(&mut program.registers),
        new_constants: Vec::new(),
    };
    for constant in &program.constants {
        let ty = folding.registers[constant.reg.0 as usize].ty;
        folding.constants.entry((ty, constant.bits)).or_insert(constant.reg);
    }
    folding.block(&mut program.body);
    program.registers = folding.registers;
    program.constants.append(&mut folding.new_constants);
}

struct Folding {
    /// Values known to be constant.
    known: HashMap<Reg, u64>,
    constants: HashMap<(Type, u64), Reg>,
    /// Values replaced by others.
    alias: HashMap<Reg, Reg>,
    /// Computations on values, by the block that they are in, innermost last.
    seen: Vec<HashMap<(Op, Vec<Reg>), Reg>>,
    level: Level,
    registers: Vec<Register>,
    new_constants: Vec<Constant>,
}

impl Folding {
    fn block(&mut self, block: &mut Block) {
        for mut statement in std::mem::take(block) {
            statement.for_each_use(&mut |reg| {
                if let Some(alias) = self.alias.get(reg) {
                    *reg = *alias;
                }
            });
            match &mut statement {
                Statement::Compute { op, dst, src } => {
                    if let Some(same) = self.replacement(*op, *dst, src) {
                        self.alias.insert(*dst, same);
                        continue;
                    }
                }
                Statement::If { condition, then, otherwise } => {
                    if let Some(bits) = self.known.get(condition) {
                        let mut taken = std::mem::take(if *bits != 0 { then } else { otherwise });
                        self.block(&mut taken);
                        block.append(&mut taken);
                        continue;
                    }
                }
                _ => {}
            }
            for inner in statement.blocks_mut() {
                self.seen.push(HashMap::new());
                self.block(inner);
                self.seen.pop();
            }
            block.push(statement);
        }
    }

    /// A register that already holds a computation's result, or a constant for it.
    fn replacement(&mut self, op: Op, dst: Reg, src: &[Reg]) -> Option<Reg> {
        let known: Option<Vec<u64>> = src.iter().map(|reg| self.known.get(reg).copied()).collect();
        if let Some(operands) = known {
            return Some(self.constant(op.signature().result_type, evaluate(self.level, op, &operands)));
        }
        if let Some(same) = self.identity(op, src) {
            return Some(same);
        }
        if src.iter().any(|reg| self.registers[reg.0 as usize].role == Role::Variable) {
            return None;
        }
        let key = (op, src.to_vec());
        let found = self.seen.iter().rev().find_map(|seen| seen.get(&key)).copied();
        if found.is_none()
            && let Some(seen) = self.seen.last_mut()
        {
            seen.insert(key, dst);
        }
        found
    }

    /// The operand that an integer operation or selection leaves unchanged.
    fn identity(&self, op: Op, src: &[Reg]) -> Option<Reg> {
        let value = |index: usize| self.known.get(src.get(index)?).copied();
        let same = match op {
            Op::IAdd | Op::Or | Op::Xor if value(0) == Some(0) => src[1],
            Op::IAdd | Op::ISub | Op::Or | Op::Xor | Op::Shl | Op::UShr | Op::SShr if value(1) == Some(0) => src[0],
            Op::IMul if value(0) == Some(1) => src[1],
            Op::IMul | Op::UDiv if value(1) == Some(1) => src[0],
            Op::Select | Op::Select64 | Op::BSelect => match value(0) {
                Some(0) => src[2],
                Some(_) => src[1],
                None => return None,
            },
            _ => return None,
        };
        // A variable may change before the result is read.
        (self.registers[same.0 as usize].role == Role::Value).then_some(same)
    }

    fn constant(&mut self, ty: Type, bits: u64) -> Reg {
        *self.constants.entry((ty, bits)).or_insert_with(|| {
            let reg = Reg(self.registers.len() as u32);
            self.registers.push(Register { ty, role: Role::Value });
            self.new_constants.push(Constant { reg, bits });
            self.known.insert(reg, bits);
            reg
        })
    }
}
