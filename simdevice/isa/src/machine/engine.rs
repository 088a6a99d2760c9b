//! Runs steps: the loop over them, and the kernels that they call, for one SIMD level.

use std::fmt;
use std::sync::Arc;

use devmem::dispatch;
use fearless_simd::{Level, Simd};

use super::batch::Batch;
use super::masks::Masks;
use super::watchdog::{Stopped, Watch};
use super::{cross_lane, image, memory, subgroup};
use crate::clock::host_time;
use crate::compiler::step::{MaskId, Step};
use crate::ir::Statement;
use crate::ir::op::Op;
use crate::kernels::arithmetic::kernel;
use crate::kernels::registers::{Kernel, RegisterFile, RegisterSlot};

/// Runs a batch's steps. There is one implementation, compiled for each SIMD level.
pub trait Engine: fmt::Debug + Send + Sync {
    /// Runs a batch whose active lanes are set. `runs` are the executions and active lanes of each counted run.
    fn run(&self, batch: &Batch<'_>, runs: &mut [(u64, u64)], watch: &mut Watch<'_>) -> Result<(), Stopped>;
}

/// The engine of a SIMD level.
pub fn engine(level: Level) -> Arc<dyn Engine> {
    dispatch!(level, simd => Arc::new(Kernels::new(simd)) as Arc<dyn Engine>)
}

/// The kernels of all operations, by the operation's number.
struct Kernels<S> {
    simd: S,
    by_op: [Kernel<S>; 256],
}

impl<S: Simd> Kernels<S> {
    fn new(simd: S) -> Self {
        let mut by_op: [Kernel<S>; 256] = [|_, _, _, _| {}; 256];
        for &op in Op::ALL {
            by_op[usize::from(op as u8)] = kernel(op);
        }
        Self { simd, by_op }
    }
}

impl<S: Simd> fmt::Debug for Kernels<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Kernels<{:?}>", self.simd)
    }
}

impl<S: Simd> Engine for Kernels<S> {
    fn run(&self, batch: &Batch<'_>, runs: &mut [(u64, u64)], watch: &mut Watch<'_>) -> Result<(), Stopped> {
        self.simd.vectorize(
            #[inline(always)]
            || run_steps(self, batch, runs, watch),
        )
    }
}

/// The loop over the steps.
#[inline(always)]
fn run_steps<S: Simd>(
    kernels: &Kernels<S>,
    batch: &Batch<'_>,
    runs: &mut [(u64, u64)],
    watch: &mut Watch<'_>,
) -> Result<(), Stopped> {
    let simd = kernels.simd;
    let mut batch = *batch;
    let masks = batch.masks;
    let steps = &batch.program.steps[..];
    batch.refresh_span();
    let mut next = 0;
    while let Some(step) = steps.get(next) {
        next += 1;
        // By far the most frequent step is tested first.
        if let Step::Compute { op, dst, src } = step {
            kernels.by_op[usize::from(*op as u8)](simd, &batch.file, *dst, src);
            continue;
        }
        match step {
            Step::ComputeAssign { op, dst, temporary, src } => {
                let kernel = kernels.by_op[usize::from(*op as u8)];
                if batch.whole {
                    kernel(simd, &batch.file, *dst, src);
                } else {
                    kernel(simd, &batch.file, *temporary, src);
                    batch.assign(simd, *dst, *temporary, op.signature().result_type);
                }
            }
            Step::Assign { dst, src, ty } => batch.assign(simd, *dst, *src, *ty),
            Step::Copy { dst, src, ty } => batch.copy(*dst, *src, *ty),
            Step::Other(statement) => run_statement(&batch, simd, statement),
            Step::Count(run) => {
                let (executions, active) = &mut runs[*run as usize];
                *executions += 1;
                *active += masks.count(MaskId::ACTIVE);
            }
            Step::Jump(target) => next = *target as usize,
            Step::Unless { condition, target } => {
                if !batch.file.first::<bool>(*condition) {
                    next = *target as usize;
                }
            }
            Step::Repeat(head) => {
                if masks.any(MaskId::ACTIVE) {
                    watch.tick()?;
                    next = *head as usize;
                }
            }
            Step::Clear(mask) => masks.clear(*mask),
            Step::End => break,
            control => {
                let target = branch(simd, batch.file, masks, control);
                batch.refresh_span();
                if let Some(target) = target {
                    next = target as usize;
                }
            }
        }
    }
    Ok(())
}

/// Updates the masks. Returns the step to jump to; None to go on with the next.
#[inline(always)]
fn branch<S: Simd>(simd: S, file: RegisterFile<'_>, masks: Masks<'_>, step: &Step) -> Option<u32> {
    let unless_any = |target: u32| (!masks.any(MaskId::ACTIVE)).then_some(target);
    match step {
        Step::If { condition, other, target } => {
            let other = masks.get(*other);
            masks.split(simd, file, *condition, |active, taken, word| {
                other[word].set(active.get() & !taken);
                active.set(taken);
            });
            unless_any(*target)
        }
        Step::Else { other, target } => {
            masks.swap(MaskId::ACTIVE, *other);
            unless_any(*target)
        }
        Step::Join { mask, target } => {
            masks.join(MaskId::ACTIVE, *mask);
            unless_any(*target)
        }
        Step::Leave { into, target } => {
            masks.join(*into, MaskId::ACTIVE);
            masks.clear(MaskId::ACTIVE);
            Some(*target)
        }
        Step::LeaveIf { condition, when, into, target } => {
            let into = masks.get(*into);
            masks.split(simd, file, *condition, |active, taken, word| {
                let leaving = if *when { taken } else { active.get() & !taken };
                into[word].set(into[word].get() | leaving);
                active.set(active.get() & !leaving);
            });
            unless_any(*target)
        }
        Step::Switch { selector, values, entered, unmatched } => {
            masks.copy(*entered, MaskId::ACTIVE);
            masks.copy(*unmatched, MaskId::ACTIVE);
            select_lanes(file, masks, *selector, values, *entered, |word, bits| {
                let unmatched = &masks.get(*unmatched)[word];
                unmatched.set(unmatched.get() & !bits);
            });
            masks.clear(MaskId::ACTIVE);
            None
        }
        Step::Case { selector, values, entered, unmatched, target } => {
            select_lanes(file, masks, *selector, values, *entered, |word, bits| {
                let active = &masks.get(MaskId::ACTIVE)[word];
                active.set(active.get() | bits);
            });
            if let Some(unmatched) = unmatched {
                masks.join(MaskId::ACTIVE, *unmatched);
            }
            unless_any(*target)
        }
        Step::Kill(target) => {
            masks.join(MaskId::KILLED, MaskId::ACTIVE);
            masks.clear(MaskId::ACTIVE);
            Some(*target)
        }
        Step::Demote => {
            masks.join(MaskId::KILLED, MaskId::ACTIVE);
            masks.join(MaskId::HELPER, MaskId::ACTIVE);
            None
        }
        // The loop over the steps has taken the others.
        _ => None,
    }
}

/// Calls `found(word, lanes)` for the lanes of a mask whose selector is one of `values`.
fn select_lanes(
    file: RegisterFile<'_>,
    masks: Masks<'_>,
    selector: RegisterSlot,
    values: &[u32],
    among: MaskId,
    found: impl Fn(usize, u64),
) {
    for (word, lanes) in masks.get(among).iter().enumerate() {
        let mut bits = 0;
        for vector in 4 * word..(4 * word + 4).min(file.width()) {
            let selectors = file.lanes::<u32>(selector, vector);
            for (lane, selector) in selectors.iter().enumerate() {
                bits |= u64::from(values.contains(selector)) << (16 * (vector % 4) + lane);
            }
        }
        found(word, bits & lanes.get());
    }
}

/// Runs a statement that reads other lanes or accesses memory. It is kept out of the loop over the steps, so that its
/// cases don't take machine registers from the common steps.
#[inline(never)]
fn run_statement<S: Simd>(batch: &Batch<'_>, simd: S, statement: &Statement) {
    match statement {
        Statement::LaneIndex { dst } => {
            let vectors = batch.program.workgroup / 16;
            for vector in 0..batch.file.width() {
                let first = 16 * (vector % vectors);
                let lanes: [u32; 16] = std::array::from_fn(|lane| (first + lane) as u32);
                batch.file.set(batch.slot(*dst), vector, lanes);
            }
        }
        Statement::IsHelper { dst } => {
            for vector in 0..batch.file.width() {
                let helpers = batch.masks.bits(MaskId::HELPER, vector);
                let lanes: [bool; 16] = std::array::from_fn(|lane| helpers >> lane & 1 != 0);
                batch.file.set(batch.slot(*dst), vector, lanes);
            }
        }
        Statement::Clock { dst } => {
            let time = host_time();
            for vector in 0..batch.file.width() {
                batch.file.set(batch.slot(*dst), vector, [time; 16]);
            }
        }
        Statement::Load { dst, address, format } => {
            batch.for_each_memory(&address.space, |batch| memory::load(batch, simd, dst, address, *format));
        }
        Statement::Store { src, address, format } => {
            batch.for_each_memory(&address.space, |batch| memory::store(batch, simd, src, address, *format));
        }
        Statement::Atomic { op, dst, address, format, value, comparator } => {
            let (value, comparator) = (*value, *comparator);
            batch.for_each_memory(&address.space, |batch| {
                memory::atomic(batch, simd, *op, *dst, address, *format, value, comparator);
            });
        }
        Statement::BufferSize { dst, buffer } => memory::buffer_size(batch, *dst, buffer),
        Statement::Sample(sample) => simd.vectorize(
            #[inline(always)]
            || image::sample(batch, sample),
        ),
        Statement::ImageRead(read) => simd.vectorize(
            #[inline(always)]
            || image::read(batch, read),
        ),
        Statement::ImageWrite(write) => simd.vectorize(
            #[inline(always)]
            || image::write(batch, write),
        ),
        Statement::ImageAtomic(atomic) => image::atomic(batch, atomic),
        Statement::ImageQuery { dst, image, shape, query } => image::query(batch, dst, image, *shape, query),
        Statement::Derivative { dst, src, axis, fine } => cross_lane::derivative(batch, *dst, *src, *axis, *fine),
        Statement::Subgroup { op, dst, src, index } => subgroup::subgroup(batch, simd, *op, dst, *src, *index),
        // All other statements are arithmetic or control flow, which have steps of their own.
        _ => {}
    }
}
