//! Programs that may wait for other workgroups.

use super::memory::{Binding, Space};
use super::statement::{Block, Statement};

/// The accesses of a program to memory that other workgroups see.
#[derive(Default)]
pub(super) struct Accesses {
    /// Buffers that are read in a loop, by their first bind point and count.
    read_in_loops: Vec<(u32, u32)>,
    written: Vec<(u32, u32)>,
    reads_addresses_in_loops: bool,
    writes_addresses: bool,
    reads_images_in_loops: bool,
    writes_images: bool,
    /// Atomics on memory that other workgroups see.
    pub(super) has_atomics: bool,
}

impl Accesses {
    /// The accesses of a program's `body`.
    pub(super) fn of(body: &Block) -> Self {
        let mut found = Self::default();
        found.visit(body, false);
        found
    }

    /// True if a loop may read what an invocation of another workgroup writes.
    pub(super) fn may_see_writes(&self) -> bool {
        let overlap = |&(a, count_a): &(u32, u32)| {
            self.written.iter().any(|&(b, count_b)| a < b.saturating_add(count_b) && b < a.saturating_add(count_a))
        };
        self.read_in_loops.iter().any(overlap)
            || self.reads_images_in_loops && self.writes_images
            || self.writes_addresses && (self.reads_addresses_in_loops || !self.read_in_loops.is_empty())
            || self.reads_addresses_in_loops && !self.written.is_empty()
    }

    fn visit(&mut self, block: &Block, in_loop: bool) {
        let of = |binding: &Binding| (binding.slot, binding.count);
        for statement in block {
            match statement {
                Statement::Load { address, .. } if in_loop => match &address.space {
                    Space::Buffer(binding) => self.read_in_loops.push(of(binding)),
                    Space::Global => self.reads_addresses_in_loops = true,
                    Space::PushConstants | Space::Shared | Space::Private => {}
                },
                Statement::Store { address, .. } => match &address.space {
                    Space::Buffer(binding) => self.written.push(of(binding)),
                    Space::Global => self.writes_addresses = true,
                    Space::PushConstants | Space::Shared | Space::Private => {}
                },
                Statement::ImageRead(_) | Statement::Sample(_) if in_loop => self.reads_images_in_loops = true,
                Statement::ImageWrite(_) => self.writes_images = true,
                Statement::Atomic { address, .. } => self.has_atomics |= address.space != Space::Shared,
                Statement::ImageAtomic(_) => self.has_atomics = true,
                _ => {}
            }
            let in_loop = in_loop || matches!(statement, Statement::Loop { .. });
            statement.blocks().into_iter().for_each(|block| self.visit(block, in_loop));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::Builder;
    use crate::ir::{Address, Format, Label, Program, Rate, Type};

    /// A program that reads a buffer, in a loop or before it, and writes a buffer, by coherent accesses.
    fn program(in_loop: bool, read: u32, written: u32) -> Program {
        let mut b = Builder::new();
        let x = b.input(0, Type::B32, Rate::Varying);
        let at = |slot| Address { space: Space::Buffer(Binding::new(slot)), base: None, offset: 0 };
        b.load(at(read), Format::B32, 1);
        b.store(at(written), Format::B32, &[x]);
        let mut program = b.finish().expect("a valid program");
        program.has_coherent_accesses = true;
        if in_loop {
            let load = program.body.remove(0);
            let body = vec![load, Statement::Break(Label(0))];
            program.body.push(Statement::Loop { label: Label(0), body, continuing: Vec::new() });
        }
        program
    }

    #[gaurast_runner::test]
    fn reading_what_is_written_in_a_loop_may_be_waiting() {
        assert!(program(true, 3, 3).may_wait());
        assert!(!program(true, 3, 4).may_wait());
        assert!(!program(false, 3, 3).may_wait());
        assert!(!Program { has_coherent_accesses: false, ..program(true, 3, 3) }.may_wait());
    }
}
