//! Runs programs: a lane-batched interpreter.
//!
//! An [`Executable`] is a program made ready for batches of a fixed number of lanes: registers have places, uniform ones
//! only one chunk; control flow is jumps and masks. A [`Machine`] has the registers and memory of one batch at a time
//! and belongs to one worker. The kernels are compiled for every SIMD level, and the level is dispatched once a batch.
//!
//! ```
//! use std::sync::Arc;
//! use fearless_simd::Level;
//! use isa::{
//!     builder::Builder, exec::{Executable, LaneMask, Machine, Options, Watchdog}, ir::{Rate, Type}, op::Op,
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

mod allocate;
mod batch;
mod compute;
mod counters;
mod cross_lane;
mod engine;
mod executable;
mod file;
mod image;
mod integer;
mod loop_private;
mod lower;
mod machine;
mod mask;
mod memory;
mod private;
mod step;
mod table;
mod transcendental;
mod watchdog;
mod wide;
mod words;

pub use counters::Work;
pub use executable::{Executable, Options};
pub use file::Chunk;
pub use machine::Machine;
pub use mask::LaneMask;
pub use watchdog::{Stopped, Watchdog};

use std::cell::Cell;

use fearless_simd::Level;

use super::ir::Type;
use super::op::Op;
use engine::engine;
use file::{File, Slot};
pub use memory::combine;

/// What an operation gives for constants, by the same kernels that programs run.
pub(super) fn evaluate(level: Level, op: Op, operands: &[u64]) -> u64 {
    let signature = op.signature();
    let place = |index: usize| Slot::uniform(2 * index);
    let chunks: [Cell<Chunk>; 10] = Default::default();
    let file = File::new(&chunks, 1);
    let mut src = [Slot::ZERO; 4];
    for (index, (bits, ty)) in operands.iter().zip(signature.operands).enumerate() {
        src[index] = place(index + 1);
        set_all(file, src[index], *ty, *bits);
    }
    engine(level).compute(file, op, place(0), &src);
    match signature.result {
        Type::Bool => u64::from(file.first::<bool>(place(0))),
        Type::B32 => u64::from(file.first::<u32>(place(0))),
        Type::B64 => file.first(place(0)),
    }
}

/// Sets a uniform register to a constant's bits.
fn set_all(file: File<'_>, slot: Slot, ty: Type, bits: u64) {
    match ty {
        Type::Bool => file.set(slot, 0, [bits != 0; 16]),
        Type::B32 => file.set(slot, 0, [bits as u32; 16]),
        Type::B64 => file.set(slot, 0, [bits; 16]),
    }
}
