//! Constant folding and common subexpressions.

use std::collections::HashMap;

use crate::ir::op::Op;
use crate::ir::{Address, Block, Constant, Format, Program, Reg, Register, Role, Space, Statement, Type};
use crate::kernels::evaluate;

/// Folds constants, takes branches on constants, and shares equal computations. `table` has the words of private memory, if
/// they are constants.
pub fn fold(program: &mut Program, table: Option<&[u32]>) {
    let mut folding = Folding {
        constants: Constants::of(program),
        alias: HashMap::new(),
        seen: vec![HashMap::new()],
        registers: std::mem::take(&mut program.registers),
        table,
    };
    folding.block(&mut program.body);
    program.registers = folding.registers;
    program.constants.append(&mut folding.constants.new);
}

/// The constants of a program, which passes add to.
pub struct Constants {
    known: HashMap<Reg, u64>,
    registers: HashMap<(Type, u64), Reg>,
    /// The constants that passes have added.
    pub new: Vec<Constant>,
}

impl Constants {
    /// The constants that a program has.
    pub fn of(program: &Program) -> Self {
        let mut registers = HashMap::new();
        for constant in &program.constants {
            let ty = program.registers[constant.reg.0 as usize].ty;
            registers.entry((ty, constant.bits)).or_insert(constant.reg);
        }
        let known = program.constants.iter().map(|constant| (constant.reg, constant.bits)).collect();
        Self { known, registers, new: Vec::new() }
    }

    /// The bits of a register, if it is a constant.
    pub fn bits(&self, reg: Reg) -> Option<u64> {
        self.known.get(&reg).copied()
    }

    /// The register of a constant, which is added to `registers` if there is none.
    pub fn register(&mut self, ty: Type, bits: u64, registers: &mut Vec<Register>) -> Reg {
        *self.registers.entry((ty, bits)).or_insert_with(|| {
            let reg = Reg(registers.len() as u32);
            registers.push(Register { ty, role: Role::Value });
            self.new.push(Constant { reg, bits });
            self.known.insert(reg, bits);
            reg
        })
    }
}

struct Folding<'a> {
    constants: Constants,
    /// Values replaced by others.
    alias: HashMap<Reg, Reg>,
    /// Computations on values, by the block that they are in, innermost last.
    seen: Vec<HashMap<(Op, Vec<Reg>), Reg>>,
    registers: Vec<Register>,
    /// The words of private memory, if they are constants.
    table: Option<&'a [u32]>,
}

impl Folding<'_> {
    fn block(&mut self, block: &mut Block) {
        for mut statement in std::mem::take(block) {
            statement.replace_uses(&self.alias);
            match &mut statement {
                Statement::Compute { op, dst, src } => {
                    if let Some(same) = self.replacement(*op, *dst, src) {
                        self.alias.insert(*dst, same);
                        continue;
                    }
                }
                Statement::Load { dst, address, format } if self.replace_load(dst, address, *format).is_some() => {
                    continue;
                }
                Statement::If { condition, then, otherwise } => {
                    if let Some(bits) = self.constants.bits(*condition) {
                        let mut taken = std::mem::take(if bits != 0 { then } else { otherwise });
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
        let known: Option<Vec<u64>> = src.iter().map(|reg| self.constants.bits(*reg)).collect();
        if let Some(operands) = known {
            return Some(self.constant(op.signature().result_type, evaluate(op, &operands)));
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
        let value = |index: usize| self.constants.bits(*src.get(index)?);
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
        self.constants.register(ty, bits, &mut self.registers)
    }

    /// Replaces the results of a load by constants, if it is of known words.
    fn replace_load(&mut self, dst: &[Reg], address: &Address, format: Format) -> Option<()> {
        let table = self.table.filter(|_| address.space == Space::Private && format == Format::B32)?;
        let base = address.base.map_or(Some(0), |base| self.constants.bits(base))?;
        let start = base.checked_add(u64::from(address.offset))?;
        let first = usize::try_from(start / 4).ok()?;
        let words = table.get(first..first.checked_add(dst.len())?)?;
        for (reg, word) in dst.iter().zip(words) {
            let same = self.constant(Type::B32, u64::from(*word));
            self.alias.insert(*reg, same);
        }
        Some(())
    }
}
