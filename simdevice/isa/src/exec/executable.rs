//! A program made ready to run.

use std::sync::Arc;
use std::sync::atomic::AtomicU32;

use fearless_simd::Level;

use super::super::forward::forward;
use super::super::ir::{
    CHUNK_LANES, Constant, Input, MAX_LANES, MAX_SUBGROUP_SIZE, Output, Program, Reg, Role, Type,
};
use super::super::optimize::optimize;
use super::super::uniformity::varying_registers;
use super::super::validate::{InvalidProgram, validate};
use super::allocate::allocate;
use super::engine::{Engine, engine};
use super::file::Slot;
use super::lower::{Lowered, lower};
use super::step::{RunCost, Step};
use super::table::take_table;

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
    /// The registers of outputs that are zero until they are assigned.
    pub(super) cleared: Vec<Reg>,
    pub(super) runs: Vec<RunCost>,
    pub(super) masks: usize,
    pub(super) chunks: usize,
    pub(super) lanes: usize,
    pub(super) subgroup_size: usize,
    pub(super) shared_bytes: u32,
    pub(super) private_bytes: u32,
    /// What private memory holds, if that is the same in all lanes at all times.
    pub(super) table: Option<Vec<AtomicU32>>,
    pub(super) engine: Arc<dyn Engine>,
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
        let table = take_table(&mut program);
        let width = lanes / CHUNK_LANES;
        let varying = varying_registers(&program, table.is_some());
        forward(&mut program, &varying);
        let role = |reg: Reg| program.registers[reg.0 as usize].role;
        let variables = program.outputs.iter().map(|output| output.reg);
        let cleared = variables.filter(|reg| role(*reg) == Role::Variable);
        let cleared = cleared.collect();
        let allocation = allocate(&program, &varying, width);
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
            cleared,
            shared_bytes: program.shared_bytes,
            private_bytes: program.private_bytes,
            table: table.map(|words| words.into_iter().map(AtomicU32::new).collect()),
            lanes,
            subgroup_size,
            engine: engine(level),
        })
    }

    /// Lanes of a batch.
    pub fn lanes(&self) -> usize {
        self.lanes
    }

    /// Words of private memory that each lane has for itself.
    pub(super) fn private_words(&self) -> usize {
        match self.table {
            Some(_) => 0,
            None => self.private_bytes as usize / 4,
        }
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
