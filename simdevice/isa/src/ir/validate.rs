//! Checks programs. A program that passes can neither panic nor reach out of range when it runs.

use std::collections::HashSet;

use thiserror::Error;

use super::image::{ImageQuery, ImageShape, Lod, Sample};
use super::memory::{Address, AtomicOp, Binding, Format, Space};
use super::program::{MAX_MEMORY_BYTES, MAX_NESTING, Program};
use super::register::{Reg, Role, Type};
use super::statement::{Block, Label, Statement, SubgroupOp, is_reducible};

/// The most registers a program may have.
const MAX_REGISTERS: usize = 1 << 22;
/// The most elements of one load or store.
const MAX_ELEMENTS: usize = 16;

/// The reason that a program can't run.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum InvalidProgram {
    /// The tree of constructs is wrong.
    #[error("{problem}")]
    Structure {
        /// The problem.
        problem: &'static str,
    },
    /// One register is wrong.
    #[error("%{register}: {problem}")]
    Register {
        /// Its index.
        register: u32,
        /// The problem.
        problem: &'static str,
    },
    /// One statement is wrong.
    #[error("{problem} in `{statement}`")]
    Statement {
        /// The statement, disassembled.
        statement: String,
        /// The problem.
        problem: String,
    },
}

/// Checks registers (each in range, of the right type, defined once and before use), labels, nesting, and the ranges of
/// all numbers.
///
/// # Errors
/// The first problem found.
pub fn validate(program: &Program) -> Result<(), InvalidProgram> {
    let structure = |problem| Err(InvalidProgram::Structure { problem });
    if program.registers.len() > MAX_REGISTERS {
        return structure("too many registers");
    }
    if program.shared_bytes > MAX_MEMORY_BYTES || program.private_bytes > MAX_MEMORY_BYTES {
        return structure("too much workgroup or private memory");
    }
    if !program.private_bytes.is_multiple_of(4) {
        return structure("private memory isn't a whole number of words");
    }
    if !program.preloaded_bytes.is_multiple_of(4) || program.preloaded_bytes > program.shared_bytes {
        return structure("the preloaded bytes aren't whole words of workgroup memory");
    }
    let mut checker = Checker {
        program,
        defined: program.registers.iter().map(|register| register.role == Role::Variable).collect(),
        labels: HashSet::new(),
        open: Vec::new(),
    };
    for constant in &program.constants {
        checker.define(constant.reg)?;
    }
    let mut slots = HashSet::new();
    for input in &program.inputs {
        checker.define(input.reg)?;
        if !slots.insert(input.slot) {
            return structure("two inputs have the same slot");
        }
    }
    slots.clear();
    for output in &program.outputs {
        match program.registers.get(output.reg.0 as usize) {
            Some(register) if register.role == Role::Variable => {}
            _ => return wrong(output.reg, "an output isn't a variable"),
        }
        if !slots.insert(output.slot) {
            return structure("two outputs have the same slot");
        }
    }
    checker.block(&program.body, 0)
}

fn wrong<T>(reg: Reg, problem: &'static str) -> Result<T, InvalidProgram> {
    Err(InvalidProgram::Register { register: reg.0, problem })
}

/// A construct that may be left.
struct Open {
    label: Label,
    /// True where `Continue` is allowed: in a loop's body.
    continues: bool,
}

struct Checker<'a> {
    program: &'a Program,
    defined: Vec<bool>,
    labels: HashSet<Label>,
    open: Vec<Open>,
}

impl Checker<'_> {
    fn define(&mut self, reg: Reg) -> Result<(), InvalidProgram> {
        match self.program.registers.get(reg.0 as usize).map(|register| register.role) {
            None => wrong(reg, "no such register"),
            Some(Role::Variable) => wrong(reg, "a variable is defined like a value"),
            Some(Role::Value) if self.defined[reg.0 as usize] => wrong(reg, "a value is defined twice"),
            Some(Role::Value) => {
                self.defined[reg.0 as usize] = true;
                Ok(())
            }
        }
    }

    fn block(&mut self, block: &Block, depth: usize) -> Result<(), InvalidProgram> {
        if depth > MAX_NESTING {
            return Err(InvalidProgram::Structure { problem: "constructs are nested too deeply" });
        }
        block.iter().try_for_each(|statement| self.statement(statement, depth))
    }

    fn statement(&mut self, statement: &Statement, depth: usize) -> Result<(), InvalidProgram> {
        for reg in statement.uses() {
            match self.defined.get(reg.0 as usize) {
                None => return wrong(reg, "no such register"),
                Some(false) => return wrong(reg, "used before its definition"),
                Some(true) => {}
            }
        }
        self.operands(statement).map_err(|problem| match problem {
            Problem::Here(problem) => {
                InvalidProgram::Statement { statement: statement.to_string().trim_end().to_owned(), problem }
            }
            Problem::Register(invalid) => invalid,
        })?;
        if let Statement::Assign { dst, .. } = statement {
            match self.program.registers.get(dst.0 as usize) {
                Some(register) if register.role == Role::Variable => {}
                _ => return wrong(*dst, "an assignment to what isn't a variable"),
            }
        } else {
            statement.definitions().into_iter().try_for_each(|reg| self.define(reg))?;
        }
        self.control(statement, depth)
    }

    fn control(&mut self, statement: &Statement, depth: usize) -> Result<(), InvalidProgram> {
        let structure = |problem| Err(InvalidProgram::Structure { problem });
        let label = match statement {
            Statement::Loop { label, .. } | Statement::Scope { label, .. } | Statement::Switch { label, .. } => *label,
            Statement::Break(label) => {
                return match self.open.iter().any(|open| open.label == *label) {
                    true => Ok(()),
                    false => structure("a break to a construct that isn't around it"),
                };
            }
            Statement::Continue(label) => {
                return match self.open.iter().any(|open| open.label == *label && open.continues) {
                    true => Ok(()),
                    false => structure("a continue outside the loop's body"),
                };
            }
            other => {
                return other.blocks().into_iter().try_for_each(|block| self.block(block, depth + 1));
            }
        };
        if !self.labels.insert(label) {
            return structure("two constructs have the same label");
        }
        if let Statement::Switch { cases, .. } = statement {
            let mut values = HashSet::new();
            if !cases.iter().flat_map(|case| &case.values).all(|value| values.insert(*value)) {
                return structure("two cases have the same value");
            }
            if cases.iter().filter(|case| case.default).count() > 1 {
                return structure("a switch has two defaults");
            }
        }
        for (index, block) in statement.blocks().into_iter().enumerate() {
            let continues = matches!(statement, Statement::Loop { .. }) && index == 0;
            self.open.push(Open { label, continues });
            self.block(block, depth + 1)?;
            self.open.pop();
        }
        Ok(())
    }

    fn type_of(&self, reg: Reg) -> Result<Type, Problem> {
        match self.program.registers.get(reg.0 as usize) {
            Some(register) => Ok(register.ty),
            None => Err(Problem::Register(InvalidProgram::Register { register: reg.0, problem: "no such register" })),
        }
    }

    fn expect(&self, reg: Reg, ty: Type) -> Result<(), Problem> {
        let found = self.type_of(reg)?;
        require(found == ty, || format!("%{} is {found:?}, not {ty:?}", reg.0))
    }

    fn expect_words<'a>(&self, regs: impl IntoIterator<Item = &'a Reg>) -> Result<(), Problem> {
        regs.into_iter().try_for_each(|reg| self.expect(*reg, Type::B32))
    }

    fn operands(&self, statement: &Statement) -> Result<(), Problem> {
        match statement {
            Statement::Compute { op, dst, src } => {
                let signature = op.signature();
                require(src.len() == signature.operands.len(), || "wrong number of operands".into())?;
                src.iter().zip(signature.operands).try_for_each(|(reg, ty)| self.expect(*reg, *ty))?;
                self.expect(*dst, signature.result_type)
            }
            Statement::Assign { dst, src } => self.expect(*src, self.type_of(*dst)?),
            Statement::LaneIndex { dst } => self.expect(*dst, Type::B32),
            Statement::IsHelper { dst } => self.expect(*dst, Type::Bool),
            Statement::Clock { dst } => self.expect(*dst, Type::B64),
            Statement::Load { dst: regs, address, format } | Statement::Store { src: regs, address, format } => {
                require((1..=MAX_ELEMENTS).contains(&regs.len()), || "wrong number of elements".into())?;
                regs.iter().try_for_each(|reg| self.expect(*reg, format.register_type()))?;
                let stores = matches!(statement, Statement::Store { .. });
                require(!stores || address.space != Space::PushConstants, || "push constants are read-only".into())?;
                let narrow = format.bytes() < 4;
                require(!narrow || address.space != Space::Private, || "private memory has no narrow elements".into())?;
                self.address(address)
            }
            Statement::Atomic { op, dst, address, format, value, comparator } => {
                require(matches!(format, Format::B32 | Format::B64), || "atomics are 32 or 64 bits".into())?;
                require(!matches!(address.space, Space::PushConstants | Space::Private), || {
                    "no atomics on this memory".into()
                })?;
                self.address(address)?;
                let ty = format.register_type();
                self.expect(*value, ty)?;
                dst.iter().chain(comparator).try_for_each(|reg| self.expect(*reg, ty))?;
                comparator_given(*op, *comparator)
            }
            Statement::BufferSize { dst, buffer } => {
                self.expect(*dst, Type::B32)?;
                self.binding(buffer)
            }
            Statement::Sample(sample) => self.sample(sample),
            Statement::ImageRead(read) => {
                self.binding(&read.image)?;
                self.coordinate(&read.coordinate, read.shape)?;
                self.expect_words(read.dst.iter().flatten().chain(&read.level).chain(&read.sample))
            }
            Statement::ImageWrite(write) => {
                self.binding(&write.image)?;
                self.coordinate(&write.coordinate, write.shape)?;
                self.expect_words(write.texel.iter().chain(&write.sample))
            }
            Statement::ImageAtomic(atomic) => {
                self.binding(&atomic.image)?;
                self.coordinate(&atomic.coordinate, atomic.shape)?;
                let rest = atomic.dst.iter().chain(&atomic.sample).chain(&atomic.comparator);
                self.expect_words(rest.chain([&atomic.value]))?;
                comparator_given(atomic.op, atomic.comparator)
            }
            Statement::ImageQuery { dst, image, shape, query } => {
                require((1..=4).contains(&dst.len()), || "wrong number of results".into())?;
                self.expect_words(dst)?;
                self.binding(image)?;
                match query {
                    ImageQuery::Size { level } => self.expect_words(level),
                    ImageQuery::Levels | ImageQuery::Samples => Ok(()),
                    ImageQuery::Lod { sampler, coordinate } => {
                        self.binding(sampler)?;
                        self.coordinate(coordinate, ImageShape { arrayed: false, ..*shape })
                    }
                }
            }
            Statement::Derivative { dst, src, .. } => self.expect_words([dst, src]),
            Statement::Subgroup { op, dst, src, index } => self.subgroup(*op, dst, *src, *index),
            Statement::If { condition, .. } => self.expect(*condition, Type::Bool),
            Statement::Switch { selector, .. } => self.expect(*selector, Type::B32),
            Statement::Barrier
            | Statement::Loop { .. }
            | Statement::Scope { .. }
            | Statement::Break(_)
            | Statement::Continue(_)
            | Statement::Return
            | Statement::Kill
            | Statement::Demote => Ok(()),
        }
    }

    fn address(&self, address: &Address) -> Result<(), Problem> {
        if let Space::Buffer(binding) = &address.space {
            self.binding(binding)?;
        }
        match (address.space, address.base) {
            (Space::Global, None) => require(false, || "global memory without an address".into()),
            (Space::Global, Some(base)) => self.expect(base, Type::B64),
            (_, base) => self.expect_words(&base),
        }
    }

    fn binding(&self, binding: &Binding) -> Result<(), Problem> {
        require(binding.slot.checked_add(binding.count).is_some(), || "bind points out of range".into())?;
        self.expect_words(&binding.index)
    }

    fn coordinate(&self, coordinate: &[Reg], shape: ImageShape) -> Result<(), Problem> {
        require(coordinate.len() == shape.coordinates() && coordinate.len() <= 4, || {
            "wrong number of coordinates".into()
        })?;
        self.expect_words(coordinate)
    }

    fn sample(&self, sample: &Sample) -> Result<(), Problem> {
        self.binding(&sample.image)?;
        self.binding(&sample.sampler)?;
        self.coordinate(&sample.coordinate, sample.shape)?;
        let axes = sample.shape.dimension.coordinates();
        require(sample.offset.is_empty() || sample.offset.len() == axes, || "wrong number of offsets".into())?;
        require(sample.gather.is_none_or(|component| component < 4), || "no such component".into())?;
        match &sample.lod {
            Lod::Implicit { bias, minimum } => self.expect_words(bias.iter().chain(minimum))?,
            Lod::Explicit(level) => self.expect_words([level])?,
            Lod::Gradient { dx, dy, minimum } => {
                require(dx.len() == axes && dy.len() == axes, || "wrong number of gradients".into())?;
                self.expect_words(dx.iter().chain(dy).chain(minimum))?;
            }
        }
        self.expect_words(sample.dst.iter().flatten().chain(&sample.offset).chain(&sample.compare))
    }

    fn subgroup(&self, op: SubgroupOp, dst: &[Reg], src: Option<Reg>, index: Option<Reg>) -> Result<(), Problem> {
        let results = if op == SubgroupOp::Ballot { 4 } else { 1 };
        require(dst.len() == results, || "wrong number of results".into())?;
        require(src.is_some() != (op == SubgroupOp::Elect), || "wrong number of operands".into())?;
        require(index.is_some() == op.has_index(), || "wrong number of operands".into())?;
        self.expect_words(&index)?;
        let source = src.map_or(Ok(Type::Bool), |src| self.type_of(src))?;
        let is = |ty: Type| require(source == ty, || format!("the operand is {source:?}, not {ty:?}"));
        let result = match op {
            SubgroupOp::Elect | SubgroupOp::AllEqual => Type::Bool,
            SubgroupOp::All | SubgroupOp::Any => {
                is(Type::Bool)?;
                Type::Bool
            }
            SubgroupOp::Ballot => {
                is(Type::Bool)?;
                Type::B32
            }
            SubgroupOp::Reduce { op, .. } | SubgroupOp::InclusiveScan(op) | SubgroupOp::ExclusiveScan(op) => {
                require(is_reducible(op), || format!("{} doesn't reduce", op.name()))?;
                is(op.signature().result_type)?;
                source
            }
            _ => source,
        };
        if let SubgroupOp::Reduce { cluster, .. } = op {
            require(cluster.is_power_of_two(), || "the cluster size isn't a power of two".into())?;
        }
        dst.iter().try_for_each(|reg| self.expect(*reg, result))
    }
}

/// A problem with a statement's operands.
enum Problem {
    Here(String),
    Register(InvalidProgram),
}

fn require(holds: bool, problem: impl FnOnce() -> String) -> Result<(), Problem> {
    if holds { Ok(()) } else { Err(Problem::Here(problem())) }
}

fn comparator_given(op: AtomicOp, comparator: Option<Reg>) -> Result<(), Problem> {
    require(comparator.is_some() == (op == AtomicOp::CompareExchange), || {
        "a comparator is for compare-exchange, and needed there".into()
    })
}
