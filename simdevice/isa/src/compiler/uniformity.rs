//! Uniformity analysis: finds registers with the same value in all lanes. They are kept, and computed, once a batch.

use super::scopes::{VariableScopes, variable_scopes};
use crate::ir::{Block, Label, Program, Rate, Reg, Space, Statement};

/// The memories that all lanes of a batch share, so that they load the same from one address.
#[derive(Clone, Copy)]
pub struct SameInAllLanes {
    /// Private memory, since it is a table of constants.
    pub private: bool,
    /// Workgroup memory, since the batch is one workgroup.
    pub shared: bool,
}

/// True for each register that may differ between lanes of a batch.
///
/// A value is uniform if it is computed from uniform values. A variable is uniform if every value assigned to it is,
/// and no assignment can be masked for a lane that reads it later. For that, no assignment may lie in a branch on a
/// varying condition within the variable's scope (see [`VariableScopes`]), nor in a construct there that some lanes
/// leave before others and outside which it is read. (Lanes that return don't come back.)
pub fn varying_registers(program: &Program, same: SameInAllLanes) -> Vec<bool> {
    let mut search = Search {
        varying: vec![false; program.registers.len()],
        same,
        scopes: variable_scopes(program),
        left: Vec::new(),
        continued: Vec::new(),
        open: Vec::new(),
        changed: true,
    };
    for input in program.inputs.iter().filter(|input| input.rate == Rate::Varying) {
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

/// A construct around the statement being analysed.
enum Around {
    /// A branch on a varying condition.
    Varying,
    /// A branch on a uniform condition.
    Uniform,
    /// A switch or a scope statement, which lanes may leave by name.
    Labelled(Label),
    /// A loop's body.
    Body(Label),
    /// A loop's continuing part, which runs before the next iteration.
    Continuing(Label),
}

impl Around {
    fn label(&self) -> Option<Label> {
        match self {
            Self::Labelled(label) | Self::Body(label) | Self::Continuing(label) => Some(*label),
            Self::Varying | Self::Uniform => None,
        }
    }
}

struct Search {
    varying: Vec<bool>,
    same: SameInAllLanes,
    scopes: VariableScopes,
    /// Constructs that some lanes break out of before others.
    left: Vec<Label>,
    /// Loops in whose body some lanes continue before others.
    continued: Vec<Label>,
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

    /// Reports whether lanes may be inactive here because of the innermost `depth` constructs.
    fn masked_within(&self, depth: usize) -> bool {
        let mut within = self.open.iter().rev().take(depth);
        within.any(|around| self.masks(around, |label| self.left.contains(&label)))
    }

    /// Reports whether a construct masks its statements. `left` says whether a break of some lanes out of a label
    /// counts.
    fn masks(&self, around: &Around, left: impl Fn(Label) -> bool) -> bool {
        match around {
            Around::Varying => true,
            Around::Uniform => false,
            Around::Labelled(label) | Around::Continuing(label) => left(*label),
            Around::Body(label) => left(*label) || self.continued.contains(label),
        }
    }

    /// Reports whether an assignment here may be masked for a lane that reads the variable later.
    fn assigned_by_some(&self, variable: Reg) -> bool {
        let scope = self.scopes.depth(variable).min(self.open.len());
        // Within a loop, lanes return to statements that they have left.
        let mut repeated = false;
        self.open[scope..].iter().any(|around| {
            let masked = self.masks(around, |label| {
                let read_later = repeated || self.scopes.is_read_outside(variable, label);
                self.left.contains(&label) && read_later
            });
            repeated |= matches!(around, Around::Body(_) | Around::Continuing(_));
            masked
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

    /// Reports whether only some lanes of the construct reach this place, where they leave it.
    fn diverges(&self, label: Label) -> bool {
        let mut around = self.open.iter().rev();
        let depth = around.position(|around| around.label() == Some(label));
        depth.is_some_and(|depth| self.masked_within(depth))
    }

    fn statement(&mut self, statement: &Statement) {
        match statement {
            Statement::Assign { dst, src } => {
                if self.is_varying(*src) || self.assigned_by_some(*dst) {
                    self.mark(*dst);
                }
            }
            Statement::If { condition, then, otherwise } => {
                for block in [then, otherwise] {
                    let around = self.branch(*condition);
                    self.within(around, block);
                }
            }
            Statement::Switch { label, selector, cases } => {
                self.open.push(Around::Labelled(*label));
                for case in cases {
                    let around = self.branch(*selector);
                    self.within(around, &case.body);
                }
                self.open.pop();
            }
            Statement::Loop { label, body, continuing } => {
                self.within(Around::Body(*label), body);
                self.within(Around::Continuing(*label), continuing);
            }
            Statement::Scope { label, body } => self.within(Around::Labelled(*label), body),
            Statement::Break(label) => {
                // Lanes that continued early are not active here, so those that break here leave before them.
                let diverges = self.diverges(*label) || self.continued.contains(label);
                if diverges && !self.left.contains(label) {
                    self.left.push(*label);
                    self.changed = true;
                }
            }
            Statement::Continue(label) => {
                if self.diverges(*label) && !self.continued.contains(label) {
                    self.continued.push(*label);
                    self.changed = true;
                }
            }
            other => {
                let differs = self.differs_by_itself(other) || other.uses().into_iter().any(|reg| self.is_varying(reg));
                if differs {
                    other.definitions().into_iter().for_each(|reg| self.mark(reg));
                }
            }
        }
    }

    fn branch(&self, condition: Reg) -> Around {
        if self.is_varying(condition) { Around::Varying } else { Around::Uniform }
    }

    /// Reports whether a statement's results may differ between lanes even if its operands don't.
    fn differs_by_itself(&self, statement: &Statement) -> bool {
        match statement {
            Statement::Load { address, .. } => match address.space {
                Space::Private => !self.same.private,
                Space::Shared => !self.same.shared,
                Space::Buffer(_) | Space::PushConstants | Space::Global => false,
            },
            Statement::Compute { .. }
            | Statement::Clock { .. }
            | Statement::BufferSize { .. }
            | Statement::ImageQuery { .. } => false,
            _ => true,
        }
    }
}
