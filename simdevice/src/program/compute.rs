//! Compute programs that are compiled for dispatches.

use super::pool::MachinePool;
use crate::program::interface::ComputeInput;
use fearless_simd::Level;
use isa::Options;
use isa::ir::{Program, Rate, VECTOR_LANES};
use isa::machine::Executable;
use isa::validate::InvalidProgram;

/// The lanes that several small workgroups fill together.
const SHARED_LANES: usize = 256;

/// The greatest private memory of an invocation, in bytes, with which they do: it should stay in the nearest caches.
const SHARED_PRIVATE_BYTES: u32 = 256;

/// The greatest workgroup memory of all of them, in bytes, for the same reason.
const SHARED_WORKGROUP_BYTES: u32 = 16 << 10;

/// A compute program that is compiled for one device.
#[derive(Debug)]
pub struct ComputeProgram {
    pub(crate) machines: MachinePool,
    /// The meaning of each input, by slot.
    pub(crate) inputs: Vec<Option<ComputeInput>>,
    /// The number of invocations in a workgroup.
    pub(crate) invocations: usize,
    /// The number of workgroups that a batch may have.
    pub(crate) groups: usize,
}

impl ComputeProgram {
    /// Compiles a program. A workgroup has `invocations`, which are consecutive lanes of a batch in order of their index.
    /// `inputs` is the meaning of the program's inputs, by slot.
    ///
    /// # Errors
    /// [`InvalidProgram`] if the program cannot run on the device, for example because its workgroups are too large.
    pub fn new(
        level: Level,
        mut program: Program,
        invocations: u32,
        subgroup_size: u32,
        inputs: Vec<Option<ComputeInput>>,
    ) -> Result<Self, InvalidProgram> {
        let (invocations, subgroup_size) = (invocations as usize, subgroup_size as usize);
        let groups = groups_of_batch(&program, invocations, subgroup_size);
        let is_group_id = |slot: u32| matches!(inputs.get(slot as usize), Some(Some(ComputeInput::WorkgroupId(_))));
        if groups > 1 {
            for input in program.inputs.iter_mut().filter(|input| is_group_id(input.slot)) {
                input.rate = Rate::Varying;
            }
        }
        let lanes = invocations.next_multiple_of(VECTOR_LANES);
        let options = Options { lanes: groups * lanes, subgroup_size, workgroup: Some(lanes), count_work: true, level };
        Ok(Self { machines: MachinePool::new(Executable::new(program, &options)?), inputs, invocations, groups })
    }
}

/// The number of workgroups of a program that share a batch, so that an instruction is decoded once for all of them.
/// They run in lockstep, so that none may wait for another.
fn groups_of_batch(program: &Program, invocations: usize, subgroup_size: usize) -> usize {
    let fits = |lanes: usize| lanes != 0 && invocations.is_multiple_of(lanes);
    let is_small = program.private_bytes <= SHARED_PRIVATE_BYTES && program.preloaded_bytes == 0;
    if fits(VECTOR_LANES) && fits(subgroup_size) && is_small && !program.may_wait() {
        let by_memory = SHARED_WORKGROUP_BYTES / program.shared_bytes.max(1);
        (SHARED_LANES / invocations.max(1)).min(by_memory as usize).max(1)
    } else {
        1
    }
}
