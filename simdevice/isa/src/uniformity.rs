//! Which registers hold the same value in all lanes. Such a register is kept, and computed, once a batch.

use super::ir::{Block, Label, Program, Rate, Reg, Space, Statement};

/// For each register, whether it may differ between lanes of a batch.
///
/// A value is uniform if it is computed from uniform values. A variable is uniform if all that is assigned to it is, and
/// no assignment can be masked for a lane that comes back later: none lies in a branch on a varying condition, or in a
/// construct that some lanes leave before others. (Lanes that return don't come back.)
pub fn varying_registers(program: &Program) -> Vec<bool> {
    let mut search = Search {
        varying: vec![false; program.registers.len()],
        divergent: Vec::new(),
        open: Vec::new(),
        changed: true,
    };
    for input in program
        .inputs
        .iter()
        .filter(|input| input.rate == Rate::Varying)
    {
        search.mark(input.reg);
    }
    for output in &program.outputs {
        search.mark(output.reg);
    }
    while std::mem::take(&mut search.changed) {
        search.block(&program.body);
    }
    search.varying
}

/// A construct around the statement being looked at.
enum Around {
    /// A branch on a varying condition.
    Varying,
    /// One that lanes may leave by name.
    Labelled(Label),
}

struct Search {
    varying: Vec<bool>,
    /// Constructs that some lanes leave before others.
    divergent: Vec<Label>,
    open: Vec<Around>,
    changed: bool,
}

impl Search {
    fn mark(&mut self, reg: Reg) {
        self.changed |= !std::mem::replace(&mut self.varying[reg.0 as usize], true);
    }

    fn is_varying(&self, reg: Reg) -> bool {
        self.varying[reg.0 as usize]
    }

    /// Whether lanes may be inactive here for reasons that lie within the innermost `depth` constructs.
    fn masked_within(&self, depth: usize) -> bool {
        self.open
            .iter()
            .rev()
            .take(depth)
            .any(|around| match around {
                Around::Varying => true,
                Around::Labelled(label) => self.divergent.contains(label),
            })
    }

    fn block(&mut self, block: &Block) {
        block.iter().for_each(|statement| self.statement(statement));
    }

    fn within(&mut self, around: Around, block: &Block) {
        self.open.push(around);
        self.block(block);
        self.open.pop();
    }

    /// A break or continue to `label`: if only some lanes take it, the construct is divergent.
    fn leave(&mut self, label: Label) {
        let depth = self
            .open
            .iter()
            .rev()
            .position(|around| matches!(around, Around::Labelled(open) if *open == label));
        if let Some(depth) = depth
            && self.masked_within(depth)
            && !self.divergent.contains(&label)
        {
            self.divergent.push(label);
            self.changed = true;
        }
    }

    fn statement(&mut self, statement: &Statement) {
        match statement {
            Statement::Assign { dst, src } => {
                if self.is_varying(*src) || self.masked_within(usize::MAX) {
                    self.mark(*dst);
                }
            }
            Statement::If {
                condition,
                then,
                otherwise,
            } => {
                for block in [then, otherwise] {
                    if self.is_varying(*condition) {
                        self.within(Around::Varying, block);
                    } else {
                        self.block(block);
                    }
                }
            }
            Statement::Switch {
                label,
                selector,
                cases,
            } => {
                self.open.push(Around::Labelled(*label));
                for case in cases {
                    if self.is_varying(*selector) {
                        self.within(Around::Varying, &case.body);
                    } else {
                        self.block(&case.body);
                    }
                }
                self.open.pop();
            }
            Statement::Loop {
                label,
                body,
                continuing,
            } => {
                self.within(Around::Labelled(*label), body);
                self.within(Around::Labelled(*label), continuing);
            }
            Statement::Scope { label, body } => self.within(Around::Labelled(*label), body),
            Statement::Break(label) | Statement::Continue(label) => self.leave(*label),
            other => {
                let differs = differs_by_itself(other)
                    || other.uses().into_iter().any(|reg| self.is_varying(reg));
                if differs {
                    other
                        .definitions()
                        .into_iter()
                        .for_each(|reg| self.mark(reg));
                }
            }
        }
    }
}

/// Whether a statement's results may differ between lanes though its operands don't.
fn differs_by_itself(statement: &Statement) -> bool {
    match statement {
        Statement::Load { address, .. } => address.space == Space::Private,
        Statement::Compute { .. } | Statement::BufferSize { .. } | Statement::ImageQuery { .. } => {
            false
        }
        _ => true,
    }
}
