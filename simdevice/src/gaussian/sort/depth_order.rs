//! The depth order of a set: a stable sort by depth key. Equal keys keep the order of the draw.

use super::radix;
use super::radix::{SortBuffers, SortedPairs};
use crate::gaussian::lanes::GROUP;
use crate::gaussian::splats::group::ProjectedGroup;
use crate::gaussian::splats::splat::SplatIndex;
use devmem::host;

/// A depth key, and the number of a splat: see [`SplatIndex`].
type Pair = (u32, u32);

/// The projected Gaussians in depth order: key, and group number times `GROUP` plus lane. The memory comes from
/// `buffers`.
pub(crate) fn sorted(groups: &[ProjectedGroup], workers: usize, buffers: &SortBuffers) -> SortedPairs {
    let keys = keys_of(groups);
    let settle = |pairs: &mut [Pair]| settle_ties(&keys, pairs);
    radix::sort_lists(&keys, GROUP as u32, workers, buffers, settle)
}

/// The keys of each group.
fn keys_of(groups: &[ProjectedGroup]) -> Vec<&[[u32; 2]]> {
    host::collect(groups.iter().map(|group| &group.keys[..]))
}

/// Orders runs of equal keys by their sequence numbers in the set. With clusters, the groups themselves are not in that
/// order.
fn settle_ties(keys: &[&[[u32; 2]]], pairs: &mut [Pair]) {
    let sequence = |&(_, number): &Pair| SplatIndex::new(number).of(keys)[1];
    // Sequence numbers are scattered in memory, so they are prefetched first.
    let mut tied = Vec::new();
    for (at, two) in pairs.windows(2).enumerate() {
        if two[0].0 == two[1].0 {
            host::push(&mut tied, at);
            for &(_, number) in two {
                devmem::prefetch(std::slice::from_ref(SplatIndex::new(number).of(keys)));
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
