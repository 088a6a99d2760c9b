//! Sets of lanes: a bit for each, 64 to a word.

use std::cell::Cell;

use fearless_simd::{Simd, prelude::*};
use smallvec::SmallVec;

use crate::compiler::step::MaskId;
use crate::kernels::registers::{RegisterFile, RegisterSlot, Span, load_vector, to_mask};

/// A set of lanes that the caller passes or receives.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LaneMask {
    words: SmallVec<[u64; 4]>,
}

impl LaneMask {
    /// No lanes.
    pub fn none() -> Self {
        Self::default()
    }

    /// The first `count` lanes.
    pub fn first(count: usize) -> Self {
        let mut words = SmallVec::from_elem(u64::MAX, count / 64);
        if !count.is_multiple_of(64) {
            words.push((1 << (count % 64)) - 1);
        }
        Self { words }
    }

    /// Reports whether a lane is in the set.
    pub fn contains(&self, lane: usize) -> bool {
        self.words.get(lane / 64).is_some_and(|word| word >> (lane % 64) & 1 != 0)
    }

    /// Adds or removes a lane.
    pub fn set(&mut self, lane: usize, present: bool) {
        if self.words.len() <= lane / 64 {
            self.words.resize(lane / 64 + 1, 0);
        }
        let bit = 1 << (lane % 64);
        let word = &mut self.words[lane / 64];
        *word = if present { *word | bit } else { *word & !bit };
    }

    /// The set's bits, 64 lanes to a word, lane 0 lowest; words beyond the end are zero.
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// A set from its bits, 64 lanes to a word, lane 0 lowest.
    pub fn of_words(words: &[u64]) -> Self {
        Self { words: SmallVec::from_slice(words) }
    }

    /// The number of lanes in the set.
    pub fn count(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }
}

/// The masks of a batch.
#[derive(Clone, Copy)]
pub struct Masks<'a> {
    words: &'a [Cell<u64>],
    /// Words of each: lanes / 64, rounded up.
    width: usize,
}

impl<'a> Masks<'a> {
    pub fn new(words: &'a [Cell<u64>], width: usize) -> Self {
        Self { words, width }
    }

    #[inline(always)]
    pub fn get(self, mask: MaskId) -> &'a [Cell<u64>] {
        &self.words[usize::from(mask.0) * self.width..][..self.width]
    }

    #[inline(always)]
    pub fn any(self, mask: MaskId) -> bool {
        let mut any = 0;
        for word in self.get(mask) {
            any |= word.get();
        }
        any != 0
    }

    /// The vectors from the first to the last that has active lanes, and whether all lanes of these vectors that were
    /// active when the batch began still are.
    #[inline(always)]
    pub fn span(self) -> (Span, bool) {
        let (active, entry) = (self.get(MaskId::ACTIVE), self.get(MaskId::ENTRY));
        let (mut first_word, mut end) = (0, self.width);
        while first_word < end && active[first_word].get() == 0 {
            first_word += 1;
        }
        if first_word == end {
            return (Span { first: 0, count: 0 }, true);
        }
        while active[end - 1].get() == 0 {
            end -= 1;
        }
        let last_word = end - 1;
        let first = 4 * first_word + active[first_word].get().trailing_zeros() as usize / 16;
        let last = 4 * last_word + 3 - active[last_word].get().leading_zeros() as usize / 16;
        let mut missing = 0;
        for word in first_word..end {
            let mut within = u64::MAX;
            if word == first_word {
                within &= u64::MAX << (16 * (first % 4));
            }
            if word == last_word {
                within &= u64::MAX >> (48 - 16 * (last % 4));
            }
            missing |= entry[word].get() & !active[word].get() & within;
        }
        let count = last + 1 - first;
        (Span { first, count }, missing == 0)
    }

    #[inline(always)]
    pub fn count(self, mask: MaskId) -> u64 {
        let mut count = 0;
        for word in self.get(mask) {
            count += u64::from(word.get().count_ones());
        }
        count
    }

    #[inline(always)]
    pub fn clear(self, mask: MaskId) {
        for word in self.get(mask) {
            word.set(0);
        }
    }

    /// `into |= from`.
    #[inline(always)]
    pub fn join(self, into: MaskId, from: MaskId) {
        let (into, from) = (self.get(into), self.get(from));
        for word in 0..self.width {
            into[word].set(into[word].get() | from[word].get());
        }
    }

    /// `into = from`.
    #[inline(always)]
    pub fn copy(self, into: MaskId, from: MaskId) {
        let (into, from) = (self.get(into), self.get(from));
        for word in 0..self.width {
            into[word].set(from[word].get());
        }
    }

    #[inline(always)]
    pub fn swap(self, a: MaskId, b: MaskId) {
        let (a, b) = (self.get(a), self.get(b));
        for word in 0..self.width {
            a[word].swap(&b[word]);
        }
    }

    /// The bits of a mask for the 16 lanes of a vector.
    #[inline(always)]
    pub fn bits(self, mask: MaskId, vector: usize) -> u16 {
        (self.get(mask)[vector / 4].get() >> (16 * (vector % 4))) as u16
    }

    /// The active lanes among 16 that may write memory: those that aren't helpers.
    #[inline(always)]
    pub fn writing(self, vector: usize) -> u16 {
        self.bits(MaskId::ACTIVE, vector) & !self.bits(MaskId::HELPER, vector)
    }

    /// Splits the active lanes by a bool register: calls `split(active, true lanes among them, word index)`.
    #[inline(always)]
    pub fn split<S: Simd>(
        self,
        simd: S,
        file: RegisterFile<'_>,
        condition: RegisterSlot,
        mut split: impl FnMut(&Cell<u64>, u64, usize),
    ) {
        let active = self.get(MaskId::ACTIVE);
        if !condition.is_varying() {
            let bits = if file.first::<bool>(condition) { u64::MAX } else { 0 };
            for (word, active) in active.iter().enumerate() {
                split(active, active.get() & bits, word);
            }
            return;
        }
        let vectors = file.narrow(condition);
        for (word, active) in active.iter().enumerate() {
            if active.get() == 0 {
                split(active, 0, word);
                continue;
            }
            let mut bits = 0;
            for index in 0..(vectors.len() - 4 * word).min(4) {
                let lanes = to_mask(load_vector(simd, &vectors[4 * word + index])).to_bitmask() & 0xffff;
                bits |= lanes << (16 * index);
            }
            split(active, active.get() & bits, word);
        }
    }
}

/// The lanes of a set of 16, in ascending order.
pub fn lanes_of(mut bits: u16) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (lane < 16).then_some(lane)
    })
}

/// A mask vector from bits.
#[inline(always)]
pub fn bits_to_mask<S: Simd>(simd: S, bits: u16) -> fearless_simd::mask32x16<S> {
    simd.from_bitmask_mask32x16(u64::from(bits))
}
