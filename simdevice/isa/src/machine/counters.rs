//! The work that batches did, for the timing model and for lane occupancy.

use crate::compiler::step::RunCost;
use crate::ir::op::Kind;

/// Instructions and lanes counted over batches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Batches run.
    pub batches: u64,
    /// Instructions executed by [`Kind`], each counted once for a batch.
    pub instructions: [u64; Kind::COUNT],
    /// The instructions among them that were computed once for all lanes.
    pub uniform_instructions: [u64; Kind::COUNT],
    /// Lanes active over the instructions that work on each lane.
    pub active_lanes: u64,
    /// Lanes that could have been active over those instructions: all lanes of their batches.
    pub lanes: u64,
}

impl Work {
    /// The share of lanes that were active, from 0 to 1; 1 if nothing ran.
    pub fn occupancy(&self) -> f64 {
        if self.lanes == 0 { 1.0 } else { self.active_lanes as f64 / self.lanes as f64 }
    }

    /// Adds another's counts.
    pub fn add(&mut self, other: &Self) {
        self.batches += other.batches;
        self.active_lanes += other.active_lanes;
        self.lanes += other.lanes;
        for kind in 0..Kind::COUNT {
            self.instructions[kind] += other.instructions[kind];
            self.uniform_instructions[kind] += other.uniform_instructions[kind];
        }
    }

    /// Adds the instructions of a counted run that was executed `executions` times, with `active` active lanes in
    /// total.
    pub(super) fn add_run(&mut self, cost: &RunCost, executions: u64, active: u64, lanes: usize) {
        let mut varying = 0;
        for kind in 0..Kind::COUNT {
            varying += u64::from(cost.varying[kind]);
            let uniform = u64::from(cost.uniform[kind]) * executions;
            self.instructions[kind] += u64::from(cost.varying[kind]) * executions + uniform;
            self.uniform_instructions[kind] += uniform;
        }
        self.active_lanes += varying * active;
        self.lanes += varying * executions * lanes as u64;
    }
}
