//! Loads, stores and atomics of 32-bit elements in one memory: bounds are checked for 16 lanes at once.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use fearless_simd::{Simd, prelude::*, u32x16};

use super::super::ir::{Address, AtomicOp, CHUNK_LANES, Format, Reg, Space};
use super::batch::{Batch, bits_to_mask};
use super::file::{Slot, load};
use super::mask::{MaskId, lanes_of};
use super::memory::{View, combine};

/// How many elements of one access are handled together: those of a vector.
const TOGETHER: usize = 4;

/// The words that an access may reach, from its offset on.
#[derive(Clone, Copy)]
struct Window<'a> {
    words: &'a [AtomicU32],
}

impl<'a> Window<'a> {
    /// Empty if the offset isn't aligned.
    #[inline(always)]
    fn new(view: View<'a>, offset: u32) -> Self {
        let end = view.words.len().min(view.bytes as usize / 4);
        let start = (offset as usize / 4).min(end);
        if offset.is_multiple_of(4) {
            Self {
                words: &view.words[start..end],
            }
        } else {
            Self { words: &[] }
        }
    }

    /// Where lanes begin, in words from the window's start, if all `count` elements of each of `lanes` are within and
    /// aligned. The other lanes get some place that is within, too.
    #[inline(always)]
    fn starts<S: Simd>(
        self,
        simd: S,
        mut bases: u32x16<S>,
        lanes: u16,
        count: usize,
    ) -> Option<u32x16<S>> {
        if lanes != u16::MAX {
            let first = bases[lanes.trailing_zeros() as usize % CHUNK_LANES];
            let first = u32x16::splat(simd, first);
            bases = bits_to_mask(simd, lanes).select(bases, first);
        }
        let last = u32::try_from(self.words.len().checked_sub(count)?).unwrap_or(u32::MAX);
        let words = bases >> 2;
        let within = words.simd_le(u32x16::splat(simd, last));
        let aligned = (bases & 3).simd_eq(u32x16::splat(simd, 0));
        (within & aligned).all_true().then_some(words)
    }
}

/// Whether lanes follow one another, `STRIDE` words apart.
#[inline(always)]
fn are_apart<S: Simd, const STRIDE: usize>(starts: u32x16<S>) -> bool {
    let steps = const {
        let mut steps = [0; CHUNK_LANES];
        let mut lane = 0;
        while lane < CHUNK_LANES {
            steps[lane] = (lane * STRIDE) as u32;
            lane += 1;
        }
        steps
    };
    let steps = u32x16::simd_from(starts.simd, steps);
    let wanted = u32x16::splat(starts.simd, starts[0]) + steps;
    starts.simd_eq(wanted).all_true()
}

/// `COUNT` elements from a word on.
#[inline(always)]
fn element<const COUNT: usize>(words: &[AtomicU32], at: u32) -> &[AtomicU32; COUNT] {
    match words[at as usize..][..COUNT].try_into() {
        Ok(element) => element,
        Err(_) => unreachable!("the slice has that length"),
    }
}

impl<'a> Batch<'a> {
    #[inline(always)]
    fn bases<S: Simd>(&self, simd: S, address: &Address, chunk: usize) -> u32x16<S> {
        match address.base.map(|base| self.slot(base)) {
            Some(base) if base.is_varying() => load(simd, &self.file.narrow(base)[chunk]),
            Some(base) => load(simd, &self.file.narrow(base)[0]),
            None => u32x16::splat(simd, 0),
        }
    }

    #[inline(always)]
    fn slots<const COUNT: usize>(&self, regs: [Reg; COUNT]) -> [Slot; COUNT] {
        let mut slots = [Slot::ZERO; COUNT];
        for index in 0..COUNT {
            slots[index] = self.slot(regs[index]);
        }
        slots
    }

    /// Loads into varying registers.
    pub(super) fn load_words<S: Simd>(
        &self,
        simd: S,
        view: View<'a>,
        dst: &[Reg],
        address: &Address,
    ) {
        for (part, dst) in dst.chunks(TOGETHER).enumerate() {
            let address = Address {
                // What overflows is beyond the end of any memory.
                offset: address.offset.saturating_add((4 * TOGETHER * part) as u32),
                ..*address
            };
            match dst {
                [a] => self.load_elements(simd, [*a], view, dst, &address),
                [a, b] => self.load_elements(simd, [*a, *b], view, dst, &address),
                [a, b, c] => self.load_elements(simd, [*a, *b, *c], view, dst, &address),
                [a, b, c, d, ..] => self.load_elements(simd, [*a, *b, *c, *d], view, dst, &address),
                [] => {}
            }
        }
    }

    #[inline(never)]
    fn load_elements<S: Simd, const COUNT: usize>(
        &self,
        simd: S,
        regs: [Reg; COUNT],
        view: View<'a>,
        dst: &[Reg],
        address: &Address,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                let slots = self.slots(regs);
                let window = Window::new(view, address.offset);
                for chunk in self.file.span() {
                    let lanes = self.masks.chunk(MaskId::ACTIVE, chunk);
                    if lanes == 0 {
                        continue;
                    }
                    let bases = self.bases(simd, address, chunk);
                    match window.starts(simd, bases, lanes, COUNT) {
                        Some(starts) => self.gather_words(slots, chunk, window, starts),
                        None => self.load_chunk(dst, address, Format::B32, chunk),
                    }
                }
            },
        );
    }

    #[inline(always)]
    fn gather_words<S: Simd, const COUNT: usize>(
        &self,
        slots: [Slot; COUNT],
        chunk: usize,
        window: Window<'_>,
        starts: u32x16<S>,
    ) {
        let mut values = [[0; CHUNK_LANES]; COUNT];
        if are_apart::<S, 0>(starts) {
            let element = element::<COUNT>(window.words, starts[0]);
            for index in 0..COUNT {
                values[index] = [element[index].load(Relaxed); CHUNK_LANES];
            }
        } else if are_apart::<S, COUNT>(starts) {
            let run = &window.words[starts[0] as usize..][..CHUNK_LANES * COUNT];
            for lane in 0..CHUNK_LANES {
                for index in 0..COUNT {
                    values[index][lane] = run[lane * COUNT + index].load(Relaxed);
                }
            }
        } else {
            let starts: [u32; CHUNK_LANES] = starts.into();
            for lane in 0..CHUNK_LANES {
                let element = element::<COUNT>(window.words, starts[lane]);
                for index in 0..COUNT {
                    values[index][lane] = element[index].load(Relaxed);
                }
            }
        }
        for index in 0..COUNT {
            self.file.set(slots[index], chunk, values[index]);
        }
    }

    /// Stores words.
    pub(super) fn store_words<S: Simd>(
        &self,
        simd: S,
        view: View<'a>,
        src: &[Reg],
        address: &Address,
    ) {
        for (part, src) in src.chunks(TOGETHER).enumerate() {
            let address = Address {
                offset: address.offset.saturating_add((4 * TOGETHER * part) as u32),
                ..*address
            };
            match src {
                [a] => self.store_elements(simd, [*a], view, src, &address),
                [a, b] => self.store_elements(simd, [*a, *b], view, src, &address),
                [a, b, c] => self.store_elements(simd, [*a, *b, *c], view, src, &address),
                [a, b, c, d, ..] => {
                    self.store_elements(simd, [*a, *b, *c, *d], view, src, &address);
                }
                [] => {}
            }
        }
    }

    #[inline(never)]
    fn store_elements<S: Simd, const COUNT: usize>(
        &self,
        simd: S,
        regs: [Reg; COUNT],
        view: View<'a>,
        src: &[Reg],
        address: &Address,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                let slots = self.slots(regs);
                let window = Window::new(view, address.offset);
                for chunk in self.file.span() {
                    let lanes = self.masks.writing(chunk);
                    if lanes == 0 {
                        continue;
                    }
                    let bases = self.bases(simd, address, chunk);
                    match window.starts(simd, bases, lanes, COUNT) {
                        Some(starts) => self.scatter_words(slots, chunk, lanes, window, starts),
                        None => self.store_chunk(src, address, Format::B32, chunk),
                    }
                }
            },
        );
    }

    #[inline(always)]
    fn scatter_words<S: Simd, const COUNT: usize>(
        &self,
        slots: [Slot; COUNT],
        chunk: usize,
        lanes: u16,
        window: Window<'_>,
        starts: u32x16<S>,
    ) {
        let mut values = [[0; CHUNK_LANES]; COUNT];
        for index in 0..COUNT {
            values[index] = self.file.lanes::<u32>(slots[index], chunk);
        }
        let starts: [u32; CHUNK_LANES] = starts.into();
        let put = |lane: usize| {
            let element = element::<COUNT>(window.words, starts[lane]);
            for index in 0..COUNT {
                element[index].store(values[index][lane], Relaxed);
            }
        };
        if lanes == u16::MAX {
            for lane in 0..CHUNK_LANES {
                put(lane);
            }
        } else {
            for lane in lanes_of(lanes) {
                put(lane);
            }
        }
    }

    /// A read-modify-write of 32 bits, in 16 lanes in order. Gives the old values, or None if a lane is out of range.
    pub(super) fn atomic_words<S: Simd>(
        &self,
        simd: S,
        op: AtomicOp,
        address: &Address,
        chunk: usize,
        values: &[u32; CHUNK_LANES],
        comparators: &[u32; CHUNK_LANES],
    ) -> Option<[u32; CHUNK_LANES]> {
        let lanes = self.masks.writing(chunk);
        let window = Window::new(self.common_view(&address.space)?, address.offset);
        let starts = window.starts(simd, self.bases(simd, address, chunk), lanes, 1)?;
        let access = Access {
            lanes,
            window,
            starts: starts.into(),
            values,
            comparators,
        };
        let combined = |old: u32, value: u32, comparator: u32| {
            let (old, value) = (u64::from(old), u64::from(value));
            combine(op, Format::B32, old, value, comparator.into()) as u32
        };
        if address.space == Space::Shared {
            // Nobody else has this memory.
            return Some(access.each(|word, value, comparator| {
                let old = word.load(Relaxed);
                word.store(combined(old, value, comparator), Relaxed);
                old
            }));
        }
        Some(match op {
            AtomicOp::IAdd => access.each(|word, value, _| word.fetch_add(value, Relaxed)),
            AtomicOp::UMin => access.each(|word, value, _| word.fetch_min(value, Relaxed)),
            AtomicOp::UMax => access.each(|word, value, _| word.fetch_max(value, Relaxed)),
            AtomicOp::And => access.each(|word, value, _| word.fetch_and(value, Relaxed)),
            AtomicOp::Or => access.each(|word, value, _| word.fetch_or(value, Relaxed)),
            AtomicOp::Xor => access.each(|word, value, _| word.fetch_xor(value, Relaxed)),
            AtomicOp::Exchange => access.each(|word, value, _| word.swap(value, Relaxed)),
            _ => access.each(|word, value, comparator| {
                let change = |old| Some(combined(old, value, comparator));
                word.fetch_update(Relaxed, Relaxed, change)
                    .unwrap_or_else(|old| old)
            }),
        })
    }
}

/// What the lanes of an atomic operation do.
struct Access<'a> {
    lanes: u16,
    window: Window<'a>,
    starts: [u32; CHUNK_LANES],
    values: &'a [u32; CHUNK_LANES],
    comparators: &'a [u32; CHUNK_LANES],
}

impl Access<'_> {
    /// Calls `change(word, value, comparator)` for each lane in order; it gives the old value.
    #[inline(always)]
    fn each(&self, change: impl Fn(&AtomicU32, u32, u32) -> u32) -> [u32; CHUNK_LANES] {
        let mut old = [0; CHUNK_LANES];
        for lane in lanes_of(self.lanes) {
            let word = &self.window.words[self.starts[lane] as usize];
            old[lane] = change(word, self.values[lane], self.comparators[lane]);
        }
        old
    }
}
