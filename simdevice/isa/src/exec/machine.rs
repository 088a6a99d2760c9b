//! The machine: registers and memory of one batch, and the loop over its steps.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use devmem::host;

use super::super::ir::{Reg, Type};
use super::super::resources::Resources;
use super::batch::Batch;
use super::counters::Work;
use super::executable::Executable;
use super::file::{Chunk, File};
use super::mask::{LaneMask, MaskId, Masks};
use super::set_all;
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
            registers: host::filled(Chunk::default(), executable.chunks),
            masks: host::zeroed(executable.masks * executable.lanes.div_ceil(64)),
            shared: host::collect(
                (0..executable.shared_bytes.div_ceil(4)).map(|_| AtomicU32::new(0)),
            ),
            private: host::filled(Chunk::default(), executable.private_words() * width),
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
            whole: false,
        };
        if !masks.any(MaskId::ACTIVE) {
            return Ok(());
        }
        executable
            .engine
            .run(&batch, &mut self.runs, &mut Watch::new(watchdog))
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
        for index in 0..self.executable.cleared.len() {
            let range = self.chunks_of(self.executable.cleared[index]);
            self.registers[range].fill(Chunk::default());
        }
        self.shared.iter().for_each(|word| word.store(0, Relaxed));
    }
}
