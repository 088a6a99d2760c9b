//! Sets of lanes: a bit for each, 64 to a word.

use std::cell::Cell;

use fearless_simd::{Simd, prelude::*};

use super::file::{File, Slot, load, to_mask};

/// A set of lanes that the caller gives or gets.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LaneMask {
    words: Vec<u64>,
}

impl LaneMask {
    /// No lanes.
    pub fn none() -> Self {
        Self::default()
    }

    /// The first `count` lanes.
    pub fn first(count: usize) -> Self {
        let mut words = vec![u64::MAX; count / 64];
        if !count.is_multiple_of(64) {
            words.push((1 << (count % 64)) - 1);
        }
        Self { words }
    }

    /// Whether a lane is in the set.
    pub fn contains(&self, lane: usize) -> bool {
        self.words
            .get(lane / 64)
            .is_some_and(|word| word >> (lane % 64) & 1 != 0)
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

    /// The lanes by 64, lane 0 lowest; words beyond the end are zero.
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// The lanes by 64.
    pub(super) fn from_words(words: &[Cell<u64>]) -> Self {
        Self {
            words: words.iter().map(Cell::get).collect(),
        }
    }

    /// How many lanes are in the set.
    pub fn count(&self) -> usize {
        self.words
            .iter()
            .map(|word| word.count_ones() as usize)
            .sum()
    }
}

/// The index of a mask within a machine's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaskId(pub u16);

impl MaskId {
    /// The lanes that execute.
    pub const ACTIVE: Self = Self(0);
    /// The lanes whose writes to memory do nothing.
    pub const HELPER: Self = Self(1);
    /// The lanes that were killed or demoted.
    pub const KILLED: Self = Self(2);
    /// Lanes that are done; nobody reads it.
    pub const DONE: Self = Self(3);
    /// The lanes that were active when the batch began; the others never matter.
    pub const ENTRY: Self = Self(4);
    /// The first that constructs may use.
    pub const FIRST_FREE: u16 = 5;
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
        self.get(mask).iter().any(|word| word.get() != 0)
    }

    /// Whether all lanes are active that ever were.
    #[inline(always)]
    pub fn is_whole(self) -> bool {
        let entry = self.get(MaskId::ENTRY).iter();
        entry
            .zip(self.get(MaskId::ACTIVE))
            .all(|(entry, active)| entry == active)
    }

    #[inline(always)]
    pub fn count(self, mask: MaskId) -> u64 {
        self.get(mask)
            .iter()
            .map(|word| u64::from(word.get().count_ones()))
            .sum()
    }

    #[inline(always)]
    pub fn clear(self, mask: MaskId) {
        self.get(mask).iter().for_each(|word| word.set(0));
    }

    /// `into |= from`.
    #[inline(always)]
    pub fn join(self, into: MaskId, from: MaskId) {
        for (into, from) in self.get(into).iter().zip(self.get(from)) {
            into.set(into.get() | from.get());
        }
    }

    /// `into = from`.
    #[inline(always)]
    pub fn copy(self, into: MaskId, from: MaskId) {
        for (into, from) in self.get(into).iter().zip(self.get(from)) {
            into.set(from.get());
        }
    }

    #[inline(always)]
    pub fn swap(self, a: MaskId, b: MaskId) {
        for (a, b) in self.get(a).iter().zip(self.get(b)) {
            a.swap(b);
        }
    }

    /// The bits of lanes 16 `chunk`.. of a mask.
    #[inline(always)]
    pub fn chunk(self, mask: MaskId, chunk: usize) -> u16 {
        (self.get(mask)[chunk / 4].get() >> (16 * (chunk % 4))) as u16
    }

    /// The active lanes among 16 whose writes count.
    #[inline(always)]
    pub fn writing(self, chunk: usize) -> u16 {
        self.chunk(MaskId::ACTIVE, chunk) & !self.chunk(MaskId::HELPER, chunk)
    }

    /// Splits the active lanes by a bool register: calls `split(active, true lanes among them, word index)`.
    #[inline(always)]
    pub fn split<S: Simd>(
        self,
        simd: S,
        file: File<'_>,
        condition: Slot,
        mut split: impl FnMut(&Cell<u64>, u64, usize),
    ) {
        let chunks = file.narrow(condition);
        for (word, active) in self.get(MaskId::ACTIVE).iter().enumerate() {
            let mut bits = 0;
            let end = chunks.len().min(4 * word + 4);
            for (index, chunk) in chunks[(4 * word).min(end)..end].iter().enumerate() {
                bits |= (to_mask(load(simd, chunk)).to_bitmask() & 0xffff) << (16 * index);
            }
            if !condition.is_varying() {
                bits = if file.first::<bool>(condition) {
                    u64::MAX
                } else {
                    0
                };
            }
            split(active, active.get() & bits, word);
        }
    }
}

/// The lanes of a 16-lane set, ascending.
pub fn lanes_of(mut bits: u16) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (lane < 16).then_some(lane)
    })
}
