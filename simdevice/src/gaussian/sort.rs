//! The depth sort: a stable radix sort on exactly the bits that differ. Several workers each take a range of the keys:
//! they pick those out of all, in order, and sort them.

use devmem::host;
use rayon::prelude::*;

/// Maps a binary32 number to an integer that orders alike (negative zero before zero).
pub(super) fn ordered_bits(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits >> 31 == 0 {
        bits | 1 << 31
    } else {
        !bits
    }
}

/// The number whose [`ordered_bits`] these are.
pub(super) fn value_of(bits: u32) -> f32 {
    f32::from_bits(if bits >> 31 == 1 {
        bits & !(1 << 31)
    } else {
        !bits
    })
}

/// The most bits of a digit: a first-level cache holds a line for each of its values.
const MAX_DIGIT_BITS: u32 = 9;

/// Bits of a key by which the ranges of workers are told apart.
const RANGE_BITS: u32 = 12;

/// From how many pairs on it pays to share the work.
const MANY: usize = 1 << 14;

/// Sorts `(key, payload)` pairs by ascending key; equal keys keep their order.
pub fn sort_by_key(pairs: &mut Vec<(u32, u32)>) {
    let mut other: Vec<(u32, u32)> = host::zeroed(pairs.len());
    if sort_between(pairs, &mut other) {
        std::mem::swap(pairs, &mut other);
    }
}

/// The bits that are set in all keys, and in any.
fn common_bits(keys: impl Iterator<Item = u32>) -> (u32, u32) {
    keys.fold((u32::MAX, 0), |(all, any), key| (all & key, any | key))
}

/// The lowest bit that differs, and how many there are from it to the highest; none differ if that is none.
fn span(differing: u32) -> (u32, u32) {
    if differing == 0 {
        return (0, 0);
    }
    let first = differing.trailing_zeros();
    (first, u32::BITS - differing.leading_zeros() - first)
}

/// Sorts pairs, of which both slices hold as many; true if they end in the second.
fn sort_between(pairs: &mut [(u32, u32)], other: &mut [(u32, u32)]) -> bool {
    let (all, any) = common_bits(pairs.iter().map(|pair| pair.0));
    if pairs.is_empty() || all == any {
        return false;
    }
    let differing = all ^ any;
    let (first, width) = span(differing);
    let bits = width.div_ceil(width.div_ceil(MAX_DIGIT_BITS));
    let (mut from, mut to) = (pairs, other);
    let mut is_second = false;
    for shift in (first..first + width).step_by(bits as usize) {
        if (differing >> shift) & ((1 << bits) - 1) != 0 {
            scatter(from, to, shift, bits);
            std::mem::swap(&mut from, &mut to);
            is_second = !is_second;
        }
    }
    is_second
}

/// Sorts what lists hold: each item's first number is its key, and its payload is its place in its list plus `stride`
/// times the list's number. Then calls `settle` with pieces between which no key is shared. `workers` share the work.
pub fn sort_lists<L: AsRef<[[u32; 2]]> + Sync>(
    lists: &[L],
    stride: u32,
    workers: usize,
    settle: impl Fn(&mut [(u32, u32)]) + Sync,
) -> Vec<(u32, u32)> {
    let count = lists.iter().map(|list| list.as_ref().len()).sum();
    if workers == 1 || count < MANY {
        let mut pairs = host::with_capacity(count);
        for_pairs(lists, stride, |pair| pairs.push(pair));
        sort_by_key(&mut pairs);
        settle(&mut pairs);
        return pairs;
    }
    let mut pairs: Vec<(u32, u32)> = host::zeroed(count);
    let ranges = Ranges::new(lists, workers);
    let mut rest = &mut pairs[..];
    let mut parts = Vec::new();
    for (digits, count) in ranges.parts {
        let (part, after) = rest.split_at_mut(count);
        rest = after;
        parts.push((digits, part));
    }
    parts.into_par_iter().for_each(|(digits, sorted)| {
        // What is not kept is written, too, and written over.
        let mut picked: Vec<(u32, u32)> = host::zeroed(sorted.len() + 1);
        let mut kept = 0;
        for_pairs(lists, stride, |pair| {
            picked[kept] = pair;
            kept += usize::from(digits.contains(&(pair.0 >> ranges.shift)));
        });
        let picked = &mut picked[..sorted.len()];
        if !sort_between(picked, sorted) {
            sorted.copy_from_slice(picked);
        }
        settle(sorted);
    });
    pairs
}

/// Calls `each` with all keys and payloads, in order.
#[inline(always)]
fn for_pairs<L: AsRef<[[u32; 2]]>>(lists: &[L], stride: u32, mut each: impl FnMut((u32, u32))) {
    for (number, list) in lists.iter().enumerate() {
        let first = number as u32 * stride;
        for (&[key, _], place) in list.as_ref().iter().zip(first..) {
            each((key, place));
        }
    }
}

/// How keys are shared among workers.
struct Ranges {
    /// The lowest bit that tells.
    shift: u32,
    /// For each worker: its keys without the bits below, and how many there are.
    parts: Vec<(std::ops::RangeInclusive<u32>, usize)>,
}

impl Ranges {
    fn new<L: AsRef<[[u32; 2]]> + Sync>(lists: &[L], workers: usize) -> Self {
        let bits_of = |list: &L| common_bits(list.as_ref().iter().map(|item| item[0]));
        let (all, any) = lists.par_iter().map(bits_of).reduce(
            || (u32::MAX, 0),
            |(all, any), (more_all, more_any)| (all & more_all, any | more_any),
        );
        let (first, width) = span(all ^ any);
        let shift = first + width.saturating_sub(RANGE_BITS);
        // The bits above those that differ are the same everywhere.
        let lowest = (all >> shift) & !((1u32 << RANGE_BITS) - 1);
        let of_list = |mut counts: Vec<u32>, list: &L| {
            for item in list.as_ref() {
                let digit = (item[0] >> shift) & ((1 << RANGE_BITS) - 1);
                counts[digit as usize] += 1;
            }
            counts
        };
        let none = || host::zeroed(1 << RANGE_BITS);
        let counts = lists
            .par_iter()
            .fold(none, of_list)
            .reduce(none, |mut a, b| {
                a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
                a
            });
        let total: usize = counts.iter().map(|&count| count as usize).sum();
        let mut parts = Vec::new();
        let (mut from, mut inside, mut before) = (0u32, 0usize, 0usize);
        for (digit, &count) in counts.iter().enumerate() {
            inside += count as usize;
            let is_last = digit + 1 == counts.len();
            // As near to the next worker's share as a digit's end can be.
            let share = total * (parts.len() + 1) / workers;
            if is_last || parts.len() + 1 < workers && before + inside >= share {
                let digit = digit as u32;
                parts.push((lowest + from..=lowest + digit, inside));
                (from, before, inside) = (digit + 1, before + inside, 0);
            }
        }
        Self { shift, parts }
    }
}

/// One counting-sort pass over the digit of so many bits at `shift`.
fn scatter(from: &[(u32, u32)], to: &mut [(u32, u32)], shift: u32, bits: u32) {
    let mask = (1usize << bits.min(MAX_DIGIT_BITS)) - 1;
    let digit = |key: u32| (key >> shift) as usize & mask;
    let mut next = [0u32; 1 << MAX_DIGIT_BITS];
    for &(key, _) in from {
        next[digit(key)] += 1;
    }
    let mut start = 0;
    for slot in &mut next {
        start += std::mem::replace(slot, start);
    }
    for &pair in from {
        let slot = &mut next[digit(pair.0)];
        to[*slot as usize] = pair;
        *slot += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn bits_order_as_numbers_do() {
        let ascending = [
            f32::NEG_INFINITY,
            -1e30,
            -1.0,
            -1e-45,
            -0.0,
            0.0,
            1e-45,
            0.2,
            0.2f32.next_up(),
            3e38,
            f32::INFINITY,
        ];
        for value in ascending {
            assert_eq!(value_of(ordered_bits(value)).to_bits(), value.to_bits());
        }
        for pair in ascending.windows(2) {
            assert!(ordered_bits(pair[0]) < ordered_bits(pair[1]), "{pair:?}");
        }
    }

    proptest! {
        #[test]
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
            let mut expected = Vec::new();
            for_pairs(&lists, 4096, |pair| expected.push(pair));
            expected.sort_by_key(|pair| pair.0);
            let seen = std::sync::atomic::AtomicUsize::new(0);
            let found = sort_lists(&lists, 4096, workers, |part| {
                assert!(part.is_sorted_by_key(|pair| pair.0));
                seen.fetch_add(part.len(), std::sync::atomic::Ordering::Relaxed);
            });
            prop_assert_eq!(found, expected);
            prop_assert_eq!(seen.into_inner(), lists.iter().map(Vec::len).sum::<usize>());
        }

        #[test]
        fn it_is_a_stable_sort(keys in prop::collection::vec(prop_oneof![any::<u32>(), 0u32..4, Just(u32::MAX)], 0..300)) {
            let mut pairs: Vec<_> = keys.iter().zip(0..).map(|(&key, at)| (key, at)).collect();
            let mut expected = pairs.clone();
            expected.sort_by_key(|&(key, _)| key);
            sort_by_key(&mut pairs);
            prop_assert_eq!(pairs, expected);
        }
    }
}
