//! Statements: their effects, the registers that they define and use, and their text.

use std::collections::{HashMap, HashSet};
use std::fmt::{Display, Formatter, Result};

use super::image::{ImageAtomic, ImageQuery, ImageRead, ImageShape, ImageWrite, Lod, Sample};
use super::memory::{Address, AtomicOp, Binding, Format, Space};
use super::op::Op;
use super::register::{List, Reg};

/// Statements in order.
pub type Block = Vec<Statement>;

/// Reports whether a statement is in a block or within its statements.
pub(crate) fn contains(block: &Block, wanted: &Statement) -> bool {
    block.iter().any(|statement| statement == wanted || statement.blocks().iter().any(|block| contains(block, wanted)))
}

/// The name of a construct that `Break` and `Continue` may leave. Unique in a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Label(pub u32);

/// A case of a switch.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// The selector's values that select this case. A value belongs to only one case.
    pub values: Vec<u32>,
    /// True if all values without a case select this one. At most one case of a switch is the default.
    pub default: bool,
    /// Its statements.
    pub body: Block,
    /// True if lanes at the end of the body go on in the next case; otherwise they leave the switch.
    pub fallthrough: bool,
}

/// The axis of a derivative.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Axis {
    /// Towards the right neighbour.
    X,
    /// Towards the lower neighbour.
    Y,
}

/// An operation across the active lanes of a subgroup (or of a quad).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SubgroupOp {
    /// True in the first active lane. No operand; `Bool`.
    Elect,
    /// True if all active lanes have true. `Bool` to `Bool`.
    All,
    /// True if any active lane has true. `Bool` to `Bool`.
    Any,
    /// True if the active lanes' values have equal bits. Any type to `Bool`.
    AllEqual,
    /// A bit for each active lane with true, lane 0 lowest. `Bool` to four `B32`.
    Ballot,
    /// The value of the first active lane. Any type.
    BroadcastFirst,
    /// The value of lane `index` of the subgroup; zero if there is none or it is inactive. Any type.
    Shuffle,
    /// The value of lane `own ^ index`.
    ShuffleXor,
    /// The value of lane `own - index`.
    ShuffleUp,
    /// The value of lane `own + index`.
    ShuffleDown,
    /// The value of lane `index & 3` of the quad, active or not.
    QuadBroadcast,
    /// The value of lane `own ^ (index & 3)` of the quad, active or not: 1 horizontal, 2 vertical, 3 diagonal.
    QuadSwap,
    /// Combination over the active lanes of each run of `cluster` lanes (a power of two; a run of the subgroup size or
    /// more is the whole subgroup).
    Reduce {
        /// An associative operation: see [`is_reducible`].
        op: Op,
        /// Lanes combined.
        cluster: u32,
    },
    /// Combination of the active lanes up to and including one's own.
    InclusiveScan(Op),
    /// Combination of the active lanes before one's own; the identity in the first.
    ExclusiveScan(Op),
}

impl SubgroupOp {
    /// Reports whether the operation has an index as an operand.
    pub fn has_index(self) -> bool {
        matches!(
            self,
            Self::Shuffle
                | Self::ShuffleXor
                | Self::ShuffleUp
                | Self::ShuffleDown
                | Self::QuadBroadcast
                | Self::QuadSwap
        )
    }
}

/// Reports whether subgroup reductions and scans may use an operation.
pub fn is_reducible(op: Op) -> bool {
    use Op::*;
    matches!(
        op,
        BAnd | BOr
            | BXor
            | And
            | Or
            | Xor
            | IAdd
            | IMul
            | SMin
            | SMax
            | UMin
            | UMax
            | FAdd
            | FMul
            | FMin
            | FMax
            | And64
            | Or64
            | Xor64
            | IAdd64
            | IMul64
            | SMin64
            | SMax64
            | UMin64
            | UMax64
            | FAdd64
            | FMul64
            | FMin64
            | FMax64
    )
}

/// One statement.
#[derive(Clone, Debug, PartialEq)]
pub enum Statement {
    /// `dst = op(src...)`, in all lanes.
    Compute {
        /// The operation.
        op: Op,
        /// The value defined.
        dst: Reg,
        /// As many operands as the operation's signature has.
        src: Vec<Reg>,
    },
    /// `dst = src` in the active lanes; `dst` is a variable.
    Assign {
        /// The variable.
        dst: Reg,
        /// Its new value.
        src: Reg,
    },
    /// The lane's index in its workgroup, or in the batch where that is not of workgroups, `B32`. Its remainder by the
    /// subgroup size is the subgroup invocation.
    LaneIndex {
        /// The value defined.
        dst: Reg,
    },
    /// True if the lane is a helper; `Bool`.
    IsHelper {
        /// The value defined.
        dst: Reg,
    },
    /// The host's time in nanoseconds, as [`host_time`](crate::clock::host_time) has it, the same for all lanes; `B64`.
    Clock {
        /// The value defined.
        dst: Reg,
    },
    /// Loads consecutive elements. An element that is out of range is zero.
    Load {
        /// The values defined, 1 to 16.
        dst: Vec<Reg>,
        /// The address of the first element.
        address: Address,
        /// The format of each element.
        format: Format,
    },
    /// Stores consecutive elements, in active lanes that aren't helpers. An element that is out of range is not stored.
    /// If lanes store to the same place, one of them wins.
    Store {
        /// The elements, 1 to 16.
        src: Vec<Reg>,
        /// The address of the first element.
        address: Address,
        /// The format of each element.
        format: Format,
    },
    /// A read-modify-write, in active lanes that aren't helpers, in order of lanes. Private memory and push constants
    /// have none. One that is out of range gives zero and changes nothing.
    Atomic {
        /// The operation.
        op: AtomicOp,
        /// The old value; None if it is not used.
        dst: Option<Reg>,
        /// The address of the element.
        address: Address,
        /// `B32` or `B64`.
        format: Format,
        /// The operand.
        value: Reg,
        /// The value that [`AtomicOp::CompareExchange`] compares with.
        comparator: Option<Reg>,
    },
    /// The size in bytes of a bound buffer range, `B32`.
    BufferSize {
        /// The value defined.
        dst: Reg,
        /// The buffer.
        buffer: Binding,
    },
    /// Filtered image access.
    Sample(Box<Sample>),
    /// Unfiltered image access.
    ImageRead(Box<ImageRead>),
    /// Image store, in active lanes that aren't helpers.
    ImageWrite(Box<ImageWrite>),
    /// Image atomic, in active lanes that aren't helpers.
    ImageAtomic(Box<ImageAtomic>),
    /// A query about an image.
    ImageQuery {
        /// The results, `B32`; as many as the query gives.
        dst: Vec<Reg>,
        /// The image.
        image: Binding,
        /// The image's kind.
        shape: ImageShape,
        /// The query.
        query: ImageQuery,
    },
    /// A derivative: the difference within the 2x2 quad (lanes 4q.. are upper left, upper right, lower left, lower
    /// right). `B32` floats.
    Derivative {
        /// The value defined.
        dst: Reg,
        /// The value to differentiate.
        src: Reg,
        /// The axis.
        axis: Axis,
        /// True for the difference of the lane's own row or column; false for one difference of the quad.
        fine: bool,
    },
    /// An operation across lanes.
    Subgroup {
        /// The operation.
        op: SubgroupOp,
        /// The value defined; four for a ballot.
        dst: Vec<Reg>,
        /// The operand; none for [`SubgroupOp::Elect`].
        src: Option<Reg>,
        /// The lane operand of shuffles and quad operations.
        index: Option<Reg>,
    },
    /// A barrier: all lanes reach it before any goes on. The machine runs lanes in step, so it only orders memory
    /// accesses.
    Barrier,
    /// A branch.
    If {
        /// `Bool`.
        condition: Reg,
        /// Statements for the lanes with true.
        then: Block,
        /// Statements for the lanes with false.
        otherwise: Block,
    },
    /// A multi-way branch. A lane whose selector has no case leaves the switch if there is no default.
    Switch {
        /// `Break` to it leaves the switch.
        label: Label,
        /// `B32`.
        selector: Reg,
        /// The cases, in order.
        cases: Vec<Case>,
    },
    /// Repeats `body` then `continuing` until every lane has left by a break.
    Loop {
        /// `Break` to it leaves the loop; `Continue` goes to `continuing`.
        label: Label,
        /// The repeated statements.
        body: Block,
        /// The statements between a `Continue`, or the body's end, and the next iteration.
        continuing: Block,
    },
    /// Statements that `Break` may leave early (an inlined function, for example).
    Scope {
        /// `Break` to it jumps to its end.
        label: Label,
        /// The statements.
        body: Block,
    },
    /// The active lanes leave the enclosing loop, switch or scope of that label.
    Break(Label),
    /// The active lanes go on to `continuing` of the enclosing loop of that label, from within its body.
    Continue(Label),
    /// The active lanes are done.
    Return,
    /// The active lanes are done and marked as killed: none of their results may be written.
    Kill,
    /// The active lanes become helpers and are marked as killed, but go on.
    Demote,
}

impl Statement {
    /// Calls `visit` on each register that the statement itself defines or assigns, not those within its blocks.
    pub fn for_each_definition(&mut self, visit: &mut dyn FnMut(&mut Reg)) {
        match self {
            Self::Compute { dst, .. }
            | Self::Assign { dst, .. }
            | Self::LaneIndex { dst }
            | Self::IsHelper { dst }
            | Self::Clock { dst }
            | Self::BufferSize { dst, .. }
            | Self::Derivative { dst, .. } => visit(dst),
            Self::Load { dst, .. } | Self::Subgroup { dst, .. } | Self::ImageQuery { dst, .. } => {
                dst.iter_mut().for_each(visit);
            }
            Self::Atomic { dst, .. } => dst.iter_mut().for_each(visit),
            Self::ImageAtomic(atomic) => atomic.dst.iter_mut().for_each(visit),
            Self::Sample(sample) => sample.dst.iter_mut().flatten().for_each(visit),
            Self::ImageRead(read) => read.dst.iter_mut().flatten().for_each(visit),
            Self::Store { .. }
            | Self::ImageWrite(_)
            | Self::Barrier
            | Self::If { .. }
            | Self::Switch { .. }
            | Self::Loop { .. }
            | Self::Scope { .. }
            | Self::Break(_)
            | Self::Continue(_)
            | Self::Return
            | Self::Kill
            | Self::Demote => {}
        }
    }

    /// Calls `visit` on each register that the statement itself reads, not those within its blocks.
    pub fn for_each_use(&mut self, visit: &mut dyn FnMut(&mut Reg)) {
        match self {
            Self::Compute { src, .. } => src.iter_mut().for_each(visit),
            Self::Assign { src, .. } | Self::Derivative { src, .. } => visit(src),
            Self::Load { address, .. } => use_address(address, visit),
            Self::Store { src, address, .. } => {
                src.iter_mut().for_each(&mut *visit);
                use_address(address, visit);
            }
            Self::Atomic { address, value, comparator, .. } => {
                use_address(address, visit);
                visit(value);
                comparator.iter_mut().for_each(visit);
            }
            Self::BufferSize { buffer, .. } => use_binding(buffer, visit),
            Self::Sample(sample) => {
                use_binding(&mut sample.image, visit);
                use_binding(&mut sample.sampler, visit);
                sample.coordinate.iter_mut().for_each(&mut *visit);
                match &mut sample.lod {
                    Lod::Implicit { bias, minimum } => {
                        bias.iter_mut().for_each(&mut *visit);
                        minimum.iter_mut().for_each(&mut *visit);
                    }
                    Lod::Explicit(level) => visit(level),
                    Lod::Gradient { dx, dy, minimum } => {
                        dx.iter_mut().chain(dy).for_each(&mut *visit);
                        minimum.iter_mut().for_each(&mut *visit);
                    }
                }
                sample.offset.iter_mut().for_each(&mut *visit);
                sample.compare.iter_mut().for_each(visit);
            }
            Self::ImageRead(read) => {
                use_binding(&mut read.image, visit);
                read.coordinate.iter_mut().for_each(&mut *visit);
                read.level.iter_mut().for_each(&mut *visit);
                read.sample.iter_mut().for_each(visit);
            }
            Self::ImageWrite(write) => {
                use_binding(&mut write.image, visit);
                write.coordinate.iter_mut().for_each(&mut *visit);
                write.sample.iter_mut().for_each(&mut *visit);
                write.texel.iter_mut().for_each(visit);
            }
            Self::ImageAtomic(atomic) => {
                use_binding(&mut atomic.image, visit);
                atomic.coordinate.iter_mut().for_each(&mut *visit);
                atomic.sample.iter_mut().for_each(&mut *visit);
                visit(&mut atomic.value);
                atomic.comparator.iter_mut().for_each(visit);
            }
            Self::ImageQuery { image, query, .. } => {
                use_binding(image, visit);
                match query {
                    ImageQuery::Size { level } => level.iter_mut().for_each(visit),
                    ImageQuery::Levels | ImageQuery::Samples => {}
                    ImageQuery::Lod { sampler, coordinate } => {
                        use_binding(sampler, visit);
                        coordinate.iter_mut().for_each(visit);
                    }
                }
            }
            Self::Subgroup { src, index, .. } => {
                src.iter_mut().for_each(&mut *visit);
                index.iter_mut().for_each(visit);
            }
            Self::If { condition, .. } => visit(condition),
            Self::Switch { selector, .. } => visit(selector),
            Self::LaneIndex { .. }
            | Self::IsHelper { .. }
            | Self::Clock { .. }
            | Self::Barrier
            | Self::Loop { .. }
            | Self::Scope { .. }
            | Self::Break(_)
            | Self::Continue(_)
            | Self::Return
            | Self::Kill
            | Self::Demote => {}
        }
    }

    /// The registers that the statement itself defines or assigns.
    pub fn definitions(&self) -> Vec<Reg> {
        let mut found = Vec::new();
        self.clone_head().for_each_definition(&mut |reg| found.push(*reg));
        found
    }

    /// The registers that the statement itself reads.
    pub fn uses(&self) -> Vec<Reg> {
        let mut found = Vec::new();
        self.clone_head().for_each_use(&mut |reg| found.push(*reg));
        found
    }

    /// Adds the registers that the statement, and those within, define or assign.
    pub fn collect_definitions(&self, found: &mut HashSet<Reg>) {
        found.extend(self.definitions());
        self.blocks().into_iter().flatten().for_each(|inner| inner.collect_definitions(found));
    }

    /// Replaces the registers that the statement itself reads by others.
    pub fn replace_uses(&mut self, by: &HashMap<Reg, Reg>) {
        self.for_each_use(&mut |reg| *reg = by.get(reg).copied().unwrap_or(*reg));
    }

    /// The blocks within, in order of execution.
    pub fn blocks(&self) -> Vec<&Block> {
        match self {
            Self::If { then, otherwise, .. } => vec![then, otherwise],
            Self::Switch { cases, .. } => cases.iter().map(|case| &case.body).collect(),
            Self::Loop { body, continuing, .. } => vec![body, continuing],
            Self::Scope { body, .. } => vec![body],
            _ => Vec::new(),
        }
    }

    /// The blocks within, in order of execution.
    pub fn blocks_mut(&mut self) -> Vec<&mut Block> {
        match self {
            Self::If { then, otherwise, .. } => vec![then, otherwise],
            Self::Switch { cases, .. } => cases.iter_mut().map(|case| &mut case.body).collect(),
            Self::Loop { body, continuing, .. } => vec![body, continuing],
            Self::Scope { body, .. } => vec![body],
            _ => Vec::new(),
        }
    }

    /// Reports whether the statement, or one within, reads a register.
    pub fn reads(&self, reg: Reg) -> bool {
        self.uses().contains(&reg) || self.blocks().into_iter().flatten().any(|inner| inner.reads(reg))
    }

    /// Reports whether the statement, or one within, defines or assigns a register.
    pub fn writes(&self, reg: Reg) -> bool {
        self.definitions().contains(&reg) || self.blocks().into_iter().flatten().any(|inner| inner.writes(reg))
    }

    /// The statement without its blocks.
    fn clone_head(&self) -> Self {
        match self {
            Self::If { condition, .. } => Self::If { condition: *condition, then: Vec::new(), otherwise: Vec::new() },
            Self::Switch { label, selector, .. } => {
                Self::Switch { label: *label, selector: *selector, cases: Vec::new() }
            }
            Self::Loop { .. } | Self::Scope { .. } => Self::Barrier,
            other => other.clone(),
        }
    }
}

fn use_binding(binding: &mut Binding, visit: &mut dyn FnMut(&mut Reg)) {
    binding.index.iter_mut().for_each(visit);
}

fn use_address(address: &mut Address, visit: &mut dyn FnMut(&mut Reg)) {
    if let Space::Buffer(binding) = &mut address.space {
        use_binding(binding, visit);
    }
    address.base.iter_mut().for_each(visit);
}

impl Display for Statement {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write_statement(self, 0, f)
    }
}

/// Writes the statements of a block, each on a line, indented by `depth`.
pub(super) fn write_block(statements: &Block, depth: usize, f: &mut Formatter<'_>) -> Result {
    statements.iter().try_for_each(|inner| write_statement(inner, depth, f))
}

fn write_statement(it: &Statement, depth: usize, f: &mut Formatter<'_>) -> Result {
    let pad = "  ".repeat(depth);
    write!(f, "{pad}")?;
    let defined = it.definitions();
    if !defined.is_empty() {
        write!(f, "{} = ", List(&defined))?;
    }
    match it {
        Statement::Compute { op, src, .. } => writeln!(f, "{} {}", op.name(), List(src)),
        Statement::Assign { src, .. } => writeln!(f, "assign {src}"),
        Statement::LaneIndex { .. } => writeln!(f, "lane_index"),
        Statement::IsHelper { .. } => writeln!(f, "is_helper"),
        Statement::Clock { .. } => writeln!(f, "clock"),
        Statement::Load { address, format, .. } => writeln!(f, "load {format:?} {address}"),
        Statement::Store { src, address, format } => writeln!(f, "store {format:?} {address}, {}", List(src)),
        Statement::Atomic { op, address, format, value, comparator, .. } => {
            write!(f, "atomic {op:?} {format:?} {address}, {value}")?;
            match comparator {
                Some(comparator) => writeln!(f, ", {comparator}"),
                None => writeln!(f),
            }
        }
        Statement::BufferSize { buffer, .. } => writeln!(f, "buffer_size {buffer}"),
        Statement::Sample(sample) => {
            write!(f, "sample {:?} {} {}, {}", sample.shape, sample.image, sample.sampler, List(&sample.coordinate))?;
            writeln!(
                f,
                ", {:?}, offset [{}], compare {:?}, gather {:?}",
                sample.lod,
                List(&sample.offset),
                sample.compare,
                sample.gather
            )
        }
        Statement::ImageRead(read) => {
            write!(f, "image_read {:?} {}, {}", read.shape, read.image, List(&read.coordinate))?;
            writeln!(f, ", level {:?}, sample {:?}", read.level, read.sample)
        }
        Statement::ImageWrite(write) => {
            let ir = (&write.coordinate, &write.texel);
            writeln!(f, "image_write {:?} {}, {}: {}", write.shape, write.image, List(ir.0), List(ir.1))
        }
        Statement::ImageAtomic(atomic) => {
            write!(f, "image_atomic {:?} {:?} {}", atomic.op, atomic.shape, atomic.image)?;
            writeln!(f, ", {}: {}, {:?}", List(&atomic.coordinate), atomic.value, atomic.comparator)
        }
        Statement::ImageQuery { image, shape, query, .. } => writeln!(f, "image_query {shape:?} {image}, {query:?}"),
        Statement::Derivative { src, axis, fine, .. } => {
            writeln!(f, "derivative_{} {axis:?} {src}", if *fine { "fine" } else { "coarse" })
        }
        Statement::Subgroup { op, src, index, .. } => {
            match op {
                SubgroupOp::Reduce { op, cluster } => {
                    write!(f, "subgroup reduce {} {cluster}", op.name())?;
                }
                other => write!(f, "subgroup {other:?}")?,
            }
            let operands: Vec<Reg> = src.iter().chain(index).copied().collect();
            writeln!(f, " {}", List(&operands))
        }
        Statement::Barrier => writeln!(f, "barrier"),
        Statement::If { condition, then, otherwise } => {
            writeln!(f, "if {condition} {{")?;
            write_block(then, depth + 1, f)?;
            if !otherwise.is_empty() {
                writeln!(f, "{pad}}} else {{")?;
                write_block(otherwise, depth + 1, f)?;
            }
            writeln!(f, "{pad}}}")
        }
        Statement::Switch { label, selector, cases } => {
            writeln!(f, "@{} switch {selector} {{", label.0)?;
            for case in cases {
                let default = if case.default { " default" } else { "" };
                writeln!(f, "{pad}case {:?}{default} {{", case.values)?;
                write_block(&case.body, depth + 1, f)?;
                writeln!(f, "{pad}}}{}", if case.fallthrough { " fall through" } else { "" })?;
            }
            writeln!(f, "{pad}}}")
        }
        Statement::Loop { label, body, continuing } => {
            writeln!(f, "@{} loop {{", label.0)?;
            write_block(body, depth + 1, f)?;
            if !continuing.is_empty() {
                writeln!(f, "{pad}}} continuing {{")?;
                write_block(continuing, depth + 1, f)?;
            }
            writeln!(f, "{pad}}}")
        }
        Statement::Scope { label, body } => {
            writeln!(f, "@{} scope {{", label.0)?;
            write_block(body, depth + 1, f)?;
            writeln!(f, "{pad}}}")
        }
        Statement::Break(label) => writeln!(f, "break @{}", label.0),
        Statement::Continue(label) => writeln!(f, "continue @{}", label.0),
        Statement::Return => writeln!(f, "return"),
        Statement::Kill => writeln!(f, "kill"),
        Statement::Demote => writeln!(f, "demote"),
    }
}
