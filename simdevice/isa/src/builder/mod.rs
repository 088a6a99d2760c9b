//! Builds programs: a cursor in a tree of blocks, with a method for each statement.

mod loop_exits;

use std::collections::HashMap;

use crate::ir::op::Op;
use crate::ir::validate::{self, InvalidProgram};
use crate::ir::{
    Address, AtomicOp, Axis, Binding, Block, Case, Constant, Format, Input, Label, MAX_NESTING, Output, Program, Rate,
    Reg, Register, Role, Statement, SubgroupOp, Type,
};

/// Builds a [`Program`], statement by statement.
///
/// Constructs are opened with `begin_*` and closed with [`Builder::end`]; what is appended in between lies within
/// them. Misuse (closing what isn't open, operands of a wrong type) is reported by [`Builder::finish`], not by a panic.
///
/// ```
/// use isa::{builder::Builder, ir::{Rate, Type}, op::Op};
///
/// // out = x < 1 ? x : x * x, the long way round.
/// let mut b = Builder::new();
/// let x = b.input(0, Type::B32, Rate::Varying);
/// let out = b.output(0, Type::B32);
/// let one = b.f32(1.0);
/// let small = b.compute(Op::FLt, &[x, one]);
/// b.begin_if(small);
/// b.assign(out, x);
/// b.begin_else();
/// let square = b.compute(Op::FMul, &[x, x]);
/// b.assign(out, square);
/// b.end();
/// let program = b.finish().unwrap();
/// println!("{program}");
/// ```
#[derive(Debug, Default)]
pub struct Builder {
    program: Program,
    constants: HashMap<(Type, u64), Reg>,
    open: Vec<Frame>,
    labels: u32,
    misuse: Option<InvalidProgram>,
}

/// A construct being built, with the statements that were before it in its block.
#[derive(Debug)]
struct Frame {
    before: Block,
    construct: Construct,
}

/// A construct that was closed, with the block that was built in it last.
struct Closed {
    frame: Frame,
    block: Block,
}

#[derive(Debug)]
enum Construct {
    Then {
        condition: Reg,
    },
    Else {
        condition: Reg,
        then: Block,
    },
    LoopBody {
        label: Label,
    },
    LoopContinuing {
        label: Label,
        body: Block,
    },
    /// Cases so far; the block being built belongs to the last one.
    Switch {
        label: Label,
        selector: Reg,
        cases: Vec<Case>,
    },
    Scope {
        label: Label,
    },
}

impl Builder {
    /// An empty program.
    pub fn new() -> Self {
        Self::default()
    }

    /// A new value register, to be defined by a [`Builder::statement`].
    pub fn value(&mut self, ty: Type) -> Reg {
        self.register(ty, Role::Value)
    }

    /// A new variable.
    pub fn variable(&mut self, ty: Type) -> Reg {
        self.register(ty, Role::Variable)
    }

    /// The type of a register of this builder; `B32` for one that isn't.
    pub fn type_of(&self, reg: Reg) -> Type {
        self.program.registers.get(reg.0 as usize).map_or(Type::B32, |register| register.ty)
    }

    /// A constant of any type; see [`Constant::bits`]. Equal constants share a register.
    pub fn constant(&mut self, ty: Type, bits: u64) -> Reg {
        if let Some(reg) = self.constants.get(&(ty, bits)) {
            return *reg;
        }
        let reg = self.value(ty);
        self.program.constants.push(Constant { reg, bits });
        self.constants.insert((ty, bits), reg);
        reg
    }

    /// A `B32` constant.
    pub fn u32(&mut self, value: u32) -> Reg {
        self.constant(Type::B32, u64::from(value))
    }

    /// A `B32` constant.
    pub fn i32(&mut self, value: i32) -> Reg {
        self.u32(value.cast_unsigned())
    }

    /// A `B32` constant.
    pub fn f32(&mut self, value: f32) -> Reg {
        self.u32(value.to_bits())
    }

    /// A `B64` constant.
    pub fn u64(&mut self, value: u64) -> Reg {
        self.constant(Type::B64, value)
    }

    /// A `B64` constant.
    pub fn f64(&mut self, value: f64) -> Reg {
        self.u64(value.to_bits())
    }

    /// A `Bool` constant.
    pub fn bool(&mut self, value: bool) -> Reg {
        self.constant(Type::Bool, u64::from(value))
    }

    /// Declares an input. A slot can be declared once.
    pub fn input(&mut self, slot: u32, ty: Type, rate: Rate) -> Reg {
        let reg = self.value(ty);
        self.program.inputs.push(Input { slot, reg, rate });
        reg
    }

    /// Declares an output, a variable. A slot can be declared once.
    pub fn output(&mut self, slot: u32, ty: Type) -> Reg {
        let reg = self.variable(ty);
        self.program.outputs.push(Output { slot, reg });
        reg
    }

    /// Reserves workgroup memory and returns its byte offset. `align` is a power of two.
    pub fn allocate_shared(&mut self, bytes: u32, align: u32) -> u32 {
        allocate(&mut self.program.shared_bytes, bytes, align)
    }

    /// Makes all workgroup memory that is reserved until now such that the caller sets it before each batch.
    pub fn preload_shared(&mut self) {
        self.program.preloaded_bytes = self.program.shared_bytes;
    }

    /// Reserves private memory of each lane and returns its byte offset, a multiple of 4. 64-bit elements need no more.
    pub fn allocate_private(&mut self, bytes: u32) -> u32 {
        allocate(&mut self.program.private_bytes, bytes.saturating_add(3) & !3, 4)
    }

    /// Appends a statement unchanged.
    pub fn statement(&mut self, statement: Statement) {
        self.program.body.push(statement);
    }

    /// Appends `op(src...)` and returns its value.
    pub fn compute(&mut self, op: Op, src: &[Reg]) -> Reg {
        let dst = self.value(op.signature().result_type);
        self.statement(Statement::Compute { op, dst, src: src.to_vec() });
        dst
    }

    /// `dst = src` in the active lanes.
    pub fn assign(&mut self, dst: Reg, src: Reg) {
        self.statement(Statement::Assign { dst, src });
    }

    /// The lane's index in the batch.
    pub fn lane_index(&mut self) -> Reg {
        let dst = self.value(Type::B32);
        self.statement(Statement::LaneIndex { dst });
        dst
    }

    /// Reports whether the lane is a helper.
    pub fn is_helper(&mut self) -> Reg {
        let dst = self.value(Type::Bool);
        self.statement(Statement::IsHelper { dst });
        dst
    }

    /// The host's time in nanoseconds.
    pub fn clock(&mut self) -> Reg {
        let dst = self.value(Type::B64);
        self.statement(Statement::Clock { dst });
        dst
    }

    /// Loads `count` consecutive elements.
    pub fn load(&mut self, address: Address, format: Format, count: usize) -> Vec<Reg> {
        let dst: Vec<Reg> = (0..count).map(|_| self.value(format.register_type())).collect();
        self.statement(Statement::Load { dst: dst.clone(), address, format });
        dst
    }

    /// Stores consecutive elements.
    pub fn store(&mut self, address: Address, format: Format, src: &[Reg]) {
        self.statement(Statement::Store { src: src.to_vec(), address, format });
    }

    /// A read-modify-write; returns the old value.
    pub fn atomic(
        &mut self,
        op: AtomicOp,
        address: Address,
        format: Format,
        value: Reg,
        comparator: Option<Reg>,
    ) -> Reg {
        let dst = self.value(format.register_type());
        self.statement(Statement::Atomic { op, dst: Some(dst), address, format, value, comparator });
        dst
    }

    /// The size in bytes of a buffer.
    pub fn buffer_size(&mut self, buffer: Binding) -> Reg {
        let dst = self.value(Type::B32);
        self.statement(Statement::BufferSize { dst, buffer });
        dst
    }

    /// A derivative.
    pub fn derivative(&mut self, src: Reg, axis: Axis, fine: bool) -> Reg {
        let dst = self.value(Type::B32);
        self.statement(Statement::Derivative { dst, src, axis, fine });
        dst
    }

    /// A subgroup operation with one result; a ballot is [`Builder::ballot`].
    pub fn subgroup(&mut self, op: SubgroupOp, src: Option<Reg>, index: Option<Reg>) -> Reg {
        let ty = match op {
            SubgroupOp::Elect | SubgroupOp::All | SubgroupOp::Any | SubgroupOp::AllEqual => Type::Bool,
            _ => src.map_or(Type::B32, |src| self.type_of(src)),
        };
        let dst = self.value(ty);
        self.statement(Statement::Subgroup { op, dst: vec![dst], src, index });
        dst
    }

    /// The four words of a ballot.
    pub fn ballot(&mut self, src: Reg) -> [Reg; 4] {
        let dst = std::array::from_fn(|_| self.value(Type::B32));
        self.statement(Statement::Subgroup { op: SubgroupOp::Ballot, dst: dst.to_vec(), src: Some(src), index: None });
        dst
    }

    /// A barrier.
    pub fn barrier(&mut self) {
        self.statement(Statement::Barrier);
    }

    /// Opens the branch that lanes with true take.
    pub fn begin_if(&mut self, condition: Reg) {
        self.push(Construct::Then { condition });
    }

    /// Closes the branch of lanes with true and opens that of lanes with false. Optional.
    pub fn begin_else(&mut self) {
        match self.pop() {
            Some(Closed { frame: Frame { before, construct: Construct::Then { condition } }, block: then }) => {
                self.open.push(Frame { before, construct: Construct::Else { condition, then } });
            }
            other => self.reopen(other, "else without an open if"),
        }
    }

    /// Opens the body of a loop.
    pub fn begin_loop(&mut self) -> Label {
        let label = self.label();
        self.push(Construct::LoopBody { label });
        label
    }

    /// Closes the body and opens what is done before the next iteration. Optional.
    pub fn begin_continuing(&mut self) {
        match self.pop() {
            Some(Closed { frame: Frame { before, construct: Construct::LoopBody { label } }, block: body }) => {
                self.open.push(Frame { before, construct: Construct::LoopContinuing { label, body } });
            }
            other => self.reopen(other, "continuing without an open loop body"),
        }
    }

    /// Opens a switch; a [`Builder::begin_case`] must follow.
    pub fn begin_switch(&mut self, selector: Reg) -> Label {
        let label = self.label();
        self.push(Construct::Switch { label, selector, cases: Vec::new() });
        label
    }

    /// Closes the previous case, if any, and opens one for these values, and for all others if `default`.
    pub fn begin_case(&mut self, values: &[u32], default: bool) {
        match self.pop() {
            Some(Closed {
                frame: Frame { before, construct: Construct::Switch { label, selector, mut cases } },
                block: body,
            }) => {
                close_case(&mut cases, body);
                cases.push(Case { values: values.to_vec(), default, body: Vec::new(), fallthrough: false });
                self.open.push(Frame { before, construct: Construct::Switch { label, selector, cases } });
            }
            other => self.reopen(other, "case without an open switch"),
        }
    }

    /// Lanes at the end of the case being built go on in the next one.
    pub fn fall_through(&mut self) {
        if let Some(Frame { construct: Construct::Switch { cases, .. }, .. }) = self.open.last_mut()
            && let Some(case) = cases.last_mut()
        {
            case.fallthrough = true;
        } else {
            self.misuse("fall through outside a case");
        }
    }

    /// Opens statements that a break may leave early.
    pub fn begin_scope(&mut self) -> Label {
        let label = self.label();
        self.push(Construct::Scope { label });
        label
    }

    /// Closes the innermost open construct.
    pub fn end(&mut self) {
        let Some(Closed { frame: Frame { before, construct }, block }) = self.pop() else {
            self.misuse("end without an open construct");
            return;
        };
        self.program.body = before;
        self.statement(match construct {
            Construct::Then { condition } => Statement::If { condition, then: block, otherwise: Vec::new() },
            Construct::Else { condition, then } => Statement::If { condition, then, otherwise: block },
            Construct::LoopBody { label } => Statement::Loop { label, body: block, continuing: Vec::new() },
            Construct::LoopContinuing { label, body } => Statement::Loop { label, body, continuing: block },
            Construct::Switch { label, selector, mut cases } => {
                close_case(&mut cases, block);
                Statement::Switch { label, selector, cases }
            }
            Construct::Scope { label } => Statement::Scope { label, body: block },
        });
    }

    /// Leaves the open loop, switch or scope of that label.
    pub fn break_to(&mut self, label: Label) {
        self.statement(Statement::Break(label));
    }

    /// Goes on to the continuing part of the open loop of that label.
    pub fn continue_to(&mut self, label: Label) {
        self.statement(Statement::Continue(label));
    }

    /// Ends the active lanes.
    pub fn ret(&mut self) {
        self.statement(Statement::Return);
    }

    /// Ends the active lanes and marks them killed.
    pub fn kill(&mut self) {
        self.statement(Statement::Kill);
    }

    /// Turns the active lanes into helpers and marks them killed.
    pub fn demote(&mut self) {
        self.statement(Statement::Demote);
    }

    /// Returns the program, validated.
    ///
    /// Values that are used outside the loop that defines them become variables here, so that each lane keeps the
    /// value of its own last iteration.
    ///
    /// # Errors
    /// The first misuse of the builder, or what [`validate::validate`] finds.
    pub fn finish(self) -> Result<Program, InvalidProgram> {
        let mut program = self.finish_as_written()?;
        loop_exits::keep_escaping_values(&mut program);
        validate::validate(&program)?;
        Ok(program)
    }

    /// The program as it was built, closed but not checked.
    pub(crate) fn finish_as_written(self) -> Result<Program, InvalidProgram> {
        if let Some(misuse) = self.misuse {
            return Err(misuse);
        }
        if !self.open.is_empty() {
            return Err(InvalidProgram::Structure { problem: "a construct is still open at the end" });
        }
        Ok(self.program)
    }

    fn register(&mut self, ty: Type, role: Role) -> Reg {
        let reg = Reg(self.program.registers.len() as u32);
        self.program.registers.push(Register { ty, role });
        reg
    }

    fn label(&mut self) -> Label {
        self.labels += 1;
        Label(self.labels - 1)
    }

    fn misuse(&mut self, problem: &'static str) {
        self.misuse.get_or_insert(InvalidProgram::Structure { problem });
    }

    fn push(&mut self, construct: Construct) {
        if self.open.len() >= MAX_NESTING {
            self.misuse("constructs are nested too deeply");
            return;
        }
        let before = std::mem::take(&mut self.program.body);
        self.open.push(Frame { before, construct });
    }

    /// Closes the innermost construct.
    fn pop(&mut self) -> Option<Closed> {
        let frame = self.open.pop()?;
        Some(Closed { frame, block: std::mem::take(&mut self.program.body) })
    }

    /// Reports a misuse, and opens a construct again that was closed.
    fn reopen(&mut self, closed: Option<Closed>, problem: &'static str) {
        self.misuse(problem);
        if let Some(Closed { frame, block }) = closed {
            self.open.push(frame);
            self.program.body = block;
        }
    }
}

fn close_case(cases: &mut [Case], body: Block) {
    if let Some(case) = cases.last_mut() {
        case.body = body;
    }
}

fn allocate(used: &mut u32, bytes: u32, align: u32) -> u32 {
    let offset = used.checked_next_multiple_of(align.max(1)).unwrap_or(u32::MAX);
    *used = offset.saturating_add(bytes);
    offset
}
