//! Operations of subgroups that are whole vectors.

use std::ops::Range;

use fearless_simd::{Simd, i32x16, prelude::*, u32x16, u64x8};

use crate::compiler::step::MaskId;
use crate::ir::op::Op;
use crate::ir::{MAX_SUBGROUP_SIZE, Reg, SubgroupOp, VECTOR_LANES};
use crate::kernels::registers::{RegisterSlot, load_vector, store_vector};
use crate::machine::batch::Batch;
use crate::machine::cross_lane::identity;
use crate::machine::masks::bits_to_mask;

/// Evaluates an expression with the [`AnyOrder`] of an operation. The value is false if the order matters.
macro_rules! with_any_order {
    ($op:expr, $combined:ident => $body:expr) => {{
        macro_rules! each_operation {
            ($type:ty) => {{
                type $combined = $type;
                $body
            }};
        }
        match $op {
            Op::BAnd | Op::And => each_operation!(And),
            Op::BOr | Op::Or => each_operation!(Or),
            Op::BXor | Op::Xor => each_operation!(Xor),
            Op::IAdd => each_operation!(Add),
            Op::IMul => each_operation!(Multiply),
            Op::SMin => each_operation!(SignedMin),
            Op::SMax => each_operation!(SignedMax),
            Op::UMin => each_operation!(UnsignedMin),
            Op::UMax => each_operation!(UnsignedMax),
            _ => false,
        }
    }};
}

/// The most vectors of a subgroup.
const MAX_VECTORS: usize = MAX_SUBGROUP_SIZE / VECTOR_LANES;

/// Executes an operation for all lanes of a batch, in subgroups of `size` lanes, which are whole vectors. Returns false
/// if it must be done otherwise.
#[inline(always)]
pub(super) fn run<S: Simd>(
    batch: &Batch<'_>,
    simd: S,
    op: SubgroupOp,
    dst: &[Reg],
    src: Option<Reg>,
    index: Option<Reg>,
    size: usize,
) -> bool {
    let slots = dst.iter().map(|reg| batch.slot(*reg));
    let mut dst = [RegisterSlot::ZERO; 4];
    let count = slots.len().min(dst.len());
    dst.iter_mut().zip(slots).for_each(|(dst, slot)| *dst = slot);
    let dst = &dst[..count];
    let slot_or_zero = |reg: Option<Reg>| reg.map_or(RegisterSlot::ZERO, |reg| batch.slot(reg));
    let (src, index) = (slot_or_zero(src), slot_or_zero(index));
    macro_rules! each {
        (|$group:ident| $body:expr) => {{
            let vectors = batch.program.lanes / VECTOR_LANES;
            let step = size / VECTOR_LANES;
            for first in (0..vectors).step_by(step) {
                let $group = Group { batch, simd, src, vectors: first..(first + step).min(vectors) };
                $body
            }
            true
        }};
    }
    match op {
        SubgroupOp::Ballot => each!(|group| group.ballot(dst)),
        SubgroupOp::Elect => each!(|group| group.elect(dst[0])),
        SubgroupOp::All => each!(|group| group.fill(dst[0], truth(group.count(Vote::False) == 0))),
        SubgroupOp::Any => each!(|group| group.fill(dst[0], truth(group.count(Vote::True) != 0))),
        SubgroupOp::AllEqual => each!(|group| group.fill(dst[0], truth(group.count(Vote::Different) == 0))),
        SubgroupOp::BroadcastFirst => each!(|group| group.fill(dst[0], group.first())),
        SubgroupOp::Shuffle if !index.is_varying() => {
            let lane = batch.file.first::<u32>(index) as usize;
            each!(|group| group.fill(dst[0], group.active_value(lane)))
        }
        SubgroupOp::ShuffleXor if !index.is_varying() => {
            let mask = batch.file.first::<u32>(index) as usize;
            each!(|group| group.exchange(dst[0], mask))
        }
        SubgroupOp::QuadSwap if !index.is_varying() => {
            let mask = batch.file.first::<u32>(index) as usize & 3;
            each!(|group| group.swap_in_quads(dst[0], mask))
        }
        SubgroupOp::Shuffle => each!(|group| group.shuffle(dst[0], index, |_, index| index)),
        SubgroupOp::ShuffleXor => each!(|group| group.shuffle(dst[0], index, |lane, index| lane ^ index)),
        SubgroupOp::ShuffleUp => each!(|group| group.shuffle(dst[0], index, usize::wrapping_sub)),
        SubgroupOp::ShuffleDown => each!(|group| group.shuffle(dst[0], index, usize::saturating_add)),
        SubgroupOp::Reduce { op, cluster } => {
            let cluster = (cluster as usize).min(size);
            with_any_order!(op, Combined => each!(|group| group.reduce::<Combined>(dst[0], op, cluster)))
        }
        SubgroupOp::InclusiveScan(scanned) | SubgroupOp::ExclusiveScan(scanned) => {
            let inclusive = op == SubgroupOp::InclusiveScan(scanned);
            with_any_order!(scanned, Combined => each!(|group| group.scan::<Combined>(dst[0], scanned, inclusive)))
        }
        SubgroupOp::QuadBroadcast | SubgroupOp::QuadSwap => false,
    }
}

/// The lanes of a set, 32 to a word.
#[inline(always)]
pub(super) fn as_words(lanes: u128) -> [u32; 4] {
    [lanes as u32, (lanes >> 32) as u32, (lanes >> 64) as u32, (lanes >> 96) as u32]
}

/// A bool as a register holds it.
#[inline(always)]
pub(super) fn truth(value: bool) -> u32 {
    if value { u32::MAX } else { 0 }
}

/// The active lanes that a vote counts.
#[derive(Clone, Copy, PartialEq)]
enum Vote {
    /// Lanes whose value is zero.
    False,
    /// Lanes whose value is not zero.
    True,
    /// Lanes whose value is not that of the first active lane.
    Different,
}

/// A subgroup of whole vectors. A register may be both operand and result: vectors that other vectors depend on are read
/// before any is written.
struct Group<'a, S> {
    batch: &'a Batch<'a>,
    simd: S,
    src: RegisterSlot,
    vectors: Range<usize>,
}

impl<S: Simd> Group<'_, S> {
    #[inline(always)]
    fn active(&self, vector: usize) -> u16 {
        self.batch.masks.bits(MaskId::ACTIVE, vector)
    }

    #[inline(always)]
    fn values(&self, vector: usize) -> u32x16<S> {
        load_vector(self.simd, self.batch.file.vector(self.src, vector))
    }

    /// The values of the active lanes, and `none` in the others.
    #[inline(always)]
    fn active_values(&self, vector: usize, none: u32x16<S>) -> u32x16<S> {
        let (active, values) = (self.active(vector), self.values(vector));
        if active == u16::MAX { values } else { bits_to_mask(self.simd, active).select(values, none) }
    }

    #[inline(always)]
    fn set(&self, dst: RegisterSlot, vector: usize, value: u32x16<S>) {
        store_vector(self.batch.file.vector(dst, vector), value);
    }

    /// Gives all lanes a value.
    #[inline(always)]
    fn fill(&self, dst: RegisterSlot, value: u32) {
        for vector in self.vectors.clone() {
            self.set(dst, vector, u32x16::splat(self.simd, value));
        }
    }

    #[inline(always)]
    fn ballot(&self, dst: &[RegisterSlot]) {
        let zero = u32x16::splat(self.simd, 0);
        let mut votes = 0_u128;
        for (number, vector) in self.vectors.clone().enumerate() {
            let set = self.values(vector).simd_ne(zero).to_bitmask() as u16 & self.active(vector);
            votes |= u128::from(set) << (VECTOR_LANES * number);
        }
        for (dst, word) in dst.iter().zip(as_words(votes)) {
            self.fill(*dst, word);
        }
    }

    /// The number of active lanes that a vote counts.
    #[inline(always)]
    fn count(&self, vote: Vote) -> u32 {
        let compared = if vote == Vote::Different { self.first() } else { 0 };
        let compared = u32x16::splat(self.simd, compared);
        let mut count = 0;
        for vector in self.vectors.clone() {
            let is_equal = self.values(vector).simd_eq(compared).to_bitmask() as u16;
            let counted = if vote == Vote::False { is_equal } else { !is_equal };
            count += (counted & self.active(vector)).count_ones();
        }
        count
    }

    #[inline(always)]
    fn elect(&self, dst: RegisterSlot) {
        let mut found = false;
        for vector in self.vectors.clone() {
            let active = self.active(vector);
            let first = if found { 0 } else { active & active.wrapping_neg() };
            found |= active != 0;
            let elected = bits_to_mask(self.simd, first);
            self.set(dst, vector, elected.select(u32x16::splat(self.simd, u32::MAX), u32x16::splat(self.simd, 0)));
        }
    }

    /// The value of the first active lane; zero if there is none.
    #[inline(always)]
    fn first(&self) -> u32 {
        for (number, vector) in self.vectors.clone().enumerate() {
            let active = self.active(vector);
            if active != 0 {
                return self.active_value(VECTOR_LANES * number + active.trailing_zeros() as usize);
            }
        }
        0
    }

    /// The value of a lane; zero if it is not active.
    #[inline(always)]
    fn active_value(&self, lane: usize) -> u32 {
        let (number, lane) = (lane / VECTOR_LANES, lane % VECTOR_LANES);
        if number >= self.vectors.len() {
            return 0;
        }
        let vector = self.vectors.start + number;
        if self.active(vector) >> lane & 1 == 0 {
            return 0;
        }
        self.batch.file.vector(self.src, vector).get().0[lane]
    }

    /// Gives each lane the value of the lane whose number differs in the bits of `mask`.
    #[inline(always)]
    fn exchange(&self, dst: RegisterSlot, mask: usize) {
        let zero = u32x16::splat(self.simd, 0);
        let mut values = [zero; MAX_VECTORS];
        for (values, vector) in values.iter_mut().zip(self.vectors.clone()) {
            *values = exchanged(self.active_values(vector, zero), mask);
        }
        for (number, vector) in self.vectors.clone().enumerate() {
            let from = number ^ (mask / VECTOR_LANES);
            self.set(dst, vector, if from < self.vectors.len() { values[from] } else { zero });
        }
    }

    /// As [`Self::exchange`] within quads, whether lanes are active or not.
    #[inline(always)]
    fn swap_in_quads(&self, dst: RegisterSlot, mask: usize) {
        for vector in self.vectors.clone() {
            self.set(dst, vector, exchanged(self.values(vector), mask));
        }
    }

    /// Gives each lane the value of the active lane at `place(lane, index)`; zero if there is none.
    #[inline(always)]
    fn shuffle(&self, dst: RegisterSlot, index: RegisterSlot, place: impl Fn(usize, usize) -> usize) {
        let mut values = [[0; VECTOR_LANES]; MAX_VECTORS + 1];
        for (values, vector) in values.iter_mut().zip(self.vectors.clone()) {
            *values = self.active_values(vector, u32x16::splat(self.simd, 0)).into();
        }
        for (number, vector) in self.vectors.clone().enumerate() {
            let indices = self.batch.file.lanes::<u32>(index, vector);
            let mut results = [0; VECTOR_LANES];
            for lane in 0..VECTOR_LANES {
                // The lane after the last holds zero.
                let place = place(VECTOR_LANES * number + lane, indices[lane] as usize).min(MAX_SUBGROUP_SIZE);
                results[lane] = values.as_flattened()[place];
            }
            self.set(dst, vector, u32x16::simd_from(self.simd, results));
        }
    }

    #[inline(always)]
    fn reduce<C: AnyOrder>(&self, dst: RegisterSlot, op: Op, cluster: usize) {
        let none = u32x16::splat(self.simd, identity(op) as u32);
        let step = (cluster / VECTOR_LANES).max(1);
        let mut first = self.vectors.start;
        while first < self.vectors.end {
            let end = (first + step).min(self.vectors.end);
            let mut total = none;
            for vector in first..end {
                total = C::combine(total, self.active_values(vector, none));
            }
            for bit in [1, 2, 4, 8] {
                if bit < cluster {
                    total = C::combine(total, exchanged(total, bit));
                }
            }
            for vector in first..end {
                self.set(dst, vector, total);
            }
            first = end;
        }
    }

    #[inline(always)]
    fn scan<C: AnyOrder>(&self, dst: RegisterSlot, op: Op, inclusive: bool) {
        let none = u32x16::splat(self.simd, identity(op) as u32);
        let zero = u32x16::splat(self.simd, 0);
        let mut before = none;
        for vector in self.vectors.clone() {
            let mut sums = self.active_values(vector, none);
            sums = C::combine(sums, none.slide::<15>(sums));
            sums = C::combine(sums, none.slide::<14>(sums));
            sums = C::combine(sums, none.slide::<12>(sums));
            sums = C::combine(sums, none.slide::<8>(sums));
            sums = C::combine(sums, before);
            let results = if inclusive { sums } else { before.slide::<15>(sums) };
            before = u32x16::splat(self.simd, sums[VECTOR_LANES - 1]);
            self.set(dst, vector, bits_to_mask(self.simd, self.active(vector)).select(results, zero));
        }
    }
}

/// The values of the lanes whose numbers differ in the four low bits of `mask`.
#[inline(always)]
fn exchanged<S: Simd>(mut values: u32x16<S>, mask: usize) -> u32x16<S> {
    if mask & 1 != 0 {
        let pairs: u64x8<S> = values.bitcast();
        values = ((pairs << 32) | (pairs >> 32)).bitcast();
    }
    if mask & 2 != 0 {
        values = values.slide_within_blocks::<2>(values);
    }
    if mask & 4 != 0 {
        let (low, high) = values.split();
        values = low.slide::<4>(low).combine(high.slide::<4>(high));
    }
    if mask & 8 != 0 {
        values = values.slide::<8>(values);
    }
    values
}

/// An operation whose results do not depend on the order of operands.
trait AnyOrder {
    fn combine<S: Simd>(a: u32x16<S>, b: u32x16<S>) -> u32x16<S>;
}

macro_rules! any_order {
    ($($name:ident: $a:ident, $b:ident => $combined:expr;)*) => {
        $(
            struct $name;

            impl AnyOrder for $name {
                #[inline(always)]
                fn combine<S: Simd>($a: u32x16<S>, $b: u32x16<S>) -> u32x16<S> {
                    $combined
                }
            }
        )*
    };
}

any_order! {
    And: a, b => a & b;
    Or: a, b => a | b;
    Xor: a, b => a ^ b;
    Add: a, b => a + b;
    Multiply: a, b => a * b;
    SignedMin: a, b => a.bitcast::<i32x16<S>>().min(b.bitcast::<i32x16<S>>()).bitcast();
    SignedMax: a, b => a.bitcast::<i32x16<S>>().max(b.bitcast::<i32x16<S>>()).bitcast();
    UnsignedMin: a, b => a.min(b);
    UnsignedMax: a, b => a.max(b);
}
