//! The depth order of a set: a stable sort by key, and equal keys in the order of the draw.

use super::lanes::GROUP;
use super::sort;
use super::splat::{ProjectedGroup, locate};
use devmem::host;

/// A key, and a name that [`locate`] understands.
type Pair = (u32, u32);

/// The survivors in depth order: key, and group number times `GROUP` plus place in the group.
pub(super) fn sorted(groups: &[ProjectedGroup], workers: usize) -> Vec<Pair> {
    let keys = keys_of(groups);
    let settle = |pairs: &mut [Pair]| settle_ties(&keys, pairs);
    sort::sort_lists(&keys, GROUP as u32, workers, settle)
}

/// The keys of each group, close together.
fn keys_of(groups: &[ProjectedGroup]) -> Vec<&[[u32; 2]]> {
    host::collect(groups.iter().map(|group| &group.keys[..]))
}

/// Has equal keys of a sorted sequence follow in the order of the set. Groups are not in that, once there are clusters.
fn settle_ties(keys: &[&[[u32; 2]]], pairs: &mut [Pair]) {
    let sequence = |&(_, name): &Pair| {
        let (group, place) = locate(name);
        #[cfg(feature = "mistakes")]
        if crate::mistakes::Mistake::TiesReversed.is_made() {
            return !keys[group][place][1];
        }
        keys[group][place][1]
    };
    // What decides lies anywhere, so that each would be waited for.
    let mut tied = Vec::new();
    for (at, two) in pairs.windows(2).enumerate() {
        if two[0].0 == two[1].0 {
            host::push(&mut tied, at);
            for &(_, name) in two {
                let (group, place) = locate(name);
                devmem::prefetch(std::slice::from_ref(&keys[group][place]));
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
