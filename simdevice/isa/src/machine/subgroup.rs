//! Subgroup operations on values of 32 bits, a subgroup at a time: in vectors ([`vectors`]), or in arrays of lanes where
//! subgroups are smaller than a vector or sums depend on their order.
//!
//! [`super::cross_lane`] has the same operations lane by lane for values of any width, which tests compare with these.

mod vectors;

use fearless_simd::Simd;

use super::batch::Batch;
use super::cross_lane::{combine, identity, subgroup_by_lane};
use crate::compiler::step::MaskId;
use crate::ir::op::Op;
use crate::ir::{MAX_SUBGROUP_SIZE, Reg, SubgroupOp, Type, VECTOR_LANES};
use crate::kernels::float::{greatest, least};
use vectors::{as_words, truth};

/// The lanes of one subgroup.
pub(super) struct Subgroup<'a> {
    pub values: &'a [u32],
    /// A bit for each active lane.
    pub active: u128,
    /// The lanes of a whole subgroup; the last one of a batch may have fewer.
    pub size: usize,
}

/// Executes an operation for all lanes of a batch.
pub(super) fn subgroup<S: Simd>(
    batch: &Batch<'_>,
    simd: S,
    op: SubgroupOp,
    dst: &[Reg],
    src: Option<Reg>,
    index: Option<Reg>,
) {
    let wide = src.is_some_and(|reg| batch.program.types[reg.0 as usize] == Type::B64);
    if wide {
        subgroup_by_lane(batch, op, dst[0], src, index);
    } else {
        subgroup_by_vector(batch, simd, op, dst, src, index);
    }
}

/// Executes an operation on values of 32 bits.
fn subgroup_by_vector<S: Simd>(
    batch: &Batch<'_>,
    simd: S,
    op: SubgroupOp,
    dst: &[Reg],
    src: Option<Reg>,
    index: Option<Reg>,
) {
    let lanes = batch.program.lanes;
    let size = batch.program.subgroup_size.min(lanes);
    simd.vectorize(
        #[inline(always)]
        || {
            if size >= VECTOR_LANES && vectors::run(batch, simd, op, dst, src, index, size) {
                return;
            }
            // A vector may have several subgroups, and a subgroup several vectors.
            let part = size.max(VECTOR_LANES);
            for start in (0..lanes).step_by(part) {
                run_part(batch, op, dst, src, index, start..(start + part).min(lanes), size);
            }
        },
    );
}

/// Executes an operation for the subgroups in a range of lanes, which begins and ends with vectors.
#[inline(always)]
fn run_part(
    batch: &Batch<'_>,
    op: SubgroupOp,
    dst: &[Reg],
    src: Option<Reg>,
    index: Option<Reg>,
    lanes: std::ops::Range<usize>,
    size: usize,
) {
    let vectors = lanes.start / VECTOR_LANES..lanes.end / VECTOR_LANES;
    let count = lanes.len();
    let mut active = 0_u128;
    let mut values = [0; MAX_SUBGROUP_SIZE];
    let mut indices = [0; MAX_SUBGROUP_SIZE];
    for (number, vector) in vectors.clone().enumerate() {
        active |= u128::from(batch.masks.bits(MaskId::ACTIVE, vector)) << (VECTOR_LANES * number);
        let at = VECTOR_LANES * number..VECTOR_LANES * (number + 1);
        if let Some(reg) = src {
            values[at.clone()].copy_from_slice(&batch.file.lanes::<u32>(batch.slot(reg), vector));
        }
        if let Some(reg) = index {
            indices[at].copy_from_slice(&batch.file.lanes::<u32>(batch.slot(reg), vector));
        }
    }
    let words = if op == SubgroupOp::Ballot { dst.len() } else { 1 };
    for (word, reg) in dst.iter().enumerate().take(words) {
        let mut results = [0; MAX_SUBGROUP_SIZE];
        for first in (0..count).step_by(size) {
            let end = (first + size).min(count);
            let own = active >> first & ones(end - first);
            let group = Subgroup { values: &values[first..end], active: own, size };
            if op == SubgroupOp::Ballot {
                results[first..end].fill(group.ballot()[word]);
            } else {
                group.run(op, &indices[first..end], &mut results[first..end]);
            }
        }
        for (vector, lanes) in vectors.clone().zip(results.as_chunks().0) {
            batch.file.set(batch.slot(*reg), vector, *lanes);
        }
    }
}

/// As many ones as there are lanes.
#[inline(always)]
fn ones(lanes: usize) -> u128 {
    u128::MAX >> (128 - lanes)
}

/// Evaluates an expression with the function of an associative operation. Those whose order matters are compiled each on
/// its own: [`vectors`] has the others, except of subgroups smaller than a vector.
macro_rules! with_operation {
    ($op:expr, |$combine:ident| $body:expr) => {{
        macro_rules! each {
            ($f:expr) => {{
                let $combine = $f;
                $body
            }};
        }
        match $op {
            Op::FAdd => each!(|a: u32, b: u32| (f32::from_bits(a) + f32::from_bits(b)).to_bits()),
            Op::FMul => each!(|a: u32, b: u32| (f32::from_bits(a) * f32::from_bits(b)).to_bits()),
            Op::FMin => each!(|a: u32, b: u32| least(f32::from_bits(a), f32::from_bits(b)).to_bits()),
            Op::FMax => each!(|a: u32, b: u32| greatest(f32::from_bits(a), f32::from_bits(b)).to_bits()),
            op => each!(|a: u32, b: u32| combine(op, u64::from(a), u64::from(b)) as u32),
        }
    }};
}

impl Subgroup<'_> {
    #[inline(always)]
    fn is_active(&self, lane: usize) -> bool {
        lane < self.values.len() && self.active >> lane & 1 != 0
    }

    /// The lanes whose value is not zero.
    #[inline(always)]
    fn set_lanes(&self) -> u128 {
        let mut set = 0;
        for (lane, value) in self.values.iter().enumerate() {
            set |= u128::from(*value != 0) << lane;
        }
        set
    }

    /// The active lanes whose value is not zero, 32 to a word.
    #[inline(always)]
    pub(super) fn ballot(&self) -> [u32; 4] {
        as_words(self.set_lanes() & self.active)
    }

    /// The result of an operation other than a ballot in each lane.
    #[inline(always)]
    pub(super) fn run(&self, op: SubgroupOp, indices: &[u32], out: &mut [u32]) {
        let first = self.active.trailing_zeros() as usize;
        let first_value = if self.active == 0 { 0 } else { self.values[first] };
        let fetch = |lane: usize| if self.is_active(lane) { self.values[lane] } else { 0 };
        match op {
            SubgroupOp::Elect => {
                out.fill(0);
                if self.active != 0 {
                    out[first] = u32::MAX;
                }
            }
            SubgroupOp::All => out.fill(truth(self.set_lanes() & self.active == self.active)),
            SubgroupOp::Any => out.fill(truth(self.set_lanes() & self.active != 0)),
            SubgroupOp::AllEqual => {
                let mut differ = 0;
                for (lane, value) in self.values.iter().enumerate() {
                    differ |= u128::from(*value != first_value) << lane;
                }
                out.fill(truth(differ & self.active == 0));
            }
            SubgroupOp::BroadcastFirst => out.fill(first_value),
            SubgroupOp::Shuffle => {
                for (out, index) in out.iter_mut().zip(indices) {
                    *out = fetch(*index as usize);
                }
            }
            SubgroupOp::ShuffleXor => {
                for (lane, (out, index)) in out.iter_mut().zip(indices).enumerate() {
                    *out = fetch(lane ^ *index as usize);
                }
            }
            SubgroupOp::ShuffleUp => {
                for (lane, (out, index)) in out.iter_mut().zip(indices).enumerate() {
                    *out = fetch(lane.wrapping_sub(*index as usize));
                }
            }
            SubgroupOp::ShuffleDown => {
                for (lane, (out, index)) in out.iter_mut().zip(indices).enumerate() {
                    *out = fetch(lane.saturating_add(*index as usize));
                }
            }
            SubgroupOp::QuadBroadcast => {
                for (lane, (out, index)) in out.iter_mut().zip(indices).enumerate() {
                    *out = self.values[lane & !3 | *index as usize & 3];
                }
            }
            SubgroupOp::QuadSwap => {
                for (lane, (out, index)) in out.iter_mut().zip(indices).enumerate() {
                    *out = self.values[lane ^ *index as usize & 3];
                }
            }
            SubgroupOp::Reduce { op, cluster } => self.reduce(op, (cluster as usize).min(self.size), out),
            SubgroupOp::InclusiveScan(op) => self.scan(op, true, out),
            SubgroupOp::ExclusiveScan(op) => self.scan(op, false, out),
            // A ballot has four results and is done by itself.
            SubgroupOp::Ballot => out.fill(0),
        }
    }

    #[inline(always)]
    fn reduce(&self, op: Op, cluster: usize, out: &mut [u32]) {
        let none = identity(op) as u32;
        with_operation!(op, |combine| {
            for (number, out) in out.chunks_mut(cluster).enumerate() {
                let start = number * cluster;
                let values = &self.values[start..start + out.len()];
                let mut rest = self.active >> start & ones(out.len());
                let mut total = none;
                if rest != 0 {
                    total = values[rest.trailing_zeros() as usize];
                    rest &= rest - 1;
                    while rest != 0 {
                        total = combine(total, values[rest.trailing_zeros() as usize]);
                        rest &= rest - 1;
                    }
                }
                out.fill(total);
            }
        });
    }

    #[inline(always)]
    fn scan(&self, op: Op, inclusive: bool, out: &mut [u32]) {
        let none = identity(op) as u32;
        with_operation!(op, |combine| {
            let (mut sum, mut is_first) = (none, true);
            for (lane, (out, value)) in out.iter_mut().zip(self.values).enumerate() {
                *out = 0;
                if self.active >> lane & 1 != 0 {
                    let next = if is_first { *value } else { combine(sum, *value) };
                    *out = if inclusive { next } else { sum };
                    (sum, is_first) = (next, false);
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::Builder;
    use crate::compiler::Options;
    use crate::ir::{Program, Rate};
    use crate::level::SimdLevel;
    use crate::machine::cross_lane::Group;
    use crate::machine::{Executable, LaneMask, Machine, Watchdog};
    use crate::resources::Resources;
    use gaurast_runner::{Case, simd_levels};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::sync::Arc;

    /// The operations that combine values of 32 bits.
    const COMBINING: [Op; 13] = [
        Op::BAnd,
        Op::Or,
        Op::Xor,
        Op::IAdd,
        Op::IMul,
        Op::SMin,
        Op::SMax,
        Op::UMin,
        Op::UMax,
        Op::FAdd,
        Op::FMul,
        Op::FMin,
        Op::FMax,
    ];

    /// All operations with one result.
    fn operations() -> Vec<SubgroupOp> {
        use SubgroupOp as Is;
        let mut operations = vec![
            Is::Elect,
            Is::All,
            Is::Any,
            Is::AllEqual,
            Is::BroadcastFirst,
            Is::Shuffle,
            Is::ShuffleXor,
            Is::ShuffleUp,
            Is::ShuffleDown,
            Is::QuadBroadcast,
            Is::QuadSwap,
        ];
        for op in COMBINING {
            operations.extend([Is::InclusiveScan(op), Is::ExclusiveScan(op)]);
            operations.extend([1, 2, 4, 8, 16, 32, 128].map(|cluster| Is::Reduce { op, cluster }));
        }
        operations
    }

    /// A random value: zero, all ones, any word, or an ordinary float.
    fn value(rng: &mut ChaCha8Rng) -> u32 {
        match rng.random_range(0..4) {
            0 => 0,
            1 => u32::MAX,
            2 => rng.random(),
            _ => rng.random_range(-2.0..2.0_f32).to_bits(),
        }
    }

    fn wide(lanes: &[u32]) -> Vec<u64> {
        lanes.iter().map(|lane| u64::from(*lane)).collect()
    }

    fn is_nan(bits: u64) -> bool {
        f32::from_bits(bits as u32).is_nan()
    }

    #[gaurast_runner::test]
    fn every_operation_gives_what_it_gives_lane_by_lane() {
        let mut rng = ChaCha8Rng::seed_from_u64(31);
        let operations = operations();
        for round in 0..200 {
            let size = [4, 8, 16, 32, 64, 128][round % 6];
            // The last subgroup of a batch may be shorter.
            let count = if size > 16 && round % 5 == 0 { size - 16 } else { size };
            let active = match round % 4 {
                0 => 0,
                1 => ones(count),
                _ => rng.random::<u128>() & ones(count),
            };
            let values: Vec<u32> = (0..count).map(|_| value(&mut rng)).collect();
            let indices: Vec<u32> = (0..count).map(|_| rng.random_range(0..140)).collect();
            let is_active: Vec<bool> = (0..count).map(|lane| active >> lane & 1 != 0).collect();
            let (wide_values, wide_indices) = (wide(&values), wide(&indices));
            let group = Group { active: &is_active, values: &wide_values, size };
            let fast = Subgroup { values: &values, active, size };
            assert_eq!(fast.ballot(), group.ballot());
            for &op in &operations {
                let mut found = vec![7; count];
                fast.run(op, &indices, &mut found);
                for (found, expected) in wide(&found).iter().zip(group.run(op, &wide_indices)) {
                    assert!(*found == expected || is_nan(*found) && is_nan(expected), "{op:?}, {size}");
                }
            }
        }
    }

    /// The index that each lane shuffles by.
    #[derive(Clone, Copy, Debug)]
    enum Index {
        Constant(u32),
        Input,
    }

    /// A program that applies an operation to input 0, with an index, and gives the results in output 0 and on.
    fn program(op: SubgroupOp, index: Index) -> Program {
        let mut b = Builder::new();
        let mut src = b.input(0, Type::B32, Rate::Varying);
        let index = op.has_index().then(|| match index {
            Index::Constant(index) => b.u32(index),
            Index::Input => b.input(1, Type::B32, Rate::Varying),
        });
        let combines = match op {
            SubgroupOp::Reduce { op, .. } | SubgroupOp::InclusiveScan(op) | SubgroupOp::ExclusiveScan(op) => Some(op),
            _ => None,
        };
        let votes = matches!(op, SubgroupOp::All | SubgroupOp::Any | SubgroupOp::Ballot);
        if votes || combines == Some(Op::BAnd) {
            let zero = b.u32(0);
            src = b.compute(Op::ULt, &[zero, src]);
        }
        let results = if op == SubgroupOp::Ballot {
            b.ballot(src).to_vec()
        } else {
            let src = (op != SubgroupOp::Elect).then_some(src);
            vec![b.subgroup(op, src, index)]
        };
        for (number, result) in (0..).zip(results) {
            let out = b.output(number, b.type_of(result));
            b.assign(out, result);
        }
        b.finish().expect("a valid program")
    }

    #[gaurast_runner::test(each = simd_levels())]
    fn batches_give_what_they_give_lane_by_lane(case: &Case) {
        let level = SimdLevel::from_name(case.variant()).and_then(SimdLevel::resolve).expect("a level");
        let mut rng = ChaCha8Rng::seed_from_u64(32);
        let mut operations = operations();
        operations.push(SubgroupOp::Ballot);
        for (number, &op) in operations.iter().enumerate() {
            for (round, size) in [4, 8, 16, 32, 64, 128, 32, 32, 128].into_iter().enumerate() {
                let lanes = [128, 48, 256, 80][(number + round) % 4];
                let index = match round % 3 {
                    0 => Index::Input,
                    _ => Index::Constant(rng.random_range(0..[4, 16, 64, 140][round % 4])),
                };
                let options = Options { lanes, subgroup_size: size, ..Options::new(level) };
                let executable = Executable::new(program(op, index), &options).expect("a valid program");
                let mut machine = Machine::new(Arc::new(executable));
                let mut active = LaneMask::first(lanes);
                if round != 0 {
                    // Some vectors are whole, some have no active lanes.
                    let odds: Vec<u32> = (0..lanes / 16).map(|_| [0, 1, 2, 2][rng.random_range(0..4)]).collect();
                    for lane in 0..lanes {
                        active.set(lane, rng.random_range(0..2) < odds[lane / 16]);
                    }
                }
                let mut values: Vec<u32> = (0..lanes).map(|_| value(&mut rng)).collect();
                if round == 3 {
                    let same = values[0];
                    values.fill(same);
                }
                let indices: Vec<u32> = match index {
                    Index::Constant(index) => vec![index; lanes],
                    Index::Input => (0..lanes).map(|_| rng.random_range(0..140)).collect(),
                };
                for lane in 0..lanes {
                    machine.set_input(0, lane, values[lane]);
                    machine.set_input(1, lane, indices[lane]);
                }
                machine.run(&active, &LaneMask::none(), &Resources::default(), Watchdog::default()).expect("it ends");
                let is_bool = matches!(
                    op,
                    SubgroupOp::All
                        | SubgroupOp::Any
                        | SubgroupOp::Ballot
                        | SubgroupOp::Reduce { op: Op::BAnd, .. }
                        | SubgroupOp::InclusiveScan(Op::BAnd)
                        | SubgroupOp::ExclusiveScan(Op::BAnd)
                );
                let operands: Vec<u32> =
                    values.iter().map(|value| if is_bool { truth(*value != 0) } else { *value }).collect();
                let size = size.min(lanes);
                for start in (0..lanes).step_by(size) {
                    let end = (start + size).min(lanes);
                    let is_active: Vec<bool> = (start..end).map(|lane| active.contains(lane)).collect();
                    let wide_values = wide(&operands[start..end]);
                    let group = Group { active: &is_active, values: &wide_values, size };
                    let mut expected = vec![group.run(op, &wide(&indices[start..end]))];
                    if op == SubgroupOp::Ballot {
                        expected = group.ballot().map(|word| vec![u64::from(word); end - start]).to_vec();
                    }
                    for (output, expected) in (0..).zip(expected) {
                        for own in (0..end - start).filter(|own| is_active[*own]) {
                            let (found, expected) = (u64::from(machine.output(output, start + own)), expected[own]);
                            assert!(
                                found == expected || is_nan(found) && is_nan(expected),
                                "{op:?}, {index:?}, subgroups of {size} in {lanes}, lane {own} from {start}: {found}, {expected}"
                            );
                        }
                    }
                }
            }
        }
    }
}
