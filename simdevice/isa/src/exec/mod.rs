//! Runs programs: a lane-batched interpreter.
//!
//! An [`Executable`] is a program made ready for batches of a fixed number of lanes: registers have places, uniform ones
//! only one chunk; control flow is jumps and masks. A [`Machine`] has the registers and memory of one batch at a time
//! and belongs to one worker. The kernels are compiled for every SIMD level, and the level is dispatched once a batch.
//!
//! ```
//! use std::sync::Arc;
//! use fearless_simd::Level;
//! use simdevice::isa::{
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
mod executable;
mod file;
mod image;
mod integer;
mod loop_private;
mod lower;
mod machine;
mod mask;
mod memory;
mod step;
mod transcendental;
mod watchdog;
mod wide;

pub use counters::Work;
pub use executable::{Executable, Options};
pub use file::Chunk;
pub use machine::Machine;
pub use mask::LaneMask;
pub use watchdog::{Stopped, Watchdog};

use std::sync::Arc;

use fearless_simd::Level;

use super::ir::Type;
use super::op::Op;
use super::resources::Resources;
use file::{File, Slot};
pub use memory::combine;
use step::Step;

/// What an operation gives for constants, by the same kernels that programs run.
pub(super) fn evaluate(level: Level, op: Op, operands: &[u64]) -> u64 {
    let signature = op.signature();
    let place = |index: usize| Slot::uniform(2 * index);
    let mut src = [Slot::ZERO; 4];
    let mut executable = Executable::empty(level);
    for (index, (bits, ty)) in operands.iter().zip(signature.operands).enumerate() {
        src[index] = place(index + 1);
        executable.add_constant(src[index], *ty, *bits);
    }
    let result = executable.add_output(place(0), signature.result);
    executable.steps = vec![
        Step::Compute {
            op,
            dst: place(0),
            src,
        },
        Step::End,
    ];
    let mut machine = Machine::new(Arc::new(executable));
    let done = machine.run(
        &LaneMask::first(1),
        &LaneMask::none(),
        &Resources::default(),
        Watchdog::default(),
    );
    debug_assert!(done.is_ok(), "one step always ends");
    match signature.result {
        Type::Bool => u64::from(machine.output(result, 0) != 0),
        Type::B32 => u64::from(machine.output(result, 0)),
        Type::B64 => machine.output64(result, 0),
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
