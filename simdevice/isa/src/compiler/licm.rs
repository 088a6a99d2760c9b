//! Loop-invariant code motion, and sharing of repeated loads.

use std::collections::{HashMap, HashSet};

use crate::ir::{Address, Block, Format, Program, Reg, Register, Role, Space, Statement};

/// Moves loop-invariant computations out of loops, and shares repeated loads.
pub fn move_invariants(program: &mut Program) {
    load_push_constants_first(program);
    let mut sharing = Sharing { registers: &program.registers, alias: HashMap::new() };
    sharing.block(&mut program.body);
    move_out_of_loops(&mut program.body, &program.registers);
}

/// Loads each push constant at a constant offset once, at the beginning: a program can't write them.
fn load_push_constants_first(program: &mut Program) {
    let mut pushed = Pushed {
        known: program.constants.iter().map(|constant| (constant.reg, constant.bits)).collect(),
        registers: &mut program.registers,
        loaded: HashMap::new(),
        alias: HashMap::new(),
        loads: Vec::new(),
    };
    pushed.block(&mut program.body);
    let loads = pushed.loads;
    program.body.splice(0..0, loads);
}

struct Pushed<'a> {
    known: HashMap<Reg, u64>,
    registers: &'a mut Vec<Register>,
    loaded: HashMap<(u32, Format), Reg>,
    alias: HashMap<Reg, Reg>,
    loads: Vec<Statement>,
}

impl Pushed<'_> {
    fn block(&mut self, block: &mut Block) {
        block.retain_mut(|statement| {
            replace_uses(statement, &self.alias);
            if let Statement::Load { dst, address, format } = statement
                && let Some(start) = self.start(address)
                && let Some(end) = start.checked_add(format.bytes() * dst.len() as u32)
            {
                let places = (start..end).step_by(format.bytes() as usize);
                for (reg, place) in dst.iter().zip(places) {
                    let same = self.load(place, *format);
                    self.alias.insert(*reg, same);
                }
                return false;
            }
            for inner in statement.blocks_mut() {
                self.block(inner);
            }
            true
        });
    }

    /// The constant offset of an access to push constants, if it has one.
    fn start(&self, address: &Address) -> Option<u32> {
        if address.space != Space::PushConstants {
            return None;
        }
        let base = match address.base {
            Some(base) => *self.known.get(&base)?,
            None => 0,
        };
        u32::try_from(base).ok()?.checked_add(address.offset)
    }

    fn load(&mut self, place: u32, format: Format) -> Reg {
        *self.loaded.entry((place, format)).or_insert_with(|| {
            let reg = Reg(self.registers.len() as u32);
            self.registers.push(Register { ty: format.register_type(), role: Role::Value });
            self.loads.push(Statement::Load {
                dst: vec![reg],
                address: Address { space: Space::PushConstants, base: None, offset: place },
                format,
            });
            reg
        })
    }
}

fn replace_uses(statement: &mut Statement, alias: &HashMap<Reg, Reg>) {
    statement.for_each_use(&mut |reg| {
        if let Some(same) = alias.get(reg) {
            *reg = *same;
        }
    });
}

/// Finds loads that an earlier load in the same block has done, with no write to memory in between.
struct Sharing<'a> {
    registers: &'a [Register],
    alias: HashMap<Reg, Reg>,
}

impl Sharing<'_> {
    fn block(&mut self, block: &mut Block) {
        let mut loaded: Vec<(Address, Format, Vec<Reg>)> = Vec::new();
        block.retain_mut(|statement| {
            replace_uses(statement, &self.alias);
            for inner in statement.blocks_mut() {
                self.block(inner);
            }
            match statement {
                Statement::Load { dst, address, format } => {
                    let same = loaded
                        .iter()
                        .find(|(other, of, regs)| other == address && of == format && regs.len() >= dst.len());
                    if let Some((_, _, regs)) = same {
                        self.alias.extend(dst.iter().copied().zip(regs.iter().copied()));
                        return false;
                    }
                    if self.is_fixed(address) {
                        loaded.push((*address, *format, dst.clone()));
                    }
                }
                Statement::Compute { .. } | Statement::Assign { .. } => {}
                // Memory may change here.
                _ => loaded.clear(),
            }
            true
        });
    }

    /// Reports whether an address is computed from values alone.
    fn is_fixed(&self, address: &Address) -> bool {
        let is_value = |reg: Reg| self.registers[reg.0 as usize].role == Role::Value;
        let index = match address.space {
            Space::Buffer(binding) => binding.index,
            _ => None,
        };
        address.base.is_none_or(is_value) && index.is_none_or(is_value)
    }
}

/// Moves computations before the loops in which their operands don't change.
fn move_out_of_loops(block: &mut Block, registers: &[Register]) {
    for mut statement in std::mem::take(block) {
        for inner in statement.blocks_mut() {
            move_out_of_loops(inner, registers);
        }
        if let Statement::Loop { .. } = statement {
            let mut defined = HashSet::new();
            for inner in statement.blocks() {
                collect_definitions(inner, &mut defined);
            }
            for inner in statement.blocks_mut() {
                take_invariant(inner, registers, &mut defined, block);
            }
        }
        block.push(statement);
    }
}

/// Moves statements that read nothing in `defined` from a loop's block to the end of another block.
fn take_invariant(block: &mut Block, registers: &[Register], defined: &mut HashSet<Reg>, before: &mut Block) {
    for statement in std::mem::take(block) {
        let moves = match &statement {
            Statement::Compute { src, .. } => {
                src.iter().all(|reg| registers[reg.0 as usize].role == Role::Value && !defined.contains(reg))
            }
            _ => false,
        };
        if moves {
            for reg in statement.definitions() {
                defined.remove(&reg);
            }
            before.push(statement);
        } else {
            block.push(statement);
        }
    }
}

fn collect_definitions(block: &Block, defined: &mut HashSet<Reg>) {
    for statement in block {
        defined.extend(statement.definitions());
        for inner in statement.blocks() {
            collect_definitions(inner, defined);
        }
    }
}
