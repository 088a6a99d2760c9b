//! The machine: registers and memory of one batch, and the loop over its steps.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use fearless_simd::{Simd, dispatch};

use super::super::ir::{Reg, Type};
use super::super::resources::Resources;
use super::batch::Batch;
use super::compute::compute;
use super::counters::Work;
use super::executable::Executable;
use super::file::{Chunk, File, Slot};
use super::mask::{LaneMask, MaskId, Masks};
use super::set_all;
use super::step::Step;
use super::watchdog::{Stopped, Watch, Watchdog};

/// Runs batches of one executable, one after another. Each worker has its own.
#[derive(Debug)]
pub struct Machine {
    executable: Arc<Executable>,
    registers: Vec<Chunk>,
    masks: Vec<u64>,
    shared: Vec<AtomicU32>,
    private: Vec<Chunk>,
    work: Work,
    /// For each counted run, how often it was executed and with how many lanes.
    runs: Vec<(u64, u64)>,
}

impl Machine {
    /// A machine for an executable; all inputs are zero.
    pub fn new(executable: Arc<Executable>) -> Self {
        let width = executable.lanes / 16;
        let mut machine = Self {
            registers: vec![Chunk::default(); executable.chunks],
            masks: vec![0; executable.masks * executable.lanes.div_ceil(64)],
            shared: (0..executable.shared_bytes.div_ceil(4))
                .map(|_| AtomicU32::new(0))
                .collect(),
            private: vec![Chunk::default(); executable.private_bytes as usize / 4 * width],
            work: Work::default(),
            runs: vec![(0, 0); executable.runs.len()],
            executable,
        };
        let file = File::new(
            Cell::from_mut(&mut machine.registers[..]).as_slice_of_cells(),
            width,
        );
        for constant in &machine.executable.constants {
            let (slot, ty) = (
                machine.executable.slots[constant.reg.0 as usize],
                machine.executable.types[constant.reg.0 as usize],
            );
            set_all(file, slot, ty, constant.bits);
        }
        machine
    }

    /// The executable that it runs.
    pub fn executable(&self) -> &Arc<Executable> {
        &self.executable
    }

    fn input_register(&self, slot: u32) -> Option<Reg> {
        self.executable
            .inputs
            .iter()
            .find(|input| input.slot == slot)
            .map(|input| input.reg)
    }

    /// The chunks of a register.
    fn chunks_of(&self, reg: Reg) -> std::ops::Range<usize> {
        let slot = self.executable.slots[reg.0 as usize];
        let per_16 = if self.executable.types[reg.0 as usize] == Type::B64 {
            2
        } else {
            1
        };
        let count = if slot.is_varying() {
            self.executable.lanes / 16
        } else {
            1
        };
        slot.start()..slot.start() + count * per_16
    }

    /// An input's lanes, to be filled: 16 to a chunk (8 to a chunk for `B64`); a uniform input has one chunk, of which
    /// all lanes must be set alike. Bools are 0 or all ones. Empty if the program doesn't read that slot.
    ///
    /// Varying inputs must be set before each batch; uniform ones keep their value.
    pub fn input_mut(&mut self, slot: u32) -> &mut [Chunk] {
        match self.input_register(slot) {
            Some(reg) => {
                let range = self.chunks_of(reg);
                &mut self.registers[range]
            }
            None => &mut [],
        }
    }

    /// Sets one lane of a 32-bit input.
    pub fn set_input(&mut self, slot: u32, lane: usize, bits: u32) {
        if let Some(chunk) = self.input_mut(slot).get_mut(lane / 16) {
            chunk.0[lane % 16] = bits;
        }
    }

    /// Sets all lanes of a 32-bit input.
    pub fn fill_input(&mut self, slot: u32, bits: u32) {
        self.input_mut(slot).fill(Chunk([bits; 16]));
    }

    /// Sets one lane of a 64-bit input.
    pub fn set_input64(&mut self, slot: u32, lane: usize, bits: u64) {
        if let Some(chunk) = self.input_mut(slot).get_mut(lane / 8) {
            chunk.0[2 * (lane % 8)] = bits as u32;
            chunk.0[2 * (lane % 8) + 1] = (bits >> 32) as u32;
        }
    }

    /// An output's lanes after a batch: 16 to a chunk (8 for `B64`). Empty if the program has no such output.
    pub fn output_chunks(&self, slot: u32) -> &[Chunk] {
        let output = self
            .executable
            .outputs
            .iter()
            .find(|output| output.slot == slot);
        output.map_or(&[], |output| &self.registers[self.chunks_of(output.reg)])
    }

    /// One lane of a 32-bit output; zero if the program has no such output.
    pub fn output(&self, slot: u32, lane: usize) -> u32 {
        self.output_chunks(slot)
            .get(lane / 16)
            .map_or(0, |chunk| chunk.0[lane % 16])
    }

    /// One lane of a 64-bit output.
    pub fn output64(&self, slot: u32, lane: usize) -> u64 {
        self.output_chunks(slot).get(lane / 8).map_or(0, |chunk| {
            u64::from(chunk.0[2 * (lane % 8)]) | u64::from(chunk.0[2 * (lane % 8) + 1]) << 32
        })
    }

    /// The lanes that the last batch killed or demoted.
    pub fn killed(&mut self) -> LaneMask {
        let width = self.executable.lanes.div_ceil(64);
        let masks = Masks::new(
            Cell::from_mut(&mut self.masks[..]).as_slice_of_cells(),
            width,
        );
        LaneMask::from_words(masks.get(MaskId::KILLED))
    }

    /// The work counted since it was last taken; nothing, unless the executable counts.
    pub fn take_work(&mut self) -> Work {
        for ((executions, active), cost) in self.runs.iter_mut().zip(&self.executable.runs) {
            self.work
                .add_run(cost, *executions, *active, self.executable.lanes);
            (*executions, *active) = (0, 0);
        }
        std::mem::take(&mut self.work)
    }

    /// Runs a batch. `active` are the lanes that run; `helpers` those among them that only help with derivatives.
    ///
    /// # Errors
    /// If the watchdog stopped it; what it wrote until then stays written.
    pub fn run(
        &mut self,
        active: &LaneMask,
        helpers: &LaneMask,
        resources: &Resources<'_>,
        watchdog: Watchdog<'_>,
    ) -> Result<(), Stopped> {
        let executable = Arc::clone(&self.executable);
        self.work.batches += 1;
        self.begin(active, helpers);
        let file = File::new(
            Cell::from_mut(&mut self.registers[..]).as_slice_of_cells(),
            executable.lanes / 16,
        );
        let masks = Masks::new(
            Cell::from_mut(&mut self.masks[..]).as_slice_of_cells(),
            executable.lanes.div_ceil(64),
        );
        let batch = Batch {
            executable: &executable,
            resources,
            file,
            masks,
            shared: &self.shared,
            private: Cell::from_mut(&mut self.private[..]).as_slice_of_cells(),
        };
        if !masks.any(MaskId::ACTIVE) {
            return Ok(());
        }
        let runs = &mut self.runs[..];
        let mut watch = Watch::new(watchdog);
        dispatch!(executable.level, simd => run_steps(simd, &batch, runs, &mut watch))
    }

    /// Sets masks, outputs and workgroup memory as they are when a batch begins.
    fn begin(&mut self, active: &LaneMask, helpers: &LaneMask) {
        let lanes = self.executable.lanes;
        let width = lanes.div_ceil(64);
        self.masks.fill(0);
        let whole = LaneMask::first(lanes);
        for (index, whole) in whole.words().iter().enumerate() {
            let word = |mask: &LaneMask| mask.words().get(index).copied().unwrap_or(0) & whole;
            self.masks[usize::from(MaskId::ACTIVE.0) * width + index] = word(active);
            self.masks[usize::from(MaskId::ENTRY.0) * width + index] = word(active);
            self.masks[usize::from(MaskId::HELPER.0) * width + index] = word(helpers);
        }
        for index in 0..self.executable.outputs.len() {
            let range = self.chunks_of(self.executable.outputs[index].reg);
            self.registers[range].fill(Chunk::default());
        }
        self.shared.iter().for_each(|word| word.store(0, Relaxed));
    }
}

/// The loop over the steps.
#[inline(always)]
fn run_steps<S: Simd>(
    simd: S,
    batch: &Batch<'_>,
    runs: &mut [(u64, u64)],
    watch: &mut Watch<'_>,
) -> Result<(), Stopped> {
    let (file, masks) = (batch.file, batch.masks);
    let steps = &batch.executable.steps[..];
    let mut next = 0;
    while let Some(step) = steps.get(next) {
        next += 1;
        // There is one copy of the kernels, so both kinds of computation meet here.
        let computation = match step {
            Step::Compute { op, dst, src } => Some((*op, *dst, src, None)),
            Step::ComputeAssign { op, dst, src, .. } if masks.is_whole() => {
                Some((*op, *dst, src, None))
            }
            Step::ComputeAssign { op, dst, via, src } => Some((*op, *via, src, Some(*dst))),
            _ => None,
        };
        if let Some((op, target, src, assigned)) = computation {
            compute(simd, file, op, target, src);
            if let Some(dst) = assigned {
                batch.assign(simd, dst, target, op.signature().result);
            }
            continue;
        }
        let jump = match step {
            Step::Assign { dst, src, ty } => {
                batch.assign(simd, *dst, *src, *ty);
                None
            }
            Step::Copy { dst, src, ty } => {
                batch.copy(*dst, *src, *ty);
                None
            }
            Step::Other(statement) => {
                batch.other(statement);
                None
            }
            Step::Count(run) => {
                let (executions, active) = &mut runs[*run as usize];
                *executions += 1;
                *active += masks.count(MaskId::ACTIVE);
                None
            }
            Step::Repeat(head) => {
                if masks.any(MaskId::ACTIVE) {
                    watch.tick()?;
                    Some(*head)
                } else {
                    None
                }
            }
            Step::End => break,
            control => branch(simd, file, masks, control),
        };
        if let Some(target) = jump {
            next = target as usize;
        }
    }
    Ok(())
}

/// Updates the masks; returns where to go if not on.
#[inline(always)]
fn branch<S: Simd>(simd: S, file: File<'_>, masks: Masks<'_>, step: &Step) -> Option<u32> {
    let unless_any = |target: u32| (!masks.any(MaskId::ACTIVE)).then_some(target);
    match step {
        Step::Jump(target) => Some(*target),
        Step::Unless { condition, target } => (!file.first::<bool>(*condition)).then_some(*target),
        Step::If {
            condition,
            other,
            target,
        } => {
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
        Step::Clear(mask) => {
            masks.clear(*mask);
            None
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
        Step::LeaveIf {
            condition,
            when,
            into,
            target,
        } => {
            let into = masks.get(*into);
            masks.split(simd, file, *condition, |active, taken, word| {
                let leaving = if *when { taken } else { active.get() & !taken };
                into[word].set(into[word].get() | leaving);
                active.set(active.get() & !leaving);
            });
            unless_any(*target)
        }
        Step::Switch {
            selector,
            values,
            entered,
            unmatched,
        } => {
            masks.copy(*entered, MaskId::ACTIVE);
            masks.copy(*unmatched, MaskId::ACTIVE);
            select_lanes(file, masks, *selector, values, *entered, |word, bits| {
                let unmatched = &masks.get(*unmatched)[word];
                unmatched.set(unmatched.get() & !bits);
            });
            masks.clear(MaskId::ACTIVE);
            None
        }
        Step::Case {
            selector,
            values,
            entered,
            unmatched,
            target,
        } => {
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
    file: File<'_>,
    masks: Masks<'_>,
    selector: Slot,
    values: &[u32],
    among: MaskId,
    found: impl Fn(usize, u64),
) {
    for (word, lanes) in masks.get(among).iter().enumerate() {
        let mut bits = 0;
        for chunk in 4 * word..(4 * word + 4).min(file.width()) {
            let selectors = file.lanes::<u32>(selector, chunk);
            for (lane, selector) in selectors.iter().enumerate() {
                bits |= u64::from(values.contains(selector)) << (16 * (chunk % 4) + lane);
            }
        }
        found(word, bits & lanes.get());
    }
}
