//! Loop-invariant code motion, and sharing of repeated loads.

use std::collections::{HashMap, HashSet};

use crate::ir::{Address, Block, Format, Program, Reg, Register, Role, Space, Statement};

/// Moves loop-invariant computations out of loops, and shares repeated loads.
pub fn move_invariants(program: &mut Program) {
    let mut sharing = Sharing { registers: &program.registers, alias: HashMap::new() };
    sharing.block(&mut program.body);
    let moving = Moving { registers: &program.registers, loads: !program.may_wait() };
    moving.out_of_loops(&mut program.body);
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
            statement.replace_uses(&self.alias);
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

/// Moves computations and loads before the loops in which they give the same.
///
/// A load is moved although no lane may reach it: what is out of range is zero, and none of its lanes need be active.
struct Moving<'a> {
    registers: &'a [Register],
    /// True if loads of buffers may be moved: no invocation waits in a loop for what another one stores.
    loads: bool,
}

impl Moving<'_> {
    fn out_of_loops(&self, block: &mut Block) {
        for mut statement in std::mem::take(block) {
            for inner in statement.blocks_mut() {
                self.out_of_loops(inner);
            }
            if let Statement::Loop { .. } = statement {
                let mut defined = HashSet::new();
                statement.collect_definitions(&mut defined);
                let loads = self.loads && !statement.blocks().into_iter().any(writes_buffers);
                for inner in statement.blocks_mut() {
                    self.take_invariant(inner, loads, &mut defined, block);
                }
            }
            block.push(statement);
        }
    }

    /// Moves statements that read nothing in `defined` from a loop's block to the end of another block.
    fn take_invariant(&self, block: &mut Block, loads: bool, defined: &mut HashSet<Reg>, before: &mut Block) {
        let is_invariant = |reg: Reg, defined: &HashSet<Reg>| {
            self.registers[reg.0 as usize].role == Role::Value && !defined.contains(&reg)
        };
        for statement in std::mem::take(block) {
            let moves = match &statement {
                Statement::Compute { src, .. } => src.iter().all(|reg| is_invariant(*reg, defined)),
                Statement::Load { address: Address { space: Space::Buffer(binding), base, .. }, .. } => {
                    loads && [binding.index, *base].into_iter().flatten().all(|reg| is_invariant(reg, defined))
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
}

/// Returns true if statements may write a buffer, by whatever binding, address or texel buffer.
fn writes_buffers(block: &Block) -> bool {
    block.iter().any(|statement| match statement {
        Statement::Store { address, .. } | Statement::Atomic { address, .. } => {
            matches!(address.space, Space::Buffer(_) | Space::Global)
        }
        Statement::ImageWrite(_) | Statement::ImageAtomic(_) => true,
        _ => statement.blocks().into_iter().any(writes_buffers),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::Builder;
    use crate::ir::{AtomicOp, Binding, Label, Rate, Type};

    /// A program that has `before` in front of a loop that loads a word of buffer 3 at an input, and does what `also` says.
    fn program(before: Vec<Statement>, also: Vec<Statement>) -> Program {
        let mut b = Builder::new();
        let place = b.input(0, Type::B32, Rate::Varying);
        b.load(word(3, Some(place)), Format::B32, 1);
        let mut program = b.finish().expect("a valid program");
        let mut body = vec![program.body.remove(0)];
        body.extend(also);
        body.push(Statement::Break(Label(0)));
        program.body.extend(before);
        program.body.push(Statement::Loop { label: Label(0), body, continuing: Vec::new() });
        program
    }

    fn word(slot: u32, base: Option<Reg>) -> Address {
        Address { space: Space::Buffer(Binding::new(slot)), base, offset: 0 }
    }

    /// True if the load is in front of the loop after the pass.
    fn is_moved(mut program: Program) -> bool {
        move_invariants(&mut program);
        program.body.iter().any(|statement| matches!(statement, Statement::Load { .. }))
    }

    #[gaurast_runner::test]
    fn loads_are_moved_out_of_loops_that_write_no_buffer() {
        let store = |space| Statement::Store {
            src: vec![Reg(0)],
            address: Address { space, base: None, offset: 0 },
            format: Format::B32,
        };
        let within = |statement| Statement::Scope { label: Label(1), body: vec![statement] };
        assert!(is_moved(program(vec![], vec![])));
        assert!(is_moved(program(vec![store(Space::Buffer(Binding::new(3)))], vec![])));
        assert!(is_moved(program(vec![], vec![store(Space::Shared)])));
        assert!(!is_moved(program(vec![], vec![store(Space::Buffer(Binding::new(4)))])), "4 may be the same buffer");
        assert!(!is_moved(program(vec![], vec![within(store(Space::Global))])));
    }

    #[gaurast_runner::test]
    fn loads_stay_where_an_invocation_may_wait_for_another() {
        let atomic = Statement::Atomic {
            op: AtomicOp::IAdd,
            dst: None,
            address: word(3, None),
            format: Format::B32,
            value: Reg(0),
            comparator: None,
        };
        assert!(!is_moved(program(vec![atomic], vec![])));
    }

    #[gaurast_runner::test]
    fn loads_at_places_that_the_loop_computes_stay() {
        let mut computed = program(vec![], vec![]);
        let Some(Statement::Loop { body, .. }) = computed.body.last_mut() else { panic!("a loop") };
        let Statement::Load { dst, .. } = &body[0] else { panic!("a load") };
        let place = dst[0];
        let next = Reg(computed.registers.len() as u32);
        computed.registers.push(Register { ty: Type::B32, role: Role::Value });
        body[0] = Statement::Clock { dst: place };
        body.insert(1, Statement::Load { dst: vec![next], address: word(3, Some(place)), format: Format::B32 });
        assert!(!is_moved(computed));
    }
}
