//! Runs programs: a lane-batched interpreter.
//!
//! An [`Executable`] is a program made ready for batches of a fixed number of lanes: registers have places, uniform
//! ones only one vector; control flow is jumps and masks. A [`Machine`] has the registers and memory of one batch at a
//! time and belongs to one worker. The kernels are compiled for every SIMD level; a batch chooses its level once.
//!
//! ```
//! use std::sync::Arc;
//! use fearless_simd::Level;
//! use isa::{
//!     builder::Builder, machine::{Executable, LaneMask, Machine, Watchdog}, Options, ir::{Rate, Type}, op::Op,
//!     resources::Resources,
//! };
//!
//! let mut b = Builder::new();
//! let x = b.input(0, Type::B32, Rate::Varying);
//! let out = b.output(0, Type::B32);
//! let square = b.compute(Op::FMul, &[x, x]);
//! b.assign(out, square);
//! let program = b.finish().unwrap();
//!
//! let executable = Executable::new(program, &Options { lanes: 64, ..Options::new(Level::new()) }).unwrap();
//! let mut machine = Machine::new(Arc::new(executable));
//! for lane in 0..64 {
//!     machine.set_input(0, lane, f32::to_bits(lane as f32));
//! }
//! machine.run(&LaneMask::first(64), &LaneMask::none(), &Resources::default(), Watchdog::default()).unwrap();
//! assert_eq!(f32::from_bits(machine.output(0, 9)), 81.0);
//! ```

mod batch;
mod counters;
mod cross_lane;
mod engine;
mod executable;
mod image;
mod masks;
mod memory;
mod subgroup;
mod watchdog;

pub use counters::Work;
pub use executable::Executable;
pub use masks::LaneMask;
pub use watchdog::{Stopped, Watchdog};

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use devmem::host;

use crate::compiler::step::MaskId;
use crate::ir::{Reg, Type};
use crate::kernels::registers::{RegisterFile, Vector};
use crate::resources::Resources;
use batch::Batch;
use masks::Masks;
use watchdog::Watch;

/// Runs batches of one executable, one after another. Each worker has its own.
#[derive(Debug)]
pub struct Machine {
    executable: Arc<Executable>,
    registers: Vec<Vector>,
    masks: Vec<u64>,
    shared: Vec<AtomicU32>,
    private: Vec<Vector>,
    work: Work,
    /// The executions of each counted run, and the active lanes over them.
    runs: Vec<(u64, u64)>,
}

impl Machine {
    /// A machine for an executable; all inputs are zero.
    pub fn new(executable: Arc<Executable>) -> Self {
        let width = executable.program.lanes / 16;
        let workgroups = executable.program.lanes / executable.program.workgroup;
        let mut machine = Self {
            registers: host::filled(Vector::default(), executable.program.vectors),
            masks: host::zeroed(executable.program.masks * executable.program.lanes.div_ceil(64)),
            shared: host::collect((0..workgroups * executable.program.shared_words()).map(|_| AtomicU32::new(0))),
            private: host::filled(Vector::default(), executable.program.private_words() * width),
            work: Work::default(),
            runs: vec![(0, 0); executable.program.runs.len()],
            executable,
        };
        let file = RegisterFile::new(Cell::from_mut(&mut machine.registers[..]).as_slice_of_cells(), width);
        for constant in &machine.executable.program.constants {
            let (slot, ty) = (
                machine.executable.program.slots[constant.reg.0 as usize],
                machine.executable.program.types[constant.reg.0 as usize],
            );
            file.set_constant(slot, ty, constant.bits);
        }
        machine
    }

    /// The executable that the machine runs.
    pub fn executable(&self) -> &Arc<Executable> {
        &self.executable
    }

    fn input_register(&self, slot: u32) -> Option<Reg> {
        self.executable.program.inputs.iter().find(|input| input.slot == slot).map(|input| input.reg)
    }

    /// The vectors of a register.
    fn vectors_of(&self, reg: Reg) -> std::ops::Range<usize> {
        let slot = self.executable.program.slots[reg.0 as usize];
        let per_16 = if self.executable.program.types[reg.0 as usize] == Type::B64 { 2 } else { 1 };
        let count = if slot.is_varying() { self.executable.program.lanes / 16 } else { 1 };
        slot.start()..slot.start() + count * per_16
    }

    /// The lanes of an input, for the caller to fill: 16 to a vector (8 to a vector for `B64`). A uniform input has one
    /// vector, all of whose lanes must be set alike. Bools are 0 or all ones. Empty if the program doesn't read that
    /// slot.
    ///
    /// Varying inputs must be set before each batch; uniform ones keep their value.
    pub fn input_mut(&mut self, slot: u32) -> &mut [Vector] {
        match self.input_register(slot) {
            Some(reg) => {
                let range = self.vectors_of(reg);
                &mut self.registers[range]
            }
            None => &mut [],
        }
    }

    /// Sets one lane of a 32-bit input.
    pub fn set_input(&mut self, slot: u32, lane: usize, bits: u32) {
        if let Some(vector) = self.input_mut(slot).get_mut(lane / 16) {
            vector.0[lane % 16] = bits;
        }
    }

    /// Sets all lanes of a 32-bit input.
    pub fn fill_input(&mut self, slot: u32, bits: u32) {
        self.input_mut(slot).fill(Vector([bits; 16]));
    }

    /// Sets one lane of a 64-bit input.
    pub fn set_input64(&mut self, slot: u32, lane: usize, bits: u64) {
        if let Some(vector) = self.input_mut(slot).get_mut(lane / 8) {
            vector.0[2 * (lane % 8)] = bits as u32;
            vector.0[2 * (lane % 8) + 1] = (bits >> 32) as u32;
        }
    }

    /// An output's lanes after a batch: 16 to a vector (8 for `B64`). Empty if the program has no such output. Lanes that
    /// the batch killed have any value.
    pub fn output_vectors(&self, slot: u32) -> &[Vector] {
        let output = self.executable.program.outputs.iter().find(|output| output.slot == slot);
        output.map_or(&[], |output| &self.registers[self.vectors_of(output.reg)])
    }

    /// One lane of a 32-bit output; zero if the program has no such output.
    pub fn output(&self, slot: u32, lane: usize) -> u32 {
        self.output_vectors(slot).get(lane / 16).map_or(0, |vector| vector.0[lane % 16])
    }

    /// One lane of a 64-bit output.
    pub fn output64(&self, slot: u32, lane: usize) -> u64 {
        self.output_vectors(slot)
            .get(lane / 8)
            .map_or(0, |vector| u64::from(vector.0[2 * (lane % 8)]) | u64::from(vector.0[2 * (lane % 8) + 1]) << 32)
    }

    /// A word of workgroup memory, by its number; zero beyond the end.
    pub fn workgroup_word(&self, word: usize) -> u32 {
        self.shared.get(word).map_or(0, |word| word.load(Relaxed))
    }

    /// Sets a word of workgroup memory, by its number. A batch keeps only those that are preloaded:
    /// [`Program::preloaded_bytes`](crate::ir::Program::preloaded_bytes).
    pub fn set_workgroup_word(&mut self, word: usize, bits: u32) {
        if let Some(word) = self.shared.get_mut(word) {
            *word.get_mut() = bits;
        }
    }

    /// The lanes that the last batch killed or demoted.
    pub fn killed(&self) -> LaneMask {
        LaneMask::of_words(self.killed_words())
    }

    /// The lanes that the last batch killed or demoted: 64 to a word, lane 0 lowest.
    pub fn killed_words(&self) -> &[u64] {
        let width = self.executable.program.lanes.div_ceil(64);
        &self.masks[usize::from(MaskId::KILLED.0) * width..][..width]
    }

    /// The work counted since it was last taken; nothing, unless the executable counts.
    pub fn take_work(&mut self) -> Work {
        for ((executions, active), cost) in self.runs.iter_mut().zip(&self.executable.program.runs) {
            self.work.add_run(cost, *executions, *active, self.executable.program.lanes);
            (*executions, *active) = (0, 0);
        }
        std::mem::take(&mut self.work)
    }

    /// Runs a batch. `active` are the lanes that run; `helpers` are those among them that only serve derivatives.
    ///
    /// # Errors
    /// Returns an error if the watchdog stopped the batch. Its writes until then remain.
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
        let file = RegisterFile::new(
            Cell::from_mut(&mut self.registers[..]).as_slice_of_cells(),
            executable.program.lanes / 16,
        );
        let masks =
            Masks::new(Cell::from_mut(&mut self.masks[..]).as_slice_of_cells(), executable.program.lanes.div_ceil(64));
        let batch = Batch {
            program: &executable.program,
            resources,
            file,
            masks,
            shared: &self.shared,
            private: Cell::from_mut(&mut self.private[..]).as_slice_of_cells(),
            whole: false,
        };
        if !masks.any(MaskId::ACTIVE) {
            return Ok(());
        }
        executable.engine.run(&batch, &mut self.runs, &mut Watch::new(watchdog))
    }

    /// Sets masks, outputs and workgroup memory as they are when a batch begins.
    fn begin(&mut self, active: &LaneMask, helpers: &LaneMask) {
        let lanes = self.executable.program.lanes;
        let width = lanes.div_ceil(64);
        self.masks.fill(0);
        for index in 0..width {
            let whole = u64::MAX >> (64 - (lanes - 64 * index).min(64));
            let word = |mask: &LaneMask| mask.words().get(index).copied().unwrap_or(0) & whole;
            self.masks[usize::from(MaskId::ACTIVE.0) * width + index] = word(active);
            self.masks[usize::from(MaskId::ENTRY.0) * width + index] = word(active);
            self.masks[usize::from(MaskId::HELPER.0) * width + index] = word(helpers);
        }
        for index in 0..self.executable.program.cleared.len() {
            let range = self.vectors_of(self.executable.program.cleared[index]);
            self.registers[range].fill(Vector::default());
        }
        let preloaded = self.executable.program.preloaded_bytes / 4;
        let cleared = self.shared.iter().skip(preloaded as usize);
        cleared.for_each(|word| word.store(0, Relaxed));
    }
}
