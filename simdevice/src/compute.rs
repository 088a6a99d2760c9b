//! Dispatches: workgroups of a compute program. Each workgroup is one batch, or several small ones share one; the device's
//! workers run batches in any order.

use crate::packet::Dispatch;
use crate::program::interface::ComputeInput;
use crate::program::pool::PooledMachine;
use crate::runtime::Runtime;
use crate::stats::counters::{Counter, Counters};
use isa::Vector;
use isa::ir::VECTOR_LANES;
use isa::machine::{LaneMask, Machine, Stopped, Watchdog};
use isa::resources::Resources;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// The number of pieces that each worker's share of a dispatch is cut into, so that all workers end at about the same
/// time.
const PIECES_PER_WORKER: u64 = 16;

/// Runs all workgroups of a dispatch.
///
/// # Errors
/// [`Stopped`] if a workgroup ran for too long. The memory that was written until then stays written.
pub(crate) fn dispatch(dispatch: &Dispatch, runtime: &Runtime, counters: &mut Counters) -> Result<(), Stopped> {
    let Some(groups) = group_count(dispatch.count).filter(|&groups| groups > 0) else {
        return Ok(());
    };
    let bound = dispatch.bindings.bind(runtime.level());
    // Every worker gets a batch before any batch gets more groups.
    let threads = runtime.threads() as u64;
    let together = groups.div_ceil(threads).min(dispatch.program.groups as u64);
    let batches = groups.div_ceil(together);
    let piece = batches / (threads * PIECES_PER_WORKER);
    let cancel = AtomicBool::new(false);
    let run = DispatchRun {
        dispatch,
        groups,
        together,
        resources: bound.resources(),
        watchdog: Watchdog { limit: runtime.config().shader_timeout, cancel: Some(&cancel) },
    };
    let started = Instant::now();
    let (machines, ran) = runtime.share(
        0..batches,
        piece.max(1),
        &cancel,
        || run.machine(),
        |machine, batch| run.run_batch(machine, batch),
    );
    dispatch.bindings.bump_generations();
    counters.add(Counter::ShaderTime, started.elapsed().as_nanos() as u64);
    counters.add(Counter::ComputeInvocations, groups.saturating_mul(dispatch.program.invocations as u64));
    for mut machine in machines {
        let work = machine.take_work();
        if ran.is_ok() {
            counters.add_work(&work);
        }
    }
    ran
}

/// The number of workgroups of a dispatch; `None` if it exceeds 64 bits.
fn group_count(count: [u32; 3]) -> Option<u64> {
    count.into_iter().try_fold(1u64, |product, count| product.checked_mul(count.into()))
}

/// A dispatch that workers share.
struct DispatchRun<'a> {
    dispatch: &'a Dispatch,
    /// The number of workgroups.
    groups: u64,
    /// The number of workgroups of a batch. The last batch may have fewer.
    together: u64,
    resources: Resources<'a>,
    watchdog: Watchdog<'a>,
}

impl DispatchRun<'_> {
    /// Lends a machine and sets the inputs that are the same for all workgroups.
    fn machine(&self) -> PooledMachine<'_> {
        let mut machine = self.dispatch.program.machines.lend();
        for (slot, input) in self.dispatch.program.inputs.iter().enumerate() {
            if let Some(ComputeInput::WorkgroupCount(axis)) = input {
                machine.fill_input(slot as u32, self.dispatch.count[*axis]);
            }
        }
        machine
    }

    fn run_batch(&self, machine: &mut Machine, batch: u64) -> Result<(), Stopped> {
        let program = &self.dispatch.program;
        let first = batch * self.together;
        let end = self.groups.min(first + self.together);
        for (slot, input) in program.inputs.iter().enumerate() {
            if let Some(ComputeInput::WorkgroupId(axis)) = input {
                self.set_group_ids(machine, slot as u32, *axis, first..end);
            }
        }
        let lanes = (end - first) as usize * program.invocations;
        machine.run(&LaneMask::first(lanes), &LaneMask::none(), &self.resources, self.watchdog)
    }

    /// Sets an input to the numbers of workgroups along an axis, each for its lanes.
    fn set_group_ids(&self, machine: &mut Machine, slot: u32, axis: usize, groups: std::ops::Range<u64>) {
        let vectors = machine.input_mut(slot);
        let of_group = (vectors.len() / self.dispatch.program.groups).max(1);
        for (group, vectors) in groups.zip(vectors.chunks_mut(of_group)) {
            vectors.fill(Vector([self.group_id(group)[axis]; VECTOR_LANES]));
        }
    }

    /// The position of a workgroup, given its number.
    fn group_id(&self, group: u64) -> [u32; 3] {
        let [width, height, _] = self.dispatch.count.map(u64::from);
        let number = [group % width, group / width % height, group / width / height];
        [0, 1, 2].map(|axis: usize| self.dispatch.base[axis].wrapping_add(number[axis] as u32))
    }
}
