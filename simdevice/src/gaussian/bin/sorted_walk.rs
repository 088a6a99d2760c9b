//! The sorted sequence that tiles search where there are no lists.

use crate::gaussian::splats::footprint::{TileFootprint, TileSpan};
use crate::gaussian::splats::group::ProjectedGroup;
use crate::gaussian::splats::splat::SplatIndex;
use devmem::host;
use rayon::prelude::*;

/// A primitive and its footprint.
#[derive(Clone, Copy, Debug)]
struct Walked {
    primitive: u32,
    footprint: TileFootprint,
}

/// The least number of primitives per task in gathering the sorted sequence.
const RUN: usize = 4096;

/// The primitives in depth order with their footprints. Each tile searches them for its own.
#[derive(Debug)]
pub(crate) struct SortedWalk {
    sorted: Vec<Walked>,
    /// The spans of each group's footprints.
    spans: Vec<Vec<TileSpan>>,
    pub(super) pairs: u64,
}

impl SortedWalk {
    pub(super) fn new(groups: &mut [ProjectedGroup], order: &[(u32, u32)]) -> Self {
        let mut sorted: Vec<Walked> = host::with_capacity(order.len());
        let seen = &*groups;
        // It writes into the reserved capacity.
        order
            .par_iter()
            .with_min_len(RUN)
            .map(|&(_, primitive)| {
                let index = SplatIndex::new(primitive);
                Walked { primitive, footprint: seen[index.group].reaches[index.place] }
            })
            .collect_into_vec(&mut sorted);
        let taken = groups.iter_mut().map(|group| std::mem::take(&mut group.spans));
        let spans = host::collect(taken);
        let tiles = |walked: &Walked| {
            let spans = walked.footprint.spans(&spans[SplatIndex::new(walked.primitive).group]);
            let lengths = spans.map(|(_, span)| u64::from(span.end - span.first));
            lengths.sum::<u64>()
        };
        Self { pairs: sorted.par_iter().with_min_len(RUN).map(tiles).sum(), sorted, spans }
    }

    /// Replaces `list` by the next primitives of a tile, at most `most`, from index `from` of the sequence on, and
    /// advances `from`. `list` is empty if there are no more.
    pub(crate) fn next(&self, [x, y]: [u32; 2], from: &mut usize, most: usize, list: &mut Vec<u32>) {
        list.clear();
        while let Some(&Walked { primitive, footprint }) = self.sorted.get(*from) {
            if list.len() == most {
                break;
            }
            *from += 1;
            if footprint.covers(&self.spans[SplatIndex::new(primitive).group], x, y) {
                host::push(list, primitive);
            }
        }
    }

    pub(super) fn memory_bytes(&self) -> u64 {
        let spans = self.spans.iter().map(|spans| size_of_val(&**spans) as u64);
        size_of_val(&*self.sorted) as u64 + spans.sum::<u64>()
    }
}
