//! The depth order of a set: that of the last picture, repaired, or else a sort.
//!
//! A camera that slides, rolls or goes ahead changes all depths by the same amount, so that only roundings, and what comes into
//! the picture and leaves it, change the order. The new keys are brought into the old order, what is new is merged into
//! it, and what is out of place moves back to its own. That is checked pair by pair, so that the order is exactly a sort's. Where
//! much is out of place, as when a camera turns, a sample tells, and the rest is not looked at.

use super::fetch::BATCH;
use super::splat::Projected;
use super::{locate, sort};
use devmem::host;
use rayon::prelude::*;

/// A key, and a name that [`locate`] understands.
type Pair = (u32, u32);

/// The name of what is not drawn any more. Sets with so many batches are not repaired.
const GONE: u32 = u32::MAX;

/// Sets of fewer Gaussians are sorted at once.
const LEAST: usize = 128;

/// Of so many one may be new, gone or out of place.
const SHARE: usize = 8;

/// Neighbours in the old order whose new keys are looked at first, and how many together.
const SAMPLE: usize = 64;
const SAMPLE_WINDOW: usize = 3;

/// Moves by one place that are made before they are compared with what is in order already.
const FREE_MOVES: usize = 256;

/// Old batches that a worker takes at a time.
const BATCHES_PER_TASK: usize = 64;

/// The Gaussians of a picture in depth order.
#[derive(Debug)]
pub(super) struct Order {
    /// The numbers of the batches that were projected, among all of the set, ascending.
    numbers: Vec<u32>,
    /// By batch: the key and the place in the set of each.
    keys: Vec<Vec<[u32; 2]>>,
    pairs: Vec<Pair>,
}

impl Order {
    /// The order `pairs` of batches with these numbers, for the next picture; unless there are other batches, too, as in
    /// pictures that repeat. Takes the batches' keys.
    pub(super) fn keep(
        numbers: Vec<u32>,
        batches: &mut [Projected],
        pairs: Vec<Pair>,
    ) -> Option<Self> {
        (numbers.len() == batches.len()).then(|| {
            let keys = batches
                .iter_mut()
                .map(|batch| std::mem::take(&mut batch.keys));
            Self {
                keys: host::collect(keys),
                numbers,
                pairs,
            }
        })
    }

    /// Bytes of host memory that it holds.
    pub(super) fn memory_bytes(&self) -> u64 {
        let keys = self.keys.iter().map(|keys| 8 * keys.capacity() as u64);
        keys.sum::<u64>() + 8 * self.pairs.capacity() as u64 + 4 * self.numbers.len() as u64
    }
}

/// The survivors in depth order, as key and batch number times `BATCH` plus place in the batch; and whether that is the
/// order of the last picture, repaired. `numbers` are the batches', as in [`Order::keep`].
pub(super) fn find(
    batches: &[Projected],
    numbers: &[u32],
    last: Option<&Order>,
    workers: usize,
) -> (Vec<Pair>, bool) {
    let last = last.filter(|_| numbers.len() == batches.len());
    match last.and_then(|last| repaired(last, batches, numbers, workers)) {
        Some(pairs) => (pairs, true),
        None => (sorted(batches, workers), false),
    }
}

/// The survivors, sorted.
fn sorted(batches: &[Projected], workers: usize) -> Vec<Pair> {
    let keys = keys_of(batches);
    let settle = |pairs: &mut [Pair]| settle_ties(&keys, pairs);
    sort::sort_lists(&keys, BATCH as u32, workers, settle)
}

/// The keys of each batch, close together.
fn keys_of(batches: &[Projected]) -> Vec<&[[u32; 2]]> {
    host::collect(batches.iter().map(|batch| &batch.keys[..]))
}

/// Has equal keys of a sorted sequence follow in the order of the set. Batches are not in that, once there are chunks.
fn settle_ties(keys: &[&[[u32; 2]]], pairs: &mut [Pair]) {
    let sequence = |&(_, name): &Pair| {
        let (batch, place) = locate(name);
        keys[batch][place][1]
    };
    // What decides lies anywhere, so that each would be waited for.
    let mut tied = Vec::new();
    for (at, two) in pairs.windows(2).enumerate() {
        if two[0].0 == two[1].0 {
            host::push(&mut tied, at);
            for &(_, name) in two {
                let (batch, place) = locate(name);
                devmem::prefetch(std::slice::from_ref(&keys[batch][place]));
            }
        }
    }
    let mut tied = tied.into_iter().peekable();
    while let Some(first) = tied.next() {
        let mut last = first + 1;
        while tied.next_if_eq(&last).is_some() {
            last += 1;
        }
        let ties = &mut pairs[first..=last];
        if !ties.is_sorted_by_key(sequence) {
            ties.sort_unstable_by_key(sequence);
        }
    }
}

/// The place of a survivor in the set.
fn sequence(batches: &[Projected], name: u32) -> u32 {
    let (batch, place) = locate(name);
    batches[batch].keys[place][1]
}

/// The last picture's order with the new keys, without what is gone, with what is new, and with what is out of place where
/// it belongs; `None` if there is much of that.
fn repaired(
    last: &Order,
    batches: &[Projected],
    numbers: &[u32],
    workers: usize,
) -> Option<Vec<Pair>> {
    let count: usize = batches.iter().map(|batch| batch.keys.len()).sum();
    let much = count / SHARE;
    let is_other = count.abs_diff(last.pairs.len()) > much;
    if count < LEAST || is_other || batches.len() > GONE as usize / BATCH {
        return None;
    }
    let matched = match_numbers(&last.numbers, numbers);
    if is_out_of_order(last, batches, &matched) {
        return None;
    }
    let (now, mut fresh) = Now::new(last, batches, &matched);
    if fresh.len() > much {
        return None;
    }
    sort::sort_by_key(&mut fresh);
    settle_ties(&keys_of(batches), &mut fresh);
    now.merge(&last.pairs, &fresh, workers)
}

/// For each old number the place of the same among the new ones, or [`GONE`]. Both ascend.
fn match_numbers(old: &[u32], new: &[u32]) -> Vec<u32> {
    let mut rest = (0u32..).zip(new).peekable();
    let place = |number: &u32| {
        while rest.next_if(|(_, new)| *new < number).is_some() {}
        let same = rest.next_if(|(_, new)| *new == number);
        same.map_or(GONE, |(place, _)| place)
    };
    host::collect(old.iter().map(place))
}

/// Whether much of a sample of the old order is gone, or out of order by its new keys.
fn is_out_of_order(last: &Order, batches: &[Projected], matched: &[u32]) -> bool {
    let now = |&(_, name): &Pair| {
        let (batch, place) = locate(name);
        let new = batches.get(matched[batch] as usize)?;
        let sequence = last.keys[batch][place][1];
        let is_same = |key: &&[u32; 2]| key[1] == sequence;
        let there = new.keys.get(place).filter(is_same);
        there.or_else(|| new.keys.iter().find(is_same)).copied()
    };
    let windows = last.pairs.windows(SAMPLE_WINDOW);
    let step = (windows.len() / SAMPLE).max(1);
    let [mut gone, mut out_of_order, mut looked_at] = [0; 3];
    for window in windows.step_by(step) {
        let keys: [_; SAMPLE_WINDOW] = std::array::from_fn(|at| now(&window[at]));
        gone += keys.iter().filter(|key| key.is_none()).count();
        let known = keys.iter().flatten();
        out_of_order += usize::from(!known.is_sorted());
        looked_at += 1;
    }
    gone * SHARE > looked_at * SAMPLE_WINDOW || out_of_order * SHARE > looked_at
}

/// What has become of the last picture's Gaussians.
struct Now<'a> {
    batches: &'a [Projected],
    /// Where those of each old batch begin.
    starts: Vec<u32>,
    /// The new key and the new name of each.
    pairs: Vec<Pair>,
}

impl<'a> Now<'a> {
    /// That, and what is new, in any order.
    fn new(last: &Order, batches: &'a [Projected], matched: &[u32]) -> (Self, Vec<Pair>) {
        let mut start = 0;
        let starts = last.keys.iter().map(|keys| {
            let own = start;
            start += keys.len() as u32;
            own
        });
        let starts = host::collect(starts);
        let mut pairs: Vec<Pair> = host::zeroed(start as usize);
        let mut rest = &mut pairs[..];
        let mut is_known: Vec<u8> = host::zeroed(batches.len());
        let mut tasks = host::with_capacity(matched.len());
        for (old, &new) in last.keys.iter().zip(matched) {
            let (own, after) = std::mem::take(&mut rest).split_at_mut(old.len());
            rest = after;
            let keys: &[_] = batches.get(new as usize).map_or(&[], |new| &new.keys);
            if let Some(is_known) = is_known.get_mut(new as usize) {
                *is_known = 1;
            }
            tasks.push((&old[..], keys, new.wrapping_mul(BATCH as u32), own));
        }
        let tasks_count = tasks.len();
        let matched = tasks
            .into_par_iter()
            .with_min_len(BATCHES_PER_TASK)
            .map(|(old, new, first, own)| match_batch(old, new, first, own));
        let mut fresh: Vec<Vec<Pair>> = host::with_capacity(tasks_count + batches.len());
        matched.collect_into_vec(&mut fresh);
        for (number, _) in is_known
            .iter()
            .enumerate()
            .filter(|(_, known)| **known == 0)
        {
            let names = (number * BATCH) as u32..;
            let keys = batches[number].keys.iter().map(|key| key[0]);
            fresh.push(host::collect(keys.zip(names)));
        }
        let now = Self {
            batches,
            starts,
            pairs,
        };
        (now, host::collect(fresh.into_iter().flatten()))
    }

    /// What the old name stands for.
    #[inline(always)]
    fn of(&self, name: u32) -> Pair {
        let (batch, place) = locate(name);
        self.pairs[self.starts[batch] as usize + place]
    }

    #[inline(always)]
    fn is_before(&self, a: Pair, b: Pair) -> bool {
        a.0 < b.0 || a.0 == b.0 && self.is_earlier(a.1, b.1)
    }

    #[cold]
    fn is_earlier(&self, a: u32, b: u32) -> bool {
        sequence(self.batches, a) < sequence(self.batches, b)
    }

    /// The old order with the new keys and what is `fresh`, which is in order; `None` if much is out of place.
    fn merge(&self, old: &[Pair], fresh: &[Pair], workers: usize) -> Option<Vec<Pair>> {
        let runs = old.chunks(old.len().div_ceil(workers.max(1)));
        let mut rest = fresh;
        let mut parts = Vec::new();
        for run in runs.rev() {
            let mut known = run.iter().map(|&(_, name)| self.of(name));
            let first = known.find(|pair| pair.1 != GONE);
            let before = first.map_or(rest.len(), |first| {
                rest.partition_point(|&pair| self.is_before(pair, first))
            });
            let is_first = run.as_ptr() == old.as_ptr();
            let (before, own) = rest.split_at(if is_first { 0 } else { before });
            rest = before;
            parts.push((run, own));
        }
        let parts = parts.into_par_iter().rev();
        let parts = parts.map(|(run, fresh)| self.merge_run(run, fresh));
        let mut parts = parts.collect::<Option<Vec<_>>>()?.into_iter();
        let mut all = parts.next()?;
        for part in parts {
            let seam = all.len();
            host::extend(&mut all, &part);
            let mut moves = 0;
            for end in seam + 1..=all.len() {
                let more = self.settle_last(&mut all[..end], &mut moves)?;
                if !more {
                    break;
                }
            }
        }
        Some(all)
    }

    /// As [`Now::merge`], for a run of the old order.
    fn merge_run(&self, old: &[Pair], mut fresh: &[Pair]) -> Option<Vec<Pair>> {
        let mut all: Vec<Pair> = host::with_capacity(old.len() + fresh.len());
        let mut moves = 0;
        for &(_, name) in old {
            let pair = self.of(name);
            if pair.1 == GONE {
                continue;
            }
            while let Some((&first, after)) = fresh.split_first() {
                if !self.is_before(first, pair) {
                    break;
                }
                all.push(first);
                fresh = after;
            }
            all.push(pair);
            self.settle_last(&mut all, &mut moves)?;
        }
        all.extend(fresh);
        Some(all)
    }

    /// Moves the last of `pairs` to its place among the others, which are in order; whether it was out of it. `None` if
    /// there were many `moves`.
    #[inline(always)]
    fn settle_last(&self, pairs: &mut [Pair], moves: &mut usize) -> Option<bool> {
        match pairs {
            [.., before, last] if self.is_before(*last, *before) => {
                self.move_last(pairs, moves).then_some(true)
            }
            _ => Some(false),
        }
    }

    /// As [`Now::settle_last`]; false if there were many `moves`.
    fn move_last(&self, pairs: &mut [Pair], moves: &mut usize) -> bool {
        let most = FREE_MOVES + pairs.len() / 2;
        let mut at = pairs.len() - 1;
        while at > 0 && self.is_before(pairs[at], pairs[at - 1]) {
            pairs.swap(at, at - 1);
            at -= 1;
            *moves += 1;
            if *moves > most {
                return false;
            }
        }
        true
    }
}

/// What has become of the Gaussians of a batch, given their old keys and the new ones of those that are left and of others:
/// their new keys and names, of which the batch's first is `first`. Gives those that are new. Both follow the order of one
/// list, in which each has another place in the set.
fn match_batch(old: &[[u32; 2]], new: &[[u32; 2]], first: u32, out: &mut [Pair]) -> Vec<Pair> {
    let mut fresh = Vec::new();
    let (mut from, mut to) = (0, 0);
    while let (Some(was), Some(is)) = (old.get(from), new.get(to)) {
        let name = first.wrapping_add(to as u32);
        if was[1] == is[1] {
            out[from] = (is[0], name);
            (from, to) = (from + 1, to + 1);
        } else if new[to..].iter().any(|is| is[1] == was[1]) {
            host::push(&mut fresh, (is[0], name));
            to += 1;
        } else {
            out[from] = (0, GONE);
            from += 1;
        }
    }
    out[from..].fill((0, GONE));
    let names = first.wrapping_add(to as u32)..;
    let rest = new[to..].iter().map(|is| is[0]).zip(names);
    host::reserve(&mut fresh, new.len() - to);
    fresh.extend(rest);
    fresh
}

#[cfg(test)]
mod tests {
    use super::super::sort::ordered_bits;
    use super::*;
    use proptest::prelude::*;

    /// A scene in batches, which are not in the order of the set.
    struct Scene {
        /// By batch: places in the set and positions.
        batches: Vec<Vec<(u32, [f32; 2])>>,
    }

    /// A number below `below` that follows from a seed.
    fn random(seed: u64, below: u64) -> u64 {
        let mixed = (seed ^ seed >> 31).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        ((mixed ^ mixed >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 33) % below
    }

    impl Scene {
        /// `count` Gaussians, some of which have the same depth.
        fn new(count: u32, seed: u64) -> Self {
            let position = |number: u32| {
                let axis = |axis: u64| random(seed + 2 * u64::from(number) + axis, 1 << 12);
                [axis(0), axis(1)].map(|value| 2.0 + value as f32 / 1024.0)
            };
            let mut places: Vec<u32> = (0..count).collect();
            places.sort_by_key(|&number| (random(number.into(), 16), number ^ 5));
            let batches = places.chunks(200).map(|places| {
                let places = places.iter();
                places.map(|&number| (number, position(number))).collect()
            });
            Self {
                batches: batches.collect(),
            }
        }

        /// What is seen of it, by depths that are moved, after a turn; one of `gone` is not drawn. Numbers of batches, too.
        fn seen(&self, moved: f32, turn: f32, gone: u64, seed: u64) -> (Vec<Projected>, Vec<u32>) {
            let mut seen = (Vec::new(), Vec::new());
            for (number, batch) in (0u32..).zip(&self.batches) {
                if random(seed + 7 * u64::from(number), 3 * gone) == 0 {
                    continue;
                }
                let is_seen = |place: u32| random(seed + 11 * u64::from(place), gone) != 0;
                let of = batch.iter().filter(|(place, _)| is_seen(*place));
                let keys = of.map(|&(place, [x, z])| {
                    let depth = z * turn.cos() + x * turn.sin() + moved;
                    [ordered_bits(depth), place]
                });
                seen.0.push(Projected {
                    keys: keys.collect(),
                    ..Projected::default()
                });
                seen.1.push(number);
            }
            seen
        }
    }

    proptest! {
        #[test]
        fn a_repaired_order_is_a_sort_s(
            count in prop_oneof![0u32..600, 2000u32..6000],
            moved in prop_oneof![Just(0.0f32), -1.0f32..1.0],
            turn in prop_oneof![Just(0.0f32), 0.0f32..1e-3, Just(1.0f32)],
            gone in prop_oneof![Just(u64::from(u32::MAX)), 4u64..200],
            workers in 1usize..6,
            seed in any::<u32>(),
        ) {
            let scene = Scene::new(count, seed.into());
            let (mut batches, numbers) = scene.seen(0.0, 0.0, gone, seed.into());
            let (pairs, is_repaired) = find(&batches, &numbers, None, workers);
            prop_assert!(!is_repaired);
            let last = Order::keep(numbers, &mut batches, pairs).unwrap();
            // The same ones are gone, or others.
            let seed = u64::from(seed) + u64::from(moved > 0.5);
            let (batches, numbers) = scene.seen(moved, turn, gone, seed);
            let (found, is_repaired) = find(&batches, &numbers, Some(&last), workers);
            prop_assert!(found == sorted(&batches, 1));
            let is_enough = found.len() >= LEAST;
            if turn == 0.0 && moved <= 0.5 {
                prop_assert_eq!(is_repaired, is_enough);
            } else if turn == 1.0 {
                prop_assert!(!is_repaired);
            }
        }
    }

    /// Batches of given keys, whose places in the set follow one another.
    fn of_keys(keys: &[u32]) -> (Vec<Projected>, Vec<u32>) {
        let keys: Vec<[u32; 2]> = keys.iter().copied().zip(0..).map(|(k, n)| [k, n]).collect();
        let batches = keys.chunks(BATCH).map(|keys| Projected {
            keys: keys.to_vec(),
            ..Projected::default()
        });
        let batches: Vec<_> = batches.collect();
        let numbers = (0..batches.len() as u32).collect();
        (batches, numbers)
    }

    /// Whether an order by keys 0, 1, 2 ... is repaired for other ones; it is a sort's in any case.
    fn is_repaired(keys: &[u32]) -> bool {
        let ascending: Vec<u32> = (0..keys.len() as u32).collect();
        let (mut batches, numbers) = of_keys(&ascending);
        let (pairs, _) = find(&batches, &numbers, None, 1);
        let last = Order::keep(numbers, &mut batches, pairs).unwrap();
        let (batches, numbers) = of_keys(keys);
        let found = [1, 2, 3].map(|workers| {
            let (found, is_repaired) = find(&batches, &numbers, Some(&last), workers);
            assert_eq!(found, sorted(&batches, 1));
            is_repaired
        });
        assert!(found.iter().all(|&other| other == found[0]));
        found[0]
    }

    #[test]
    fn what_is_out_of_place_is_moved() {
        let ascending: Vec<u32> = (0..4000).collect();
        assert!(is_repaired(&ascending));
        assert!(is_repaired(&[7; 4000]), "all are as deep");
        let mut swapped = ascending.clone();
        swapped.chunks_mut(40).for_each(|keys| keys.swap(3, 4));
        assert!(is_repaired(&swapped));
        let mut far = ascending.clone();
        far[1900] = 2100;
        far[2101] = 1950;
        // Between the shares of two workers.
        far.swap(1998, 2003);
        assert!(is_repaired(&far));
    }

    #[test]
    fn what_is_all_out_of_place_is_sorted() {
        let descending: Vec<u32> = (0..4000).rev().collect();
        assert!(!is_repaired(&descending));
        let swapped: Vec<u32> = (0..4000).map(|key| key ^ 1).collect();
        assert!(!is_repaired(&swapped), "the sample tells");
        // A few that the sample does not see, far from where they belong.
        let mut far: Vec<u32> = (0..4000).collect();
        far[..40].iter_mut().for_each(|key| *key += 3900);
        assert!(!is_repaired(&far), "it would take many moves");
    }
}
