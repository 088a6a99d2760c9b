//! The intermediate representation: a tree of statements over typed scalar registers. See [`super`] for what it means.

use super::op::Op;

mod image;
pub use image::{
    Dimension, ImageAtomic, ImageQuery, ImageRead, ImageShape, ImageWrite, Lod, Sample,
};

/// Lanes in a chunk, the unit that registers are stored and computed in. Batches are whole numbers of chunks.
pub const CHUNK_LANES: usize = 16;

/// The largest batch, in lanes.
pub const MAX_LANES: usize = 2048;

/// The largest workgroup memory and the largest private memory of a lane, in bytes.
pub const MAX_MEMORY_BYTES: u32 = 1 << 20;

/// The largest subgroup, in lanes: a ballot is four 32-bit words.
pub const MAX_SUBGROUP_SIZE: usize = 128;

/// The most constructs that may be nested.
pub const MAX_NESTING: usize = 256;

/// A register: an index into [`Program::registers`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Reg(pub u32);

/// How wide a register is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Type {
    /// A truth value.
    Bool,
    /// 32 bits: `f32`, `i32` or `u32`, as the operation says.
    B32,
    /// 64 bits: `f64`, `i64` or `u64`.
    B64,
}

/// How a register is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// Defined once, in all lanes.
    Value,
    /// Written by [`Statement::Assign`], in the active lanes.
    Variable,
}

/// A register's declaration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Register {
    /// Its type.
    pub ty: Type,
    /// How it is written.
    pub role: Role,
}

/// Whether an input is the same in all lanes of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Rate {
    /// One value for the whole batch (for example a workgroup's id).
    Uniform,
    /// One value for each lane.
    Varying,
}

/// A register that the caller fills before each batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Input {
    /// The number by which the caller knows it. What the numbers mean is between the caller and whoever builds the
    /// program.
    pub slot: u32,
    /// The value that holds it.
    pub reg: Reg,
    /// One for each lane or one for all.
    pub rate: Rate,
}

/// A variable that the caller reads after each batch. It is zero when a batch begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Output {
    /// The number by which the caller knows it.
    pub slot: u32,
    /// The variable that holds it.
    pub reg: Reg,
}

/// A constant: a value that is known before the program runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Constant {
    /// The value that holds it.
    pub reg: Reg,
    /// Its bits; the upper half is zero for `B32`; 0 or 1 for `Bool`.
    pub bits: u64,
}

/// A program for the shader cores.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Program {
    /// All registers; [`Reg`] is an index into it.
    pub registers: Vec<Register>,
    /// Values known beforehand.
    pub constants: Vec<Constant>,
    /// Values that the caller gives.
    pub inputs: Vec<Input>,
    /// Variables that the caller reads.
    pub outputs: Vec<Output>,
    /// Bytes of workgroup memory, at most [`MAX_MEMORY_BYTES`]. It is zero when a batch begins.
    pub shared_bytes: u32,
    /// Bytes of private memory of each lane, a multiple of 4, at most [`MAX_MEMORY_BYTES`]. What it holds when a batch
    /// begins is not defined.
    pub private_bytes: u32,
    /// The statements.
    pub body: Block,
}

/// Statements in order.
pub type Block = Vec<Statement>;

/// The name of a construct that `Break` and `Continue` may leave. Unique in a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Label(pub u32);

/// A case of a switch.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// The selector's values that lead here, each in only one case.
    pub values: Vec<u32>,
    /// Whether this case is also where all other values lead. At most one case of a switch.
    pub default: bool,
    /// What it does.
    pub body: Block,
    /// Whether lanes at the end of the body go on in the next case rather than leave the switch.
    pub fallthrough: bool,
}

/// A descriptor, or an array of them indexed at run time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Binding {
    /// The first bind point.
    pub slot: u32,
    /// The length of the array; 1 if it is none.
    pub count: u32,
    /// The index into the array, if it has to be computed. It may differ from lane to lane. An index out of range
    /// behaves as a buffer of size zero.
    pub index: Option<Reg>,
}

impl Binding {
    /// A single descriptor.
    pub fn new(slot: u32) -> Self {
        Self {
            slot,
            count: 1,
            index: None,
        }
    }
}

/// A memory that addresses are relative to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// A bound buffer range.
    Buffer(Binding),
    /// Push constants: read-only.
    PushConstants,
    /// Workgroup memory: of the batch.
    Shared,
    /// Private memory: of the lane. 32- and 64-bit accesses only; addresses are multiples of 4.
    Private,
    /// Device addresses of 64 bits.
    Global,
}

/// Where an access goes: `base + offset` bytes into a space. The sum doesn't wrap: what overflows is out of range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Address {
    /// The memory.
    pub space: Space,
    /// Byte address: `B32`, or `B64` for [`Space::Global`], where it must be given. None is zero.
    pub base: Option<Reg>,
    /// Bytes beyond it.
    pub offset: u32,
}

/// The format of an element in memory, little-endian, aligned to its size (64-bit elements to 4 bytes, so that the
/// scalar block layout works; such an access is atomic only when it is aligned to 8).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// A byte, zero-extended to `B32` when loaded; stores take the low bits.
    U8,
    /// A byte, sign-extended.
    S8,
    /// 16 bits, zero-extended.
    U16,
    /// 16 bits, sign-extended.
    S16,
    /// 32 bits.
    B32,
    /// 64 bits.
    B64,
}

impl Format {
    /// Its size in memory.
    pub fn bytes(self) -> u32 {
        match self {
            Self::U8 | Self::S8 => 1,
            Self::U16 | Self::S16 => 2,
            Self::B32 => 4,
            Self::B64 => 8,
        }
    }

    /// The type of the register that holds it.
    pub fn register_type(self) -> Type {
        if self == Self::B64 {
            Type::B64
        } else {
            Type::B32
        }
    }
}

/// A read-modify-write operation on memory or a texel. The result is the old value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AtomicOp {
    /// Integer addition.
    IAdd,
    /// Signed minimum.
    SMin,
    /// Signed maximum.
    SMax,
    /// Unsigned minimum.
    UMin,
    /// Unsigned maximum.
    UMax,
    /// Bitwise and.
    And,
    /// Bitwise or.
    Or,
    /// Bitwise exclusive or.
    Xor,
    /// Replacement.
    Exchange,
    /// Replacement if the old value equals a comparator.
    CompareExchange,
    /// Float addition.
    FAdd,
    /// Float minimum; of NaN and a number, the number.
    FMin,
    /// Float maximum.
    FMax,
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
    /// Whether this is the first active lane. No operand; `Bool`.
    Elect,
    /// Whether all active lanes have true. `Bool` to `Bool`.
    All,
    /// Whether any active lane has true. `Bool` to `Bool`.
    Any,
    /// Whether the active lanes' values are equal bits. Any type to `Bool`.
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
    /// Combination over the active lanes of each run of `cluster` lanes (a power of two; the subgroup size or more for
    /// all).
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

/// Whether subgroup reductions and scans may use an operation.
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
        /// What to do.
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
        /// What it becomes.
        src: Reg,
    },
    /// The lane's index in the batch, `B32`. Its remainder by the subgroup size is the subgroup invocation.
    LaneIndex {
        /// The value defined.
        dst: Reg,
    },
    /// Whether the lane is a helper, `Bool`.
    IsHelper {
        /// The value defined.
        dst: Reg,
    },
    /// Loads consecutive elements. Out of range reads zero.
    Load {
        /// The values defined, 1 to 16.
        dst: Vec<Reg>,
        /// Where the first is.
        address: Address,
        /// What each is.
        format: Format,
    },
    /// Stores consecutive elements, in active lanes that aren't helpers. Out of range vanishes, element by element.
    /// Where lanes collide, one of them wins.
    Store {
        /// The elements, 1 to 16.
        src: Vec<Reg>,
        /// Where the first goes.
        address: Address,
        /// What each is.
        format: Format,
    },
    /// A read-modify-write, in active lanes that aren't helpers, in order of lanes. Not for private memory or push
    /// constants. Out of range reads zero and does nothing.
    Atomic {
        /// What to do.
        op: AtomicOp,
        /// The old value, if anybody asks.
        dst: Option<Reg>,
        /// Where.
        address: Address,
        /// `B32` or `B64`.
        format: Format,
        /// The operand.
        value: Reg,
        /// What [`AtomicOp::CompareExchange`] compares with.
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
    /// A question about an image.
    ImageQuery {
        /// The answers, `B32`; as many as asked for.
        dst: Vec<Reg>,
        /// The image.
        image: Binding,
        /// The image's kind.
        shape: ImageShape,
        /// What is asked.
        query: ImageQuery,
    },
    /// A derivative: the difference within the 2x2 quad (lanes 4q.. are upper left, upper right, lower left, lower
    /// right). `B32` floats.
    Derivative {
        /// The value defined.
        dst: Reg,
        /// What is differentiated.
        src: Reg,
        /// Along which axis.
        axis: Axis,
        /// Of the lane's own row or column; otherwise one for the quad.
        fine: bool,
    },
    /// An operation across lanes.
    Subgroup {
        /// What to do.
        op: SubgroupOp,
        /// The value defined; four for a ballot.
        dst: Vec<Reg>,
        /// The operand; none for [`SubgroupOp::Elect`].
        src: Option<Reg>,
        /// The lane operand of shuffles and quad operations.
        index: Option<Reg>,
    },
    /// All lanes reach this before any goes on. In this machine that is always so; it keeps memory accesses in order.
    Barrier,
    /// Branches.
    If {
        /// `Bool`.
        condition: Reg,
        /// Lanes with true.
        then: Block,
        /// Lanes with false.
        otherwise: Block,
    },
    /// Multi-way branch. A lane whose selector has no case, and where there's no default, leaves the switch.
    Switch {
        /// `Break` to it leaves the switch.
        label: Label,
        /// `B32`.
        selector: Reg,
        /// In order.
        cases: Vec<Case>,
    },
    /// Repeats `body` then `continuing` until every lane has left by a break.
    Loop {
        /// `Break` to it leaves the loop; `Continue` goes to `continuing`.
        label: Label,
        /// What is repeated.
        body: Block,
        /// What a lane does between a `Continue`, or the body's end, and the next iteration.
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
    /// The active lanes are done and marked as killed: nothing of them shall be written.
    Kill,
    /// The active lanes become helpers and are marked as killed, but go on.
    Demote,
}
