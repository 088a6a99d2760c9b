//! A program: its registers, inputs, outputs, statements, and their limits.

use std::fmt::{Display, Formatter, Result};

use super::register::{Reg, Register, Type};
use super::statement::{Block, write_block};
use super::waiting::Accesses;

/// The largest batch, in lanes.
pub const MAX_LANES: usize = 2048;

/// The largest workgroup memory and the largest private memory of a lane, in bytes.
pub const MAX_MEMORY_BYTES: u32 = 1 << 20;

/// The largest subgroup, in lanes: a ballot is four 32-bit words.
pub const MAX_SUBGROUP_SIZE: usize = 128;

/// The most constructs that may be nested.
pub const MAX_NESTING: usize = 256;

/// The rate of an input: one value for a batch or one for each lane.
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
    /// The number by which the caller knows it. The IR gives it no meaning.
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
    /// Values known before the program runs.
    pub constants: Vec<Constant>,
    /// Values that the caller gives.
    pub inputs: Vec<Input>,
    /// Variables that the caller reads.
    pub outputs: Vec<Output>,
    /// Bytes of workgroup memory, at most [`MAX_MEMORY_BYTES`].
    pub shared_bytes: u32,
    /// The first bytes of workgroup memory that the caller sets before each batch, a multiple of 4. The others are zero
    /// when a batch begins.
    pub preloaded_bytes: u32,
    /// Bytes of private memory of each lane, a multiple of 4, at most [`MAX_MEMORY_BYTES`]. Its contents are undefined
    /// when a batch begins.
    pub private_bytes: u32,
    /// True if some accesses are coherent or volatile, so that they see what other invocations write meanwhile.
    pub has_coherent_accesses: bool,
    /// The statements.
    pub body: Block,
}

impl Program {
    /// True if an invocation may wait for what one of another workgroup writes: if there are atomics, or coherent accesses
    /// and a loop that reads memory that the program writes. Such workgroups must not run in lockstep.
    pub fn may_wait(&self) -> bool {
        let accesses = Accesses::of(&self.body);
        accesses.has_atomics || self.has_coherent_accesses && accesses.may_see_writes()
    }
}

impl Display for Program {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        for input in &self.inputs {
            writeln!(f, "{} = input {} {:?}", input.reg, input.slot, input.rate)?;
        }
        for output in &self.outputs {
            writeln!(f, "{} = output {}", output.reg, output.slot)?;
        }
        if self.shared_bytes + self.private_bytes > 0 {
            writeln!(f, "shared {} bytes, private {} bytes", self.shared_bytes, self.private_bytes)?;
        }
        for constant in &self.constants {
            let bits = constant.bits;
            match self.registers.get(constant.reg.0 as usize).map(|register| register.ty) {
                Some(Type::Bool) => writeln!(f, "{} = {}", constant.reg, bits != 0)?,
                Some(Type::B64) => {
                    writeln!(f, "{} = {bits} ({:?})", constant.reg, f64::from_bits(bits))?;
                }
                _ => writeln!(f, "{} = {bits} ({:?})", constant.reg, f32::from_bits(bits as u32))?,
            }
        }
        write_block(&self.body, 0, f)
    }
}
