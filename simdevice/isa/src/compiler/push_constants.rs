//! Loads of push constants, which a program can't write.

use std::collections::HashMap;

use crate::ir::{Address, Block, Format, Program, Reg, Register, Role, Space, Statement};

/// Loads each push constant at a constant offset once, at the beginning.
pub fn load_once(program: &mut Program) {
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
            statement.replace_uses(&self.alias);
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
