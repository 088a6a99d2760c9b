//! A program made ready to run.

use fearless_simd::Level;

use super::super::ir::{
    CHUNK_LANES, Constant, Input, MAX_LANES, MAX_SUBGROUP_SIZE, Output, Program, Reg, Type,
};
use super::super::optimize::optimize;
use super::super::uniformity::varying_registers;
use super::super::validate::{InvalidProgram, validate};
use super::allocate::allocate;
use super::file::Slot;
use super::lower::{Lowered, lower};
use super::mask::MaskId;
use super::step::{RunCost, Step};

/// The most chunks that a register file may have: 256 MiB.
const MAX_CHUNKS: usize = 1 << 22;

/// How a program shall run.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Lanes of a batch: a multiple of 16, at most [`MAX_LANES`].
    pub lanes: usize,
    /// Lanes of a subgroup: a power of two, at least 4 and at most [`MAX_SUBGROUP_SIZE`]. The last subgroup of a batch may
    /// be smaller.
    pub subgroup_size: usize,
    /// Whether to count the work done (see [`super::Machine::take_work`]).
    pub count_work: bool,
    /// The SIMD level of the kernels.
    pub level: Level,
}

impl Options {
    /// Batches and subgroups of 64 lanes; nothing is counted.
    pub fn new(level: Level) -> Self {
        Self {
            lanes: 64,
            subgroup_size: 64,
            count_work: false,
            level,
        }
    }
}

/// A program made ready for batches of a fixed number of lanes. It can be shared between workers.
#[derive(Debug)]
pub struct Executable {
    pub(super) steps: Vec<Step>,
    pub(super) slots: Vec<Slot>,
    pub(super) types: Vec<Type>,
    pub(super) constants: Vec<Constant>,
    pub(super) inputs: Vec<Input>,
    pub(super) outputs: Vec<Output>,
    pub(super) runs: Vec<RunCost>,
    pub(super) masks: usize,
    pub(super) chunks: usize,
    pub(super) lanes: usize,
    pub(super) subgroup_size: usize,
    pub(super) shared_bytes: u32,
    pub(super) private_bytes: u32,
    pub(super) level: Level,
}

impl Executable {
    /// Checks, optimizes and lowers a program.
    ///
    /// # Errors
    /// If the program isn't valid, needs too many registers, or the options are out of range.
    pub fn new(mut program: Program, options: &Options) -> Result<Self, InvalidProgram> {
        let structure = |problem| Err(InvalidProgram::Structure { problem });
        let Options {
            lanes,
            subgroup_size,
            count_work,
            level,
        } = *options;
        if lanes == 0 || !lanes.is_multiple_of(CHUNK_LANES) || lanes > MAX_LANES {
            return structure("the lanes of a batch aren't a multiple of 16 within bounds");
        }
        if !subgroup_size.is_power_of_two() || !(4..=MAX_SUBGROUP_SIZE).contains(&subgroup_size) {
            return structure("the subgroup size isn't a power of two within bounds");
        }
        validate(&program)?;
        optimize(&mut program, level);
        let width = lanes / CHUNK_LANES;
        let allocation = allocate(&program, &varying_registers(&program), width);
        if allocation.chunks > MAX_CHUNKS {
            return structure("too many registers are live at once");
        }
        let Lowered { steps, masks, runs } = lower(&program, &allocation, count_work);
        Ok(Self {
            steps,
            masks,
            runs,
            chunks: allocation.chunks,
            slots: allocation.slots,
            types: program
                .registers
                .iter()
                .map(|register| register.ty)
                .collect(),
            constants: program.constants,
            inputs: program.inputs,
            outputs: program.outputs,
            shared_bytes: program.shared_bytes,
            private_bytes: program.private_bytes,
            lanes,
            subgroup_size,
            level,
        })
    }

    /// An executable of one chunk without steps, with room for one operation's registers.
    pub(super) fn empty(level: Level) -> Self {
        Self {
            steps: Vec::new(),
            slots: Vec::new(),
            types: Vec::new(),
            constants: Vec::new(),
            inputs: Vec::new(),
            outputs: Vec::new(),
            runs: Vec::new(),
            masks: usize::from(MaskId::FIRST_FREE),
            chunks: 10,
            lanes: CHUNK_LANES,
            subgroup_size: 4,
            shared_bytes: 0,
            private_bytes: 0,
            level,
        }
    }

    /// Adds a register at a place.
    fn add_register(&mut self, slot: Slot, ty: Type) -> Reg {
        self.slots.push(slot);
        self.types.push(ty);
        Reg(self.slots.len() as u32 - 1)
    }

    /// Adds a constant at a place.
    pub(super) fn add_constant(&mut self, slot: Slot, ty: Type, bits: u64) {
        let reg = self.add_register(slot, ty);
        self.constants.push(Constant { reg, bits });
    }

    /// Adds an output at a place; returns its slot number.
    pub(super) fn add_output(&mut self, slot: Slot, ty: Type) -> u32 {
        let (reg, number) = (self.add_register(slot, ty), self.outputs.len() as u32);
        self.outputs.push(Output { slot: number, reg });
        number
    }

    /// Lanes of a batch.
    pub fn lanes(&self) -> usize {
        self.lanes
    }

    /// Bytes of registers of a batch.
    pub fn register_bytes(&self) -> usize {
        self.chunks * size_of::<super::Chunk>()
    }

    /// The inputs that the program reads; others need not be set.
    pub fn inputs(&self) -> &[Input] {
        &self.inputs
    }

    /// The outputs that the program has.
    pub fn outputs(&self) -> &[Output] {
        &self.outputs
    }
}
