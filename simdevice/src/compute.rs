//! Dispatches: workgroups of a compute program. Each workgroup is one batch; the device's workers run them in any
//! order.

use crate::packet::Dispatch;
use crate::program::interface::ComputeInput;
use crate::program::pool::PooledMachine;
use crate::runtime::Runtime;
use crate::stats::counters::{Counter, Counters};
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
    let piece = groups / (runtime.threads() as u64 * PIECES_PER_WORKER);
    let cancel = AtomicBool::new(false);
    let run = DispatchRun {
        dispatch,
        resources: bound.resources(),
        watchdog: Watchdog { limit: runtime.config().shader_timeout, cancel: Some(&cancel) },
    };
    let started = Instant::now();
    let (machines, ran) = runtime.share(
        0..groups,
        piece.max(1),
        &cancel,
        || run.machine(),
        |machine, group| run.run_group(machine, group),
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
    resources: Resources<'a>,
    watchdog: Watchdog<'a>,
}

impl DispatchRun<'_> {
    /// Lends a machine and sets the inputs that are the same for all workgroups.
    fn machine(&self) -> PooledMachine<'_> {
        let mut machine = self.dispatch.program.machines.lend();
        self.set_inputs(&mut machine, |input| match input {
            ComputeInput::WorkgroupCount(axis) => Some(self.dispatch.count[axis]),
            ComputeInput::WorkgroupId(_) => None,
        });
        machine
    }

    fn run_group(&self, machine: &mut Machine, group: u64) -> Result<(), Stopped> {
        let [width, height, _] = self.dispatch.count.map(u64::from);
        let number = [group % width, group / width % height, group / width / height];
        let base = self.dispatch.base;
        self.set_inputs(machine, |input| match input {
            ComputeInput::WorkgroupId(axis) => Some(base[axis].wrapping_add(number[axis] as u32)),
            ComputeInput::WorkgroupCount(_) => None,
        });
        machine.run(
            &LaneMask::first(self.dispatch.program.invocations),
            &LaneMask::none(),
            &self.resources,
            self.watchdog,
        )
    }

    /// Sets the inputs that `value` returns a value for.
    fn set_inputs(&self, machine: &mut Machine, value: impl Fn(ComputeInput) -> Option<u32>) {
        for (slot, input) in self.dispatch.program.inputs.iter().enumerate() {
            if let Some(value) = input.and_then(&value) {
                machine.fill_input(slot as u32, value);
            }
        }
    }
}
