//! Linearizes a program's tree of statements to steps, with masks made explicit.

use std::collections::{HashMap, HashSet};

use super::allocate::Allocation;
use super::scopes::loop_private_variables;
use super::step::{MaskId, RunCost, Step, Target};
use crate::ir::op::{Kind, Op};
use crate::ir::{Block, Case, Label, Program, Reg, Statement, Type, contains};
use crate::kernels::registers::RegisterSlot;

/// The linear form of a program: its steps, masks and costs.
pub struct Linearized {
    /// The steps; the last is [`Step::End`].
    pub steps: Vec<Step>,
    /// The number of masks.
    pub masks: usize,
    /// The cost of each counted run.
    pub runs: Vec<RunCost>,
}

/// Linearizes a valid program. `count` says whether to count the work.
pub fn linearize(program: &Program, allocation: &Allocation, count: bool) -> Linearized {
    let mut linearizer = Linearizer {
        program,
        allocation,
        count,
        steps: Vec::new(),
        marks: Vec::new(),
        free_mask: MaskId::FIRST_FREE,
        masks: usize::from(MaskId::FIRST_FREE),
        constructs: HashMap::new(),
        runs: Vec::new(),
        run: None,
        loop_private: loop_private_variables(program),
        unmasked: HashSet::new(),
        uses: count_uses(program),
    };
    let end = linearizer.mark();
    linearizer.block(&program.body, end);
    linearizer.place(end);
    linearizer.steps.push(Step::End);
    linearizer.patch_targets()
}

/// A jump target that isn't known yet: an index into the marks.
type Mark = u32;

/// The exits of a construct: the masks of the lanes that leave it.
#[derive(Clone, Copy)]
struct Exits {
    breaks: MaskId,
    continues: Option<MaskId>,
}

struct Linearizer<'a> {
    program: &'a Program,
    allocation: &'a Allocation,
    count: bool,
    steps: Vec<Step>,
    /// The step of each mark.
    marks: Vec<Target>,
    free_mask: u16,
    masks: usize,
    constructs: HashMap<Label, Exits>,
    runs: Vec<RunCost>,
    /// The counted run to which instructions are being added.
    run: Option<usize>,
    /// Variables that only a loop reads, by the loop's label.
    loop_private: HashMap<Label, HashSet<Reg>>,
    /// Variables that can be assigned without a mask at this place.
    unmasked: HashSet<Reg>,
    /// The number of reads of each register.
    uses: Vec<u32>,
}

impl Linearizer<'_> {
    fn mark(&mut self) -> Mark {
        self.marks.push(0);
        (self.marks.len() - 1) as Mark
    }

    fn place(&mut self, mark: Mark) {
        self.marks[mark as usize] = self.steps.len() as Target;
        self.run = None;
    }

    /// Appends a step of control flow.
    fn control(&mut self, step: Step) {
        self.steps.push(step);
        self.run = None;
    }

    /// Appends an instruction and counts it.
    fn instruction(&mut self, step: Step, kind: Kind, uniform: bool) {
        if self.count {
            let run = match self.run {
                Some(run) => run,
                None => {
                    self.steps.push(Step::Count(self.runs.len() as u32));
                    self.runs.push(RunCost::default());
                    *self.run.insert(self.runs.len() - 1)
                }
            };
            let cost = &mut self.runs[run];
            let counts = if uniform { &mut cost.uniform } else { &mut cost.varying };
            counts[kind as usize] += 1;
        }
        self.steps.push(step);
    }

    fn take_mask(&mut self) -> MaskId {
        let mask = MaskId(self.free_mask);
        self.free_mask += 1;
        self.masks = self.masks.max(usize::from(self.free_mask));
        mask
    }

    fn slot(&self, reg: Reg) -> RegisterSlot {
        self.allocation.slots[reg.0 as usize]
    }

    fn ty(&self, reg: Reg) -> Type {
        self.program.registers[reg.0 as usize].ty
    }

    /// Replaces the marks in jumps by their steps.
    fn patch_targets(mut self) -> Linearized {
        for step in &mut self.steps {
            if let Some(target) = step.target_mut() {
                *target = self.marks[*target as usize];
            }
        }
        Linearized { steps: self.steps, masks: self.masks, runs: self.runs }
    }

    /// Linearizes a block. `empty` is the jump target when no lane is active: before, or at, a place where lanes are
    /// activated again.
    fn block(&mut self, block: &Block, empty: Mark) {
        let unmasked = std::mem::take(&mut self.unmasked);
        self.block_of_loop(block, empty, unmasked);
    }

    /// Linearizes a block that some lanes skip. They may read any variable after it.
    fn block_of_some_lanes(&mut self, block: &Block, empty: Mark) {
        self.block_of_loop(block, empty, HashSet::new());
    }

    /// Linearizes a block in which some variables can be assigned without a mask.
    fn block_of_loop(&mut self, block: &Block, empty: Mark, unmasked: HashSet<Reg>) {
        let mut rest = block.iter().peekable();
        while let Some(statement) = rest.next() {
            let outer = std::mem::replace(&mut self.unmasked, unmasked.clone());
            if let Some(assign) = rest.next_if(|next| self.is_assigned_at_once(statement, next)) {
                self.compute_and_assign(statement, assign);
            } else {
                self.statement(statement, empty);
            }
            self.unmasked = outer;
            if leaves(statement) {
                break;
            }
        }
    }

    /// Reports whether a computation's only use is the assignment that follows it.
    fn is_assigned_at_once(&self, statement: &Statement, next: &Statement) -> bool {
        match (statement, next) {
            (Statement::Compute { dst: value, .. }, Statement::Assign { dst, src }) => {
                let same_kind = self.slot(*dst).is_varying() == self.slot(*value).is_varying();
                value == src && same_kind && self.uses[value.0 as usize] == 1
            }
            _ => false,
        }
    }

    fn compute_and_assign(&mut self, compute: &Statement, assign: &Statement) {
        let (Statement::Compute { op, dst: value, src }, Statement::Assign { dst, .. }) = (compute, assign) else {
            return;
        };
        let (to, temporary) = (self.slot(*dst), self.slot(*value));
        let src = self.operands(src);
        let step = if self.unmasked.contains(dst) || !to.is_varying() {
            Step::Compute { op: *op, dst: to, src }
        } else {
            Step::ComputeAssign { op: *op, dst: to, temporary, src }
        };
        self.instruction(step, op.kind(), !to.is_varying());
    }

    fn operands(&self, src: &[Reg]) -> [RegisterSlot; 4] {
        let mut slots = [RegisterSlot::ZERO; 4];
        for (slot, reg) in slots.iter_mut().zip(src) {
            *slot = self.slot(*reg);
        }
        slots
    }

    fn statement(&mut self, statement: &Statement, empty: Mark) {
        match statement {
            Statement::Compute { op, dst, src } => self.compute(*op, *dst, src),
            Statement::Assign { dst, src } => {
                let (to, from, ty) = (self.slot(*dst), self.slot(*src), self.ty(*dst));
                let step = if self.unmasked.contains(dst) {
                    Step::Copy { dst: to, src: from, ty }
                } else {
                    Step::Assign { dst: to, src: from, ty }
                };
                self.instruction(step, Kind::Move, !to.is_varying());
            }
            Statement::If { condition, then, otherwise } => self.branch(*condition, then, otherwise, empty),
            Statement::Switch { label, selector, cases } => self.switch(*label, *selector, cases, empty),
            Statement::Loop { label, body, continuing } => self.repeat(*label, body, continuing, empty),
            Statement::Scope { label, body } => self.scope(*label, body, empty),
            Statement::Break(_) | Statement::Continue(_) | Statement::Return => {
                let into = self.exit(statement);
                self.control(Step::Leave { into, target: empty });
            }
            Statement::Kill => self.control(Step::Kill(empty)),
            Statement::Demote => self.control(Step::Demote),
            Statement::Barrier => {}
            other => {
                let uniform = other.definitions().first().is_some_and(|reg| !self.slot(*reg).is_varying());
                self.instruction(Step::Other(Box::new(other.clone())), kind_of(other), uniform);
            }
        }
    }

    fn compute(&mut self, op: Op, dst: Reg, src: &[Reg]) {
        let (dst, src) = (self.slot(dst), self.operands(src));
        self.instruction(Step::Compute { op, dst, src }, op.kind(), !dst.is_varying());
    }

    /// The mask that collects the lanes which leave by this statement.
    fn exit(&self, statement: &Statement) -> MaskId {
        match statement {
            Statement::Break(label) => self.constructs.get(label).map_or(MaskId::DONE, |exits| exits.breaks),
            Statement::Continue(label) => {
                self.constructs.get(label).and_then(|exits| exits.continues).unwrap_or(MaskId::DONE)
            }
            _ => MaskId::DONE,
        }
    }

    fn branch(&mut self, condition: Reg, then: &Block, otherwise: &Block, empty: Mark) {
        let condition = self.slot(condition);
        if !condition.is_varying() {
            let (other, end) = (self.mark(), self.mark());
            self.control(Step::Unless { condition, target: other });
            self.block(then, empty);
            if !otherwise.is_empty() && !then.last().is_some_and(leaves) {
                self.control(Step::Jump(end));
            }
            self.place(other);
            self.block(otherwise, empty);
            self.place(end);
            return;
        }
        match (then.as_slice(), otherwise.as_slice()) {
            ([exit @ (Statement::Break(_) | Statement::Continue(_) | Statement::Return)], _) => {
                let into = self.exit(exit);
                self.control(Step::LeaveIf { condition, when: true, into, target: empty });
                self.block(otherwise, empty);
            }
            (_, [exit @ (Statement::Break(_) | Statement::Continue(_) | Statement::Return)]) => {
                let into = self.exit(exit);
                self.control(Step::LeaveIf { condition, when: false, into, target: empty });
                self.block(then, empty);
            }
            _ => self.divergent_branch(condition, then, otherwise, empty),
        }
    }

    fn divergent_branch(&mut self, condition: RegisterSlot, then: &Block, otherwise: &Block, empty: Mark) {
        let saved = self.free_mask;
        let other = self.take_mask();
        let (at_else, end) = (self.mark(), self.mark());
        self.control(Step::If { condition, other, target: at_else });
        self.block_of_some_lanes(then, at_else);
        self.place(at_else);
        if !otherwise.is_empty() {
            self.control(Step::Else { other, target: end });
            self.block_of_some_lanes(otherwise, end);
        }
        self.place(end);
        self.control(Step::Join { mask: other, target: empty });
        self.free_mask = saved;
    }

    fn repeat(&mut self, label: Label, body: &Block, continuing: &Block, empty: Mark) {
        let saved = self.free_mask;
        let breaks = self.take_mask();
        let continues = contains(body, &Statement::Continue(label)).then(|| self.take_mask());
        self.constructs.insert(label, Exits { breaks, continues });
        let (head, at_continuing, end) = (self.mark(), self.mark(), self.mark());
        self.control(Step::Clear(breaks));
        self.place(head);
        if let Some(continues) = continues {
            self.control(Step::Clear(continues));
        }
        // Statements must not run without lanes: they would still set uniform registers.
        let back = if continues.is_some() { at_continuing } else { end };
        // Lanes that continue early must keep the values that they have then.
        let private = self.loop_private.remove(&label).unwrap_or_default();
        let in_body = if continues.is_some() { HashSet::new() } else { private.clone() };
        self.block_of_loop(body, back, in_body);
        self.place(at_continuing);
        if let Some(mask) = continues {
            self.control(Step::Join { mask, target: end });
        }
        self.block_of_loop(continuing, end, private);
        self.place(end);
        self.control(Step::Repeat(head));
        self.control(Step::Join { mask: breaks, target: empty });
        self.free_mask = saved;
    }

    fn scope(&mut self, label: Label, body: &Block, empty: Mark) {
        let saved = self.free_mask;
        let breaks = self.take_mask();
        self.constructs.insert(label, Exits { breaks, continues: None });
        let end = self.mark();
        self.control(Step::Clear(breaks));
        self.block_of_some_lanes(body, end);
        self.place(end);
        self.control(Step::Join { mask: breaks, target: empty });
        self.free_mask = saved;
    }

    fn switch(&mut self, label: Label, selector: Reg, cases: &[Case], empty: Mark) {
        let saved = self.free_mask;
        let [entered, unmatched, breaks] = [self.take_mask(), self.take_mask(), self.take_mask()];
        self.constructs.insert(label, Exits { breaks, continues: None });
        let selector = self.slot(selector);
        let values = cases.iter().flat_map(|case| case.values.iter().copied()).collect();
        self.control(Step::Clear(breaks));
        self.control(Step::Switch { selector, values, entered, unmatched });
        let end = self.mark();
        for (index, case) in cases.iter().enumerate() {
            let next = self.mark();
            self.control(Step::Case {
                selector,
                values: case.values.as_slice().into(),
                entered,
                unmatched: case.default.then_some(unmatched),
                target: next,
            });
            self.block_of_some_lanes(&case.body, next);
            let falls = case.fallthrough && index + 1 < cases.len();
            if !falls && !case.body.last().is_some_and(leaves) {
                self.control(Step::Leave { into: breaks, target: next });
            }
            self.place(next);
        }
        if !cases.iter().any(|case| case.default) {
            self.control(Step::Join { mask: unmatched, target: end });
        }
        self.place(end);
        self.control(Step::Join { mask: breaks, target: empty });
        self.free_mask = saved;
    }
}

/// Reports whether no lane goes on after a statement.
fn leaves(statement: &Statement) -> bool {
    matches!(statement, Statement::Break(_) | Statement::Continue(_) | Statement::Return | Statement::Kill)
}

/// The number of reads of each register.
fn count_uses(program: &Program) -> Vec<u32> {
    fn count(block: &Block, uses: &mut [u32]) {
        for statement in block {
            statement.uses().into_iter().for_each(|reg| uses[reg.0 as usize] += 1);
            statement.blocks().into_iter().for_each(|block| count(block, uses));
        }
    }
    let mut uses = vec![0; program.registers.len()];
    count(&program.body, &mut uses);
    uses
}

/// The kind of a statement that isn't arithmetic.
fn kind_of(statement: &Statement) -> Kind {
    match statement {
        Statement::Compute { op, .. } => op.kind(),
        Statement::Assign { .. }
        | Statement::LaneIndex { .. }
        | Statement::IsHelper { .. }
        | Statement::Clock { .. } => Kind::Move,
        Statement::Load { .. } | Statement::Store { .. } | Statement::BufferSize { .. } => Kind::Memory,
        Statement::Atomic { .. } => Kind::Atomic,
        Statement::Sample(_)
        | Statement::ImageRead(_)
        | Statement::ImageWrite(_)
        | Statement::ImageAtomic(_)
        | Statement::ImageQuery { .. } => Kind::Image,
        Statement::Derivative { .. } | Statement::Subgroup { .. } => Kind::CrossLane,
        _ => Kind::Control,
    }
}
