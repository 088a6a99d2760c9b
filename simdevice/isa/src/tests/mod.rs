//! Tests of the shader cores against a scalar interpreter and exact models, at every SIMD level.

mod errors;
mod fast_paths;
mod levels;
mod memory;
mod operations;
mod random;
mod reference;
mod subgroup;
mod transcendental;
mod validation;

use std::sync::Arc;

use fearless_simd::Level;
use gaurast_runner::Case;

use super::compiler::Options;
use super::ir::Program;
use super::machine::{Executable, LaneMask, Machine, Watchdog};
use super::resources::Resources;
use crate::level::SimdLevel;

/// The SIMD level of a test's variant, and its name.
fn level(case: &Case) -> (&str, Level) {
    let name = case.variant();
    let level = SimdLevel::from_name(name).and_then(SimdLevel::resolve);
    (name, level.expect("a level of this processor"))
}

/// A machine for a program.
fn machine(program: &Program, level: Level, lanes: usize) -> Machine {
    let options = Options { lanes, count_work: true, ..Options::new(level) };
    Machine::new(Arc::new(Executable::new(program.clone(), &options).expect("a valid program")))
}

/// Runs the first `active` lanes of a batch.
fn run(machine: &mut Machine, active: usize, resources: &Resources<'_>) {
    machine.run(&LaneMask::first(active), &LaneMask::none(), resources, Watchdog::default()).expect("it ends");
}

/// A small generator of random numbers (SplitMix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// A number below `bound`.
    fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound as u64) as usize
    }

    /// True once in `odds` times.
    fn once_in(&mut self, odds: usize) -> bool {
        self.below(odds) == 0
    }

    /// One of a slice's elements.
    fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }
}
