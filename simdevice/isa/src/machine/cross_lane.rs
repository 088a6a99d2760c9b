//! Derivatives and subgroup operations.

use super::batch::Batch;
use crate::compiler::step::MaskId;
use crate::ir::op::Op;
use crate::ir::{Axis, Reg, SubgroupOp, VECTOR_LANES};
use crate::kernels::float::{greatest, least};
use crate::kernels::registers::{Lane, RegisterSlot};

pub fn derivative(batch: &Batch<'_>, dst: Reg, src: Reg, axis: Axis, fine: bool) {
    let (dst, src) = (batch.slot(dst), batch.slot(src));
    for vector in 0..batch.file.width() {
        let values = batch.file.lanes::<f32>(src, vector);
        let lanes: [f32; VECTOR_LANES] = std::array::from_fn(|lane| {
            let quad = lane & !3;
            // The corner that the difference starts from: of the quad, or of the lane's own row or column.
            let (from, step) = match axis {
                Axis::X => (quad + if fine { lane & 2 } else { 0 }, 1),
                Axis::Y => (quad + if fine { lane & 1 } else { 0 }, 2),
            };
            values[from + step] - values[from]
        });
        batch.file.set(dst, vector, lanes);
    }
}

/// Executes a subgroup operation with one result on values of 64 bits.
pub(super) fn subgroup_by_lane(batch: &Batch<'_>, op: SubgroupOp, dst: Reg, src: Option<Reg>, index: Option<Reg>) {
    let dst = batch.slot(dst);
    let lanes = batch.program.lanes;
    let size = batch.program.subgroup_size.min(lanes);
    let active: Vec<bool> =
        (0..lanes).map(|lane| batch.masks.bits(MaskId::ACTIVE, lane / 16) >> (lane % 16) & 1 != 0).collect();
    let values = src.map_or_else(|| vec![0; lanes], |reg| gather(batch, batch.slot(reg), true));
    let indices = index.map_or_else(Vec::new, |reg| gather(batch, batch.slot(reg), false));
    for start in (0..lanes).step_by(size) {
        let end = (start + size).min(lanes);
        let group = Group { active: &active[start..end], values: &values[start..end], size };
        let indices = indices.get(start..end).unwrap_or_default();
        let wide = !matches!(op, SubgroupOp::AllEqual);
        for (own, result) in group.run(op, indices).into_iter().enumerate() {
            scatter(batch, dst, wide, start + own, result);
        }
    }
}

/// All lanes of a register, bools as 0 or all ones.
fn gather(batch: &Batch<'_>, slot: RegisterSlot, wide: bool) -> Vec<u64> {
    let vectors = 0..batch.file.width();
    if wide {
        vectors.flat_map(|vector| batch.file.lanes::<u64>(slot, vector)).collect()
    } else {
        vectors.flat_map(|vector| batch.file.lanes::<u32>(slot, vector).map(u64::from)).collect()
    }
}

/// Sets one lane of a register.
fn scatter(batch: &Batch<'_>, slot: RegisterSlot, wide: bool, lane: usize, value: u64) {
    if wide {
        let cell = &u64::vectors(batch.file, slot)[lane / 8];
        let mut vector = cell.get();
        vector.0[2 * (lane % 8)] = value as u32;
        vector.0[2 * (lane % 8) + 1] = (value >> 32) as u32;
        cell.set(vector);
    } else {
        let cell = &batch.file.narrow(slot)[lane / 16];
        let mut vector = cell.get();
        vector.0[lane % 16] = value as u32;
        cell.set(vector);
    }
}

/// One subgroup's lanes.
pub(super) struct Group<'a> {
    pub active: &'a [bool],
    pub values: &'a [u64],
    pub size: usize,
}

/// A bool as a register holds it.
fn truth(value: bool) -> u64 {
    if value { u64::from(u32::MAX) } else { 0 }
}

impl Group<'_> {
    fn active_lanes(&self) -> impl Iterator<Item = usize> {
        (0..self.active.len()).filter(|lane| self.active[*lane])
    }

    #[cfg(test)]
    pub(super) fn ballot(&self) -> [u32; 4] {
        let mut words = [0; 4];
        for lane in self.active_lanes().filter(|lane| self.values[*lane] != 0) {
            words[lane / 32 % 4] |= 1 << (lane % 32);
        }
        words
    }

    /// The result in each lane. `indices` is empty where the operation has none.
    pub(super) fn run(&self, op: SubgroupOp, indices: &[u64]) -> Vec<u64> {
        let lanes = 0..self.active.len();
        let index = |lane: usize| indices.get(lane).copied().unwrap_or(0) as usize;
        let fetch = |lane: usize| {
            if self.active.get(lane) == Some(&true) { self.values[lane] } else { 0 }
        };
        let all = |value: u64| vec![value; self.active.len()];
        let first = self.active_lanes().next();
        match op {
            SubgroupOp::Elect => lanes.map(|lane| truth(Some(lane) == first)).collect(),
            SubgroupOp::All => all(truth(self.active_lanes().all(|lane| self.values[lane] != 0))),
            SubgroupOp::Any => all(truth(self.active_lanes().any(|lane| self.values[lane] != 0))),
            SubgroupOp::AllEqual => {
                let value = first.map_or(0, |lane| self.values[lane]);
                all(truth(self.active_lanes().all(|lane| self.values[lane] == value)))
            }
            SubgroupOp::BroadcastFirst => all(first.map_or(0, |lane| self.values[lane])),
            SubgroupOp::Shuffle => lanes.map(|lane| fetch(index(lane))).collect(),
            SubgroupOp::ShuffleXor => lanes.map(|lane| fetch(lane ^ index(lane))).collect(),
            SubgroupOp::ShuffleUp => lanes.map(|lane| lane.checked_sub(index(lane)).map_or(0, fetch)).collect(),
            SubgroupOp::ShuffleDown => lanes.map(|lane| fetch(lane.saturating_add(index(lane)))).collect(),
            SubgroupOp::QuadBroadcast => lanes.map(|lane| self.values[lane & !3 | index(lane) & 3]).collect(),
            SubgroupOp::QuadSwap => lanes.map(|lane| self.values[lane ^ index(lane) & 3]).collect(),
            SubgroupOp::Reduce { op, cluster } => self.reduce(op, (cluster as usize).min(self.size)),
            SubgroupOp::InclusiveScan(op) => self.scan(op, true),
            SubgroupOp::ExclusiveScan(op) => self.scan(op, false),
            // A ballot has four results and is done by itself.
            SubgroupOp::Ballot => all(0),
        }
    }

    fn reduce(&self, op: Op, cluster: usize) -> Vec<u64> {
        let mut results = vec![0; self.active.len()];
        for (number, results) in results.chunks_mut(cluster).enumerate() {
            let start = number * cluster;
            let lanes = (start..start + results.len()).filter(|lane| self.active[*lane]);
            let total = lanes.map(|lane| self.values[lane]).reduce(|a, b| combine(op, a, b));
            results.fill(total.unwrap_or(identity(op)));
        }
        results
    }

    fn scan(&self, op: Op, inclusive: bool) -> Vec<u64> {
        let mut results = vec![0; self.active.len()];
        let mut sum = None;
        for lane in self.active_lanes() {
            let next = sum.map_or(self.values[lane], |sum| combine(op, sum, self.values[lane]));
            results[lane] = if inclusive { next } else { sum.unwrap_or(identity(op)) };
            sum = Some(next);
        }
        results
    }
}

/// An associative operation on bits.
pub(super) fn combine(op: Op, a: u64, b: u64) -> u64 {
    let (a32, b32) = (a as u32, b as u32);
    let (sa, sb) = (a32.cast_signed(), b32.cast_signed());
    let (fa, fb) = (f32::from_bits(a32), f32::from_bits(b32));
    let (da, db) = (f64::from_bits(a), f64::from_bits(b));
    match op {
        Op::BAnd | Op::And | Op::And64 => a & b,
        Op::BOr | Op::Or | Op::Or64 => a | b,
        Op::BXor | Op::Xor | Op::Xor64 => a ^ b,
        Op::IAdd => u64::from(a32.wrapping_add(b32)),
        Op::IMul => u64::from(a32.wrapping_mul(b32)),
        Op::SMin => u64::from(sa.min(sb).cast_unsigned()),
        Op::SMax => u64::from(sa.max(sb).cast_unsigned()),
        Op::UMin => u64::from(a32.min(b32)),
        Op::UMax => u64::from(a32.max(b32)),
        Op::FAdd => u64::from((fa + fb).to_bits()),
        Op::FMul => u64::from((fa * fb).to_bits()),
        Op::FMin => u64::from(least(fa, fb).to_bits()),
        Op::FMax => u64::from(greatest(fa, fb).to_bits()),
        Op::IAdd64 => a.wrapping_add(b),
        Op::IMul64 => a.wrapping_mul(b),
        Op::SMin64 => a.cast_signed().min(b.cast_signed()).cast_unsigned(),
        Op::SMax64 => a.cast_signed().max(b.cast_signed()).cast_unsigned(),
        Op::UMin64 => a.min(b),
        Op::UMax64 => a.max(b),
        Op::FAdd64 => (da + db).to_bits(),
        Op::FMul64 => (da * db).to_bits(),
        Op::FMin64 => least(da, db).to_bits(),
        Op::FMax64 => greatest(da, db).to_bits(),
        // Validation allows no other operation.
        _ => a,
    }
}

/// The identity element of [`combine`] for an operation.
pub(super) fn identity(op: Op) -> u64 {
    match op {
        Op::BAnd | Op::And | Op::UMin => u64::from(u32::MAX),
        Op::And64 | Op::UMin64 => u64::MAX,
        Op::IMul | Op::IMul64 => 1,
        Op::SMin => u64::from(i32::MAX.cast_unsigned()),
        Op::SMax => u64::from(i32::MIN.cast_unsigned()),
        Op::SMin64 => i64::MAX.cast_unsigned(),
        Op::SMax64 => i64::MIN.cast_unsigned(),
        Op::FMul => u64::from(1f32.to_bits()),
        Op::FMin => u64::from(f32::INFINITY.to_bits()),
        Op::FMax => u64::from(f32::NEG_INFINITY.to_bits()),
        Op::FMul64 => 1f64.to_bits(),
        Op::FMin64 => f64::INFINITY.to_bits(),
        Op::FMax64 => f64::NEG_INFINITY.to_bits(),
        _ => 0,
    }
}
