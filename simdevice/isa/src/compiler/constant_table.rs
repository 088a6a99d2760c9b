//! Private memory that is a table of constants.
//!
//! Shaders index constant arrays at run time. Such an array reaches the device as private memory that is filled before
//! it is used. If the program uses private memory for nothing else, one table serves all lanes and batches, and a load
//! from a uniform address is uniform.

use crate::ir::{Address, Block, Format, Program, Reg, Space, Statement};
use std::collections::HashMap;

/// The words of a program's private memory, if it is a table of constants; the stores that fill it are removed then.
pub fn promote_constants(program: &mut Program) -> Option<Vec<u32>> {
    if program.private_bytes == 0 {
        return None;
    }
    let constants = program.constants.iter();
    let mut search = Search {
        known: constants.map(|constant| (constant.reg, constant.bits)).collect(),
        words: vec![0; program.private_bytes as usize / 4],
        filled: false,
    };
    if !search.block(&program.body, true) {
        return None;
    }
    remove_stores(&mut program.body);
    Some(search.words)
}

struct Search {
    known: HashMap<Reg, u64>,
    words: Vec<u32>,
    /// True once stores are no longer allowed: a lane may have loaded, or left.
    filled: bool,
}

impl Search {
    /// Reports whether all stores so far are of constants, by all lanes, and before all loads. `always` says whether
    /// every lane runs the block, once.
    fn block(&mut self, block: &Block, always: bool) -> bool {
        block.iter().all(|statement| self.statement(statement, always))
    }

    fn statement(&mut self, statement: &Statement, always: bool) -> bool {
        match statement {
            Statement::Store { src, address, format } if address.space == Space::Private => {
                always && !self.filled && self.store(src, address, *format).is_some()
            }
            Statement::Scope { body, .. } => self.block(body, always),
            Statement::If { .. } | Statement::Switch { .. } | Statement::Loop { .. } => {
                self.filled = true;
                let blocks = statement.blocks();
                blocks.into_iter().all(|block| self.block(block, false))
            }
            Statement::Load { address, .. } if address.space == Space::Private => {
                self.filled = true;
                true
            }
            Statement::Break(_) | Statement::Continue(_) | Statement::Return | Statement::Kill => {
                self.filled = true;
                true
            }
            _ => true,
        }
    }

    /// Writes a store's values to the table. None if a value or the address isn't constant.
    fn store(&mut self, src: &[Reg], address: &Address, format: Format) -> Option<()> {
        let base = match address.base {
            Some(base) => *self.known.get(&base)?,
            None => 0,
        };
        let start = base.checked_add(u64::from(address.offset))?;
        if format != Format::B32 || !start.is_multiple_of(4) {
            return None;
        }
        let start = usize::try_from(start / 4).ok()?;
        for (index, reg) in src.iter().enumerate() {
            let value = *self.known.get(reg)? as u32;
            *self.words.get_mut(start + index)? = value;
        }
        Some(())
    }
}

fn remove_stores(block: &mut Block) {
    block.retain_mut(|statement| {
        statement.blocks_mut().into_iter().for_each(remove_stores);
        !matches!(statement, Statement::Store { address, .. } if address.space == Space::Private)
    });
}
