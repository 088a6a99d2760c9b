//! Dispatches: workgroups of a compute program, a batch each, run in any order by the device's workers.

use crate::device::Device;
use crate::packet::Dispatch;
use crate::program::interface::ComputeInput;
use crate::stats::counters::{Counter, Counters};
use isa::exec::{Executable, LaneMask, Machine, Options, Stopped, Watchdog, Work};
use isa::ir::{CHUNK_LANES, Program};
use isa::resources::Resources;
use isa::validate::InvalidProgram;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How many pieces each worker's share of a dispatch is cut into, so that workers end together.
const PIECES_PER_WORKER: u64 = 16;

/// A program ready to be dispatched on one device.
#[derive(Debug)]
pub struct ComputeProgram {
    executable: Arc<Executable>,
    inputs: Vec<Option<ComputeInput>>,
    invocations: usize,
    /// Machines of earlier dispatches, to be used again.
    idle: Mutex<Vec<Machine>>,
}

impl ComputeProgram {
    /// Makes a program ready. A workgroup has `invocations`, which are the batch's first lanes in order of their
    /// index; `inputs` says by slot what the program's inputs are.
    ///
    /// # Errors
    /// [`InvalidProgram`] if the program cannot run on the device, be it for the size of its workgroups.
    pub fn new(
        device: &Device,
        program: Program,
        invocations: u32,
        subgroup_size: u32,
        inputs: Vec<Option<ComputeInput>>,
    ) -> Result<Self, InvalidProgram> {
        let invocations = invocations as usize;
        let options = Options {
            lanes: invocations.next_multiple_of(CHUNK_LANES),
            subgroup_size: subgroup_size as usize,
            count_work: true,
            level: device.level(),
        };
        Ok(Self {
            executable: Arc::new(Executable::new(program, &options)?),
            inputs,
            invocations,
            idle: Mutex::default(),
        })
    }

    fn machine(&self) -> Machine {
        let idle = self
            .idle
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .pop();
        idle.unwrap_or_else(|| Machine::new(Arc::clone(&self.executable)))
    }

    fn put_back(&self, machine: Machine) {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        idle.push(machine);
    }
}

/// Runs all workgroups of a dispatch.
///
/// # Errors
/// [`Stopped`] if one ran for too long. What was written until then stays written.
pub(crate) fn dispatch(
    dispatch: &Dispatch,
    device: &Device,
    counters: &mut Counters,
) -> Result<(), Stopped> {
    let Some(groups) = group_count(dispatch.count).filter(|&groups| groups > 0) else {
        return Ok(());
    };
    let prepared = dispatch.bindings.prepare(device.level());
    let threads = device.threads() as u64;
    let job = Job {
        dispatch,
        groups,
        piece: (groups / (threads * PIECES_PER_WORKER)).max(1),
        next: AtomicU64::new(0),
        cancel: AtomicBool::new(false),
        resources: prepared.resources(),
        limit: device.config().shader_timeout,
    };
    let started = Instant::now();
    let ran = match groups.min(threads) {
        1 => job.work(),
        workers => device.install(|| {
            let results = (0..workers).into_par_iter().map(|_| job.work());
            results.reduce(|| Ok(Work::default()), merge)
        }),
    };
    dispatch.bindings.bump_generations();
    counters.add(Counter::ShaderTime, started.elapsed().as_nanos() as u64);
    counters.add(
        Counter::ComputeInvocations,
        groups.saturating_mul(dispatch.program.invocations as u64),
    );
    counters.add_work(&ran?);
    Ok(())
}

/// How many workgroups a dispatch has; `None` if nobody could count them.
fn group_count(count: [u32; 3]) -> Option<u64> {
    count
        .into_iter()
        .try_fold(1u64, |product, count| product.checked_mul(count.into()))
}

/// Both results' work, or the first reason why one stopped; that others were cancelled then tells nothing.
fn merge(a: Result<Work, Stopped>, b: Result<Work, Stopped>) -> Result<Work, Stopped> {
    match (a, b) {
        (Ok(mut a), Ok(b)) => {
            a.add(&b);
            Ok(a)
        }
        (Err(Stopped::Cancelled), Err(stopped)) | (Err(stopped), _) | (_, Err(stopped)) => {
            Err(stopped)
        }
    }
}

/// A dispatch while workers share it.
struct Job<'a> {
    dispatch: &'a Dispatch,
    groups: u64,
    /// Workgroups that a worker takes at a time.
    piece: u64,
    /// The first workgroup that nobody took.
    next: AtomicU64,
    /// Set when one worker stopped, so that the others do, too.
    cancel: AtomicBool,
    resources: Resources<'a>,
    limit: Duration,
}

impl Job<'_> {
    /// One worker's share: takes workgroups until none is left.
    fn work(&self) -> Result<Work, Stopped> {
        let program = &self.dispatch.program;
        let mut machine = program.machine();
        self.set_inputs(&mut machine, |input| match input {
            ComputeInput::WorkgroupCount(axis) => Some(self.dispatch.count[axis]),
            ComputeInput::WorkgroupId(_) => None,
        });
        let mut ran = Ok(());
        while ran.is_ok() {
            let first = self.next.fetch_add(self.piece, Relaxed);
            if first >= self.groups || self.cancel.load(Relaxed) {
                break;
            }
            let last = (first + self.piece).min(self.groups);
            ran = (first..last).try_for_each(|group| self.run(&mut machine, group));
        }
        let work = machine.take_work();
        program.put_back(machine);
        ran.inspect_err(|_| self.cancel.store(true, Relaxed))?;
        Ok(work)
    }

    fn run(&self, machine: &mut Machine, group: u64) -> Result<(), Stopped> {
        let [width, height, _] = self.dispatch.count.map(u64::from);
        let number = [
            group % width,
            group / width % height,
            group / width / height,
        ];
        let base = self.dispatch.base;
        self.set_inputs(machine, |input| match input {
            ComputeInput::WorkgroupId(axis) => Some(base[axis].wrapping_add(number[axis] as u32)),
            ComputeInput::WorkgroupCount(_) => None,
        });
        machine.run(
            &LaneMask::first(self.dispatch.program.invocations),
            &LaneMask::none(),
            &self.resources,
            Watchdog {
                limit: self.limit,
                cancel: Some(&self.cancel),
            },
        )
    }

    /// Sets the inputs for which there is a value.
    fn set_inputs(&self, machine: &mut Machine, value: impl Fn(ComputeInput) -> Option<u32>) {
        for (slot, input) in self.dispatch.program.inputs.iter().enumerate() {
            if let Some(value) = input.and_then(&value) {
                machine.fill_input(slot as u32, value);
            }
        }
    }
}
