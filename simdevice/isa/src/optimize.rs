//! Makes programs smaller: constants folded, repeated computations shared, what nobody reads removed.

use std::collections::HashMap;

use fearless_simd::Level;

use super::exec::evaluate;
use super::hoist::hoist;
use super::ir::{Block, Constant, Program, Reg, Register, Role, Statement, Type};
use super::op::Op;
use super::select::select;

/// Optimizes a valid program; it stays valid and means the same.
pub fn optimize(program: &mut Program, level: Level) {
    fold(program, level);
    remove_dead(program);
    select(program);
    hoist(program);
    remove_dead(program);
    let Program {
        registers, body, ..
    } = program;
    sink(body, registers);
}

/// How many statements [`sink`] looks back over.
const NEARBY: usize = 64;

/// Moves each computation whose result is only assigned to a variable to just before that assignment, so that the two can
/// be one step.
fn sink(block: &mut Block, registers: &[Register]) {
    for statement in block.iter_mut() {
        statement
            .blocks_mut()
            .into_iter()
            .for_each(|inner| sink(inner, registers));
    }
    for at in 0..block.len() {
        let Statement::Assign { src, .. } = block[at] else {
            continue;
        };
        let defines = |statement: &Statement| matches!(statement, Statement::Compute { dst, .. } if *dst == src);
        let start = at.saturating_sub(NEARBY);
        let Some(from) = block[start..at]
            .iter()
            .position(defines)
            .map(|index| start + index)
        else {
            continue;
        };
        let between = &block[from + 1..at];
        let movable = block[from].uses().into_iter().all(|operand| {
            registers[operand.0 as usize].role == Role::Value
                || !between.iter().any(|other| touches(other, operand))
        });
        // Lanes that leave in between may need the result where they come back.
        let all_stay = between.iter().all(keeps_lanes);
        if movable && all_stay && !between.iter().any(|other| reads(other, src)) {
            block[from..at].rotate_left(1);
        }
    }
}

/// Whether every lane that runs a statement runs the next one, too.
fn keeps_lanes(statement: &Statement) -> bool {
    let leaves = matches!(
        statement,
        Statement::Break(_) | Statement::Continue(_) | Statement::Return | Statement::Kill
    );
    !leaves && statement.blocks().into_iter().flatten().all(keeps_lanes)
}

/// Whether a statement, or one within, assigns to a register.
fn touches(statement: &Statement, reg: Reg) -> bool {
    statement.definitions().contains(&reg)
        || statement
            .blocks()
            .iter()
            .any(|block| block.iter().any(|inner| touches(inner, reg)))
}

/// Whether a statement, or one within, reads a register.
pub fn reads(statement: &Statement, reg: Reg) -> bool {
    statement.uses().contains(&reg)
        || statement
            .blocks()
            .iter()
            .any(|block| block.iter().any(|inner| reads(inner, reg)))
}

/// Folds constants, takes branches on constants, and shares equal computations.
fn fold(program: &mut Program, level: Level) {
    let mut folding = Folding {
        known: program
            .constants
            .iter()
            .map(|constant| (constant.reg, constant.bits))
            .collect(),
        constants: HashMap::new(),
        alias: HashMap::new(),
        seen: vec![HashMap::new()],
        level,
        registers: std::mem::take(&mut program.registers),
        new_constants: Vec::new(),
    };
    for constant in &program.constants {
        let ty = folding.registers[constant.reg.0 as usize].ty;
        folding
            .constants
            .entry((ty, constant.bits))
            .or_insert(constant.reg);
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
                Statement::If {
                    condition,
                    then,
                    otherwise,
                } => {
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

    /// A register that already holds, or can hold beforehand, what a computation gives.
    fn replacement(&mut self, op: Op, dst: Reg, src: &[Reg]) -> Option<Reg> {
        let known: Option<Vec<u64>> = src.iter().map(|reg| self.known.get(reg).copied()).collect();
        if let Some(operands) = known {
            return Some(self.constant(op.signature().result, evaluate(self.level, op, &operands)));
        }
        if let Some(same) = self.identity(op, src) {
            return Some(same);
        }
        if src
            .iter()
            .any(|reg| self.registers[reg.0 as usize].role == Role::Variable)
        {
            return None;
        }
        let key = (op, src.to_vec());
        let found = self
            .seen
            .iter()
            .rev()
            .find_map(|seen| seen.get(&key))
            .copied();
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
            Op::IAdd | Op::ISub | Op::Or | Op::Xor | Op::Shl | Op::UShr | Op::SShr
                if value(1) == Some(0) =>
            {
                src[0]
            }
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
            self.registers.push(Register {
                ty,
                role: Role::Value,
            });
            self.new_constants.push(Constant { reg, bits });
            self.known.insert(reg, bits);
            reg
        })
    }
}

/// Removes computations, loads and assignments that nothing reads, and branches that are empty.
fn remove_dead(program: &mut Program) {
    let mut live = vec![false; program.registers.len()];
    for output in &program.outputs {
        live[output.reg.0 as usize] = true;
    }
    while mark(&program.body, &mut live) {}
    sweep(&mut program.body, &live);
    program
        .constants
        .retain(|constant| live[constant.reg.0 as usize]);
    program.inputs.retain(|input| live[input.reg.0 as usize]);
}

/// Whether a statement must stay though nothing reads its results.
fn has_effect(statement: &Statement) -> bool {
    !matches!(
        statement,
        Statement::Compute { .. }
            | Statement::Assign { .. }
            | Statement::LaneIndex { .. }
            | Statement::IsHelper { .. }
            | Statement::Load { .. }
            | Statement::BufferSize { .. }
            | Statement::Sample(_)
            | Statement::ImageRead(_)
            | Statement::ImageQuery { .. }
            | Statement::Derivative { .. }
            | Statement::Subgroup { .. }
    )
}

/// Marks what live statements read, from the last to the first; true if that found anything new.
fn mark(block: &Block, live: &mut [bool]) -> bool {
    let mut found = false;
    for statement in block.iter().rev() {
        for inner in statement.blocks().into_iter().rev() {
            found |= mark(inner, live);
        }
        if has_effect(statement)
            || statement
                .definitions()
                .iter()
                .any(|reg| live[reg.0 as usize])
        {
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
            Statement::If {
                then, otherwise, ..
            } => !then.is_empty() || !otherwise.is_empty(),
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

/// Drops results that nothing reads; false if none is left.
fn keep_live(dst: &mut [Option<Reg>; 4], live: &[bool]) -> bool {
    for reg in dst.iter_mut() {
        *reg = reg.filter(|reg| live[reg.0 as usize]);
    }
    dst.iter().any(Option::is_some)
}
