//! Compute programs made ready for dispatches.

use super::pool::MachinePool;
use crate::program::interface::ComputeInput;
use fearless_simd::Level;
use isa::Options;
use isa::ir::{Program, VECTOR_LANES};
use isa::machine::Executable;
use isa::validate::InvalidProgram;

/// A program ready to be dispatched on one device.
#[derive(Debug)]
pub struct ComputeProgram {
    pub(crate) machines: MachinePool,
    /// By slot.
    pub(crate) inputs: Vec<Option<ComputeInput>>,
    /// Invocations of a workgroup.
    pub(crate) invocations: usize,
}

impl ComputeProgram {
    /// Makes a program ready. A workgroup has `invocations`, which are the batch's first lanes in order of their
    /// index; `inputs` says by slot what the program's inputs are.
    ///
    /// # Errors
    /// [`InvalidProgram`] if the program cannot run on the device, be it for the size of its workgroups.
    pub fn new(
        level: Level,
        program: Program,
        invocations: u32,
        subgroup_size: u32,
        inputs: Vec<Option<ComputeInput>>,
    ) -> Result<Self, InvalidProgram> {
        let invocations = invocations as usize;
        let options = Options {
            lanes: invocations.next_multiple_of(VECTOR_LANES),
            subgroup_size: subgroup_size as usize,
            count_work: true,
            level,
        };
        Ok(Self {
            machines: MachinePool::new(Executable::new(program, &options)?),
            inputs,
            invocations,
        })
    }
}
