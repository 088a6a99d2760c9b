//! Compute programs that are compiled for dispatches.

use super::pool::MachinePool;
use crate::program::interface::ComputeInput;
use fearless_simd::Level;
use isa::Options;
use isa::ir::{Program, VECTOR_LANES};
use isa::machine::Executable;
use isa::validate::InvalidProgram;

/// A compute program that is compiled for one device.
#[derive(Debug)]
pub struct ComputeProgram {
    pub(crate) machines: MachinePool,
    /// The meaning of each input, by slot.
    pub(crate) inputs: Vec<Option<ComputeInput>>,
    /// The number of invocations in a workgroup.
    pub(crate) invocations: usize,
}

impl ComputeProgram {
    /// Compiles a program. A workgroup has `invocations`, which are the first lanes of a batch in order of their index.
    /// `inputs` is the meaning of the program's inputs, by slot.
    ///
    /// # Errors
    /// [`InvalidProgram`] if the program cannot run on the device, for example because its workgroups are too large.
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
        Ok(Self { machines: MachinePool::new(Executable::new(program, &options)?), inputs, invocations })
    }
}
