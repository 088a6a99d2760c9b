//! Compiles programs to steps. This file holds the order of the passes; each pass is a module.

mod allocate;
mod constant_table;
mod dead_code;
mod fold;
mod forwarding;
mod if_conversion;
mod licm;
mod linearize;
mod propagation;
mod push_constants;
mod scopes;
mod sink;
pub mod step;
mod uniformity;
mod unroll;

use std::sync::atomic::AtomicU32;

use fearless_simd::Level;

use crate::ir::validate::{InvalidProgram, validate};
use crate::ir::{Constant, Input, MAX_LANES, MAX_SUBGROUP_SIZE, Output, Program, Reg, Role, Type, VECTOR_LANES};
use crate::kernels::registers::RegisterSlot;
use linearize::Linearized;
use step::{RunCost, Step};
use uniformity::SameInAllLanes;

/// The most vectors in a register file: 256 MiB.
const MAX_VECTORS: usize = 1 << 22;

/// Options of a program's compilation: the batch's lanes, the subgroup size, counting, and the SIMD level.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Lanes of a batch: a multiple of 16, at most [`MAX_LANES`].
    pub lanes: usize,
    /// Lanes of a subgroup: a power of two, at least 4 and at most [`MAX_SUBGROUP_SIZE`]. The last subgroup of a batch
    /// may be smaller.
    pub subgroup_size: usize,
    /// Lanes of a workgroup, if a batch has several: a divisor of the batch's lanes and a multiple of the subgroup
    /// size. Lane indices begin again with each.
    pub workgroup: Option<usize>,
    /// True to count the work done (see [`crate::machine::Machine::take_work`]).
    pub count_work: bool,
    /// The SIMD level of the kernels.
    pub level: Level,
}

impl Options {
    /// Options for batches and subgroups of 64 lanes, without counting.
    pub fn new(level: Level) -> Self {
        Self { lanes: 64, subgroup_size: 64, workgroup: None, count_work: false, level }
    }
}

/// A program as steps for batches of a fixed number of lanes, with the data that a machine needs to run them.
#[derive(Debug)]
pub struct CompiledProgram {
    /// The steps, in order of execution except for jumps.
    pub steps: Vec<Step>,
    /// Each register's place in the register file.
    pub slots: Vec<RegisterSlot>,
    /// Each register's type.
    pub types: Vec<Type>,
    /// Registers that are set once.
    pub constants: Vec<Constant>,
    /// Registers that the caller sets.
    pub inputs: Vec<Input>,
    /// Registers that the caller reads.
    pub outputs: Vec<Output>,
    /// The registers of outputs that are zero until they are assigned.
    pub cleared: Vec<Reg>,
    /// The cost of each counted run.
    pub runs: Vec<RunCost>,
    /// The number of masks.
    pub masks: usize,
    /// Vectors of the register file.
    pub vectors: usize,
    /// Lanes of a batch.
    pub lanes: usize,
    /// Lanes of a subgroup.
    pub subgroup_size: usize,
    /// Lanes of a workgroup.
    pub workgroup: usize,
    /// Bytes of workgroup memory.
    pub shared_bytes: u32,
    /// The first bytes of workgroup memory that the caller sets.
    pub preloaded_bytes: u32,
    /// Bytes of private memory of each lane.
    pub private_bytes: u32,
    /// The contents of private memory, if they are the same in all lanes at all times.
    pub table: Option<Vec<AtomicU32>>,
}

impl CompiledProgram {
    /// Checks, optimizes and linearizes a program.
    ///
    /// # Errors
    /// If the program isn't valid, needs too many registers, or the options are out of range.
    pub fn new(mut program: Program, options: &Options) -> Result<Self, InvalidProgram> {
        let structure = |problem| Err(InvalidProgram::Structure { problem });
        let Options { lanes, subgroup_size, workgroup, count_work, .. } = *options;
        let workgroup = workgroup.unwrap_or(lanes);
        if lanes == 0 || !lanes.is_multiple_of(VECTOR_LANES) || lanes > MAX_LANES {
            return structure("the lanes of a batch aren't a multiple of 16 within bounds");
        }
        if !subgroup_size.is_power_of_two() || !(4..=MAX_SUBGROUP_SIZE).contains(&subgroup_size) {
            return structure("the subgroup size isn't a power of two within bounds");
        }
        if workgroup != lanes {
            let divides = |lanes: usize, by: usize| by != 0 && lanes.is_multiple_of(by);
            if !divides(lanes, workgroup) || !divides(workgroup, VECTOR_LANES) || !divides(workgroup, subgroup_size) {
                return structure("the lanes of workgroups don't fit the batch's vectors and subgroups");
            }
            if program.preloaded_bytes > 0 {
                return structure("workgroups with preloaded memory don't share a batch");
            }
        }
        validate(&program)?;
        fold::fold(&mut program, None);
        dead_code::remove_dead(&mut program);
        let table = constant_table::promote_constants(&mut program);
        push_constants::load_once(&mut program);
        if unroll::unroll(&mut program) {
            propagation::propagate(&mut program);
            fold::fold(&mut program, table.as_deref());
            dead_code::remove_dead(&mut program);
        }
        if_conversion::convert_branches(&mut program);
        licm::move_invariants(&mut program);
        dead_code::remove_dead(&mut program);
        sink::sink(&mut program);
        let same = SameInAllLanes { private: table.is_some(), shared: workgroup == lanes };
        let varying = uniformity::varying_registers(&program, same);
        forwarding::forward(&mut program, &varying);
        let allocation = allocate::allocate(&program, &varying, lanes / VECTOR_LANES);
        if allocation.vectors > MAX_VECTORS {
            return structure("too many registers are live at once");
        }
        let linearized = linearize::linearize(&program, &allocation, count_work);
        let Linearized { steps, masks, runs } = linearized;
        let is_variable = |reg: &Reg| program.registers[reg.0 as usize].role == Role::Variable;
        let assigned = program.outputs.iter().map(|output| output.reg);
        let cleared = assigned.filter(is_variable).collect();
        let registers = program.registers.iter();
        Ok(Self {
            steps,
            masks,
            runs,
            cleared,
            vectors: allocation.vectors,
            slots: allocation.slots,
            types: registers.map(|register| register.ty).collect(),
            constants: program.constants,
            inputs: program.inputs,
            outputs: program.outputs,
            shared_bytes: program.shared_bytes,
            preloaded_bytes: program.preloaded_bytes,
            private_bytes: program.private_bytes,
            table: table.map(|words| words.into_iter().map(AtomicU32::new).collect()),
            lanes,
            subgroup_size,
            workgroup,
        })
    }

    /// True if a batch has several workgroups.
    pub fn has_several_workgroups(&self) -> bool {
        self.workgroup != self.lanes
    }

    /// Words of memory that each workgroup has for itself.
    pub fn shared_words(&self) -> usize {
        self.shared_bytes.div_ceil(4) as usize
    }

    /// Words of private memory that each lane has for itself.
    pub fn private_words(&self) -> usize {
        match self.table {
            Some(_) => 0,
            None => self.private_bytes as usize / 4,
        }
    }
}
