//! The depth sort: a stable radix sort on only those bits that differ. Sequences that exceed a cache are first
//! partitioned by ranges of keys, and each part is sorted for itself. Workers share both steps.

use crate::format::depth::{ordered, unordered};
use devmem::host;
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

/// A key and its payload.
type SortEntry = (u32, u32);

/// The integer that orders as a binary32 number does (negative zero before zero).
pub(crate) fn ordered_bits(value: f32) -> u32 {
    ordered(value.to_bits())
}

/// The number whose [`ordered_bits`] are `bits`.
pub(crate) fn value_of(bits: u32) -> f32 {
    f32::from_bits(unordered(bits))
}

/// The most bits of a digit: the first-level cache holds a line for each value of it.
const MAX_DIGIT_BITS: u32 = 9;

const DIGITS: usize = 1 << MAX_DIGIT_BITS;

/// The approximate number of pairs in a part: it stays in a cache, and its keys differ in few bits.
const PART: usize = 1 << 11;

/// The least number of pairs for which partitioning pays.
const MANY: usize = 1 << 14;

/// The most parts: a part's number has 8 bits.
const MAX_PARTS: usize = 1 << 8;

/// The number of keys that are sampled to estimate their distribution.
const SAMPLES: usize = 1 << 11;

/// The number of intervals of keys. Each belongs to one part.
const INTERVALS: usize = 1 << 12;

/// The number of groups of lists per worker in partitioning: more than one, since some workers are slower than others.
const GROUPS_PER_WORKER: usize = 4;

/// Sorts `(key, payload)` pairs by ascending key; equal keys keep their order.
pub fn sort_by_key(pairs: &mut Vec<SortEntry>) {
    let mut sorted = host::zeroed(pairs.len());
    sort_into(&[pairs], &mut Vec::new(), &mut sorted);
    *pairs = sorted;
}

/// The bits in which the keys of some pairs differ.
struct Digits {
    least: u32,
    /// The lowest bit that differs.
    first: u32,
    /// The number of bits from `first` to the highest bit of the largest difference from `least`.
    width: u32,
}

impl Digits {
    /// The digits of these slices; `None` if all keys are the same.
    fn of(slices: &[&[SortEntry]]) -> Option<Self> {
        let (mut least, mut greatest, mut all, mut any) = (u32::MAX, 0, u32::MAX, 0);
        for slice in slices {
            for &(key, _) in *slice {
                (least, greatest) = (least.min(key), greatest.max(key));
                (all, any) = (all & key, any | key);
            }
        }
        let range = greatest.checked_sub(least).filter(|&range| range > 0)?;
        let first = (all ^ any).trailing_zeros();
        Some(Self { least, first, width: u32::BITS - range.leading_zeros() - first })
    }
}

/// Sorts the pairs of all slices in turn into `sorted`, which has as many elements; `other` is scratch.
fn sort_into(slices: &[&[SortEntry]], other: &mut Vec<SortEntry>, sorted: &mut [SortEntry]) {
    let Some(digits) = Digits::of(slices) else {
        let mut rest = sorted;
        for slice in slices {
            let (own, after) = rest.split_at_mut(slice.len());
            own.copy_from_slice(slice);
            rest = after;
        }
        return;
    };
    let passes = digits.width.div_ceil(MAX_DIGIT_BITS);
    let bits = digits.width.div_ceil(passes);
    if passes > 1 && other.len() < sorted.len() {
        host::resize(other, sorted.len(), (0, 0));
    }
    // The number of passes decides which buffer comes first, so that the last pass writes to `sorted`.
    let mut is_other = passes.is_multiple_of(2);
    let to = if is_other { &mut other[..] } else { &mut *sorted };
    scatter(slices, to, &digits, digits.first, bits);
    for pass in 1..passes {
        let shift = digits.first + pass * bits;
        if is_other {
            scatter(&[&other[..sorted.len()]], sorted, &digits, shift, bits);
        } else {
            scatter(&[sorted], other, &digits, shift, bits);
        }
        is_other = !is_other;
    }
}

/// The most pairs of all buffers that are kept together: more would take memory while tiles are binned, and save little time.
const MOST_KEPT: usize = 1 << 22;

/// Memory of earlier sorts, which later ones use again: zeros need not be written to it first.
#[derive(Debug, Default)]
pub struct SortBuffers(Mutex<Vec<Vec<SortEntry>>>);

impl SortBuffers {
    /// A buffer of at least `count` pairs of any values.
    fn take(&self, count: usize) -> Vec<SortEntry> {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let places = 0..kept.len();
        let fits = |&place: &usize| kept[place].len() >= count;
        let place = places.clone().filter(fits).min_by_key(|&place| kept[place].len());
        if let Some(place) = place {
            return kept.swap_remove(place);
        }
        // The smallest one goes, so that they do not become more and more.
        if let Some(place) = places.min_by_key(|&place| kept[place].len()) {
            kept.swap_remove(place);
        }
        drop(kept);
        // A little more, since the next sort may be of a few more.
        host::zeroed(count + count / 8)
    }

    /// Keeps a buffer for later sorts, unless it is so small that it saves nothing.
    fn keep(&self, buffer: Vec<SortEntry>) {
        if buffer.len() < MANY / GROUPS_PER_WORKER {
            return;
        }
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let all: usize = kept.iter().map(Vec::len).sum();
        if all + buffer.len() <= MOST_KEPT {
            host::push(&mut kept, buffer);
        }
    }
}

/// Pairs at the beginning of a buffer.
#[derive(Debug)]
pub struct SortedPairs {
    buffer: Vec<SortEntry>,
    len: usize,
}

impl SortedPairs {
    /// The pairs.
    pub fn pairs(&self) -> &[SortEntry] {
        &self.buffer[..self.len]
    }

    /// Gives the memory back to the buffers that it comes from.
    pub(crate) fn give_back(self, buffers: &SortBuffers) {
        // That of few pairs does not come from there.
        if self.len >= MANY {
            buffers.keep(self.buffer);
        }
    }
}

/// Sorts the items of all lists. An item's first number is its key; its payload becomes its place in its list plus
/// `stride` times the list's number. Then calls `settle` with each piece of the result; no two pieces share a key.
/// `workers` share the work. The memory comes from `buffers`.
pub fn sort_lists<L: AsRef<[[u32; 2]]> + Sync>(
    lists: &[L],
    stride: u32,
    workers: usize,
    buffers: &SortBuffers,
    settle: impl Fn(&mut [SortEntry]) + Sync,
) -> SortedPairs {
    let count = lists.iter().map(|list| list.as_ref().len()).sum();
    if count < MANY {
        let mut pairs = host::with_capacity(count);
        for_pairs(lists, 0, stride, |pair| pairs.push(pair));
        sort_by_key(&mut pairs);
        settle(&mut pairs);
        return SortedPairs { buffer: pairs, len: count };
    }
    let parts = Parts::new(lists, count);
    let in_group = lists.len().div_ceil(GROUPS_PER_WORKER * workers.max(1));
    let groups: Vec<Partition> = lists
        .par_chunks(in_group)
        .enumerate()
        .map(|(number, lists)| Partition::new(&parts, lists, number * in_group, stride, buffers))
        .collect();
    let mut pairs = buffers.take(count);
    let mut rest = &mut pairs[..count];
    let mut tasks = Vec::with_capacity(parts.count);
    for part in 0..parts.count {
        let slices: Vec<&[SortEntry]> = groups.iter().map(|group| group.part(part)).collect();
        let len = slices.iter().map(|slice| slice.len()).sum();
        let (sorted, after) = rest.split_at_mut(len);
        rest = after;
        tasks.push((slices, sorted));
    }
    tasks.into_par_iter().for_each_init(Vec::new, |other, (slices, sorted)| {
        sort_into(&slices, other, sorted);
        settle(sorted);
    });
    if count <= MOST_KEPT {
        groups.into_iter().for_each(|group| buffers.keep(group.pairs));
    }
    SortedPairs { buffer: pairs, len: count }
}

/// Calls `each` with all keys and payloads, in order. The first list has number `first`.
#[inline(always)]
fn for_pairs<L: AsRef<[[u32; 2]]>>(lists: &[L], first: usize, stride: u32, mut each: impl FnMut(SortEntry)) {
    for (number, list) in lists.iter().enumerate() {
        let first = (first + number) as u32 * stride;
        for (&[key, _], place) in list.as_ref().iter().zip(first..) {
            each((key, place));
        }
    }
}

/// Ranges of keys with about the same number of pairs each, as estimated from a sample.
struct Parts {
    count: usize,
    /// The part of each interval, in ascending order.
    of: [u8; INTERVALS],
    /// The key at which intervals begin. Lower keys belong to the first interval, and keys above all of them to the
    /// last. An interval's width is two to the power of `shift`.
    least: u32,
    shift: u32,
}

impl Parts {
    /// The parts of lists with `count` pairs in total, at least one.
    fn new<L: AsRef<[[u32; 2]]>>(lists: &[L], count: usize) -> Self {
        let items = lists.iter().flat_map(|list| list.as_ref());
        let some = items.step_by(count.div_ceil(SAMPLES));
        let mut sample: Vec<u32> = some.map(|item| item[0]).collect();
        sample.sort_unstable();
        let least = sample.first().copied().unwrap_or_default();
        let greatest = sample.last().copied().unwrap_or_default();
        let width = u32::BITS - (greatest - least).leading_zeros();
        let mut parts = Self {
            count: (count / PART).clamp(1, MAX_PARTS),
            of: [0; INTERVALS],
            least,
            shift: width.saturating_sub(INTERVALS.trailing_zeros()),
        };
        let mut below = 0;
        for interval in 0..INTERVALS {
            let is_below = |key: &u32| parts.interval(*key) < interval;
            below += sample[below..].iter().take_while(|key| is_below(key)).count();
            let part = below * parts.count / sample.len().max(1);
            parts.of[interval] = part.min(parts.count - 1) as u8;
        }
        parts
    }

    #[inline(always)]
    fn interval(&self, key: u32) -> usize {
        let from_least = key.saturating_sub(self.least) >> self.shift;
        (from_least as usize).min(INTERVALS - 1)
    }

    /// The part that a key belongs to.
    #[inline(always)]
    fn of(&self, key: u32) -> usize {
        self.of[self.interval(key)].into()
    }
}

/// The pairs of some lists, grouped by part. Within a part they are in the lists' order.
struct Partition {
    /// The pairs, and others after them.
    pairs: Vec<SortEntry>,
    /// The index one past the last pair of each part.
    ends: Box<[u32; MAX_PARTS]>,
}

impl Partition {
    /// The partition of lists of which the first has number `first`.
    fn new<L: AsRef<[[u32; 2]]>>(parts: &Parts, lists: &[L], first: usize, stride: u32, buffers: &SortBuffers) -> Self {
        let mut ends = Box::new([0; MAX_PARTS]);
        for item in lists.iter().flat_map(|list| list.as_ref()) {
            ends[parts.of(item[0]) % MAX_PARTS] += 1;
        }
        start_after_each_other(&mut *ends);
        let count = lists.iter().map(|list| list.as_ref().len()).sum();
        let mut pairs = buffers.take(count);
        for_pairs(lists, first, stride, |pair| {
            let end = &mut ends[parts.of(pair.0) % MAX_PARTS];
            pairs[*end as usize] = pair;
            *end += 1;
        });
        Self { pairs, ends }
    }

    fn part(&self, part: usize) -> &[SortEntry] {
        let start = part.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.pairs[start as usize..self.ends[part] as usize]
    }
}

/// Replaces counts by the index of the first element of each, as a prefix sum.
fn start_after_each_other(counts: &mut [u32]) {
    let mut start = 0;
    for count in counts {
        start += std::mem::replace(count, start);
    }
}

/// One counting-sort pass over the digit of `bits` bits at `shift`.
fn scatter(from: &[&[SortEntry]], to: &mut [SortEntry], digits: &Digits, shift: u32, bits: u32) {
    let (least, mask) = (digits.least, (1u32 << bits) - 1);
    let digit = |key: u32| (((key - least) >> shift) & mask) as usize % DIGITS;
    let mut next = [0u32; DIGITS];
    for slice in from {
        for &(key, _) in *slice {
            next[digit(key)] += 1;
        }
    }
    start_after_each_other(&mut next);
    for slice in from {
        for &pair in *slice {
            let slot = &mut next[digit(pair.0)];
            to[*slot as usize] = pair;
            *slot += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[gaurast_runner::test]
    fn bits_order_as_numbers_do() {
        let ascending =
            [f32::NEG_INFINITY, -1e30, -1.0, -1e-45, -0.0, 0.0, 1e-45, 0.2, 0.2f32.next_up(), 3e38, f32::INFINITY];
        for value in ascending {
            assert_eq!(value_of(ordered_bits(value)).to_bits(), value.to_bits());
        }
        for pair in ascending.windows(2) {
            assert!(ordered_bits(pair[0]) < ordered_bits(pair[1]), "{pair:?}");
        }
    }

    proptest! {
        #[gaurast_runner::test]
        fn shared_work_is_the_same(
            lengths in prop::collection::vec(0usize..4000, 1..20),
            keys in prop_oneof![Just(1u32), Just(3), Just(1 << 9), Just(1 << 20), Just(u32::MAX)],
            above in prop_oneof![Just(0u32), any::<u32>()],
            workers in 1usize..9,
            seed in any::<u64>(),
        ) {
            let mut random = seed | 1;
            let common = above & !(u32::MAX >> keys.leading_zeros());
            let mut lists = Vec::new();
            for length in lengths {
                let list: Vec<[u32; 2]> = (0..length)
                    .map(|_| {
                        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                        [((random >> 32) as u32 % keys) | common, 0]
                    })
                    .collect();
                lists.push(list);
            }
            let buffers = SortBuffers::default();
            // Fewer at first, so that buffers are too small, then enough, and then more than enough.
            for of in [1, lists.len(), lists.len(), 1] {
                let lists = &lists[..of];
                let count = lists.iter().map(Vec::len).sum::<usize>();
                let mut expected = Vec::new();
                for_pairs(lists, 0, 4096, |pair| expected.push(pair));
                expected.sort_by_key(|pair| pair.0);
                let seen = std::sync::atomic::AtomicUsize::new(0);
                let found = sort_lists(lists, 4096, workers, &buffers, |part| {
                    assert!(part.is_sorted_by_key(|pair| pair.0));
                    seen.fetch_add(part.len(), std::sync::atomic::Ordering::Relaxed);
                });
                prop_assert_eq!(found.pairs(), expected);
                prop_assert_eq!(seen.into_inner(), count);
                found.give_back(&buffers);
            }
        }

        #[gaurast_runner::test]
        fn it_is_a_stable_sort(keys in prop::collection::vec(prop_oneof![any::<u32>(), 0u32..4, Just(u32::MAX)], 0..300)) {
            let mut pairs: Vec<_> = keys.iter().zip(0..).map(|(&key, at)| (key, at)).collect();
            let mut expected = pairs.clone();
            expected.sort_by_key(|&(key, _)| key);
            sort_by_key(&mut pairs);
            prop_assert_eq!(pairs, expected);
        }
    }
}
