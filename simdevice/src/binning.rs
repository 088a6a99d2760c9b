//! Binning: depth-sorted primitives to lists per tile.
//!
//! Sorting comes first, and placement is stable, so that every list is in depth order without a sort of its
//! own. Workers take runs of the sorted sequence and write down the pairs of a tile and a primitive, apart for each band
//! of rows of tiles; then workers take bands, count and place. What primitives reach differs in ways that no branch
//! foresees, so that pairs are written first and are all alike later.
//!
//! Where lists would outgrow their budget, as those of a million Gaussians that fill a large screen do, there are none:
//! each tile then walks the sorted sequence itself, a piece at a time, until it is saturated.

use crate::gaussian::footprint::{Reach, Span, TILE_SIZE};
use crate::gaussian::locate;
use crate::gaussian::splat::Projected;
use crate::packet::Rect;
use devmem::host;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// The lists of some rows of tiles.
#[derive(Debug, Default)]
struct Band {
    /// Where each tile's list begins, row by row, and one past the last.
    starts: Vec<u32>,
    primitives: Vec<u32>,
}

/// Lists of primitives by tile, each in the order of the sorted sequence.
#[derive(Debug)]
pub(crate) struct TileLists {
    /// The first row of tiles.
    first_row: u32,
    /// Tiles of a row.
    columns: u32,
    /// Rows of a band; the last may have fewer.
    band_rows: u32,
    bands: Vec<Band>,
    /// What there is instead of lists.
    stream: Option<Stream>,
}

/// A primitive and what it reaches.
type Reaching = (u32, Reach);

/// The survivors in depth order, for tiles to find theirs among them.
#[derive(Debug)]
pub(crate) struct Stream {
    sorted: Vec<Reaching>,
    /// Of each batch.
    spans: Vec<Vec<Span>>,
    pairs: u64,
}

impl Stream {
    fn new(batches: &mut [Projected], order: &[(u32, u32)]) -> Self {
        let mut sorted: Vec<Reaching> = host::with_capacity(order.len());
        let seen = &*batches;
        // It writes to the room that there is.
        order
            .par_iter()
            .with_min_len(RUN)
            .map(|&(_, primitive)| {
                let (batch, place) = locate(primitive);
                (primitive, seen[batch].reaches[place])
            })
            .collect_into_vec(&mut sorted);
        let taken = batches
            .iter_mut()
            .map(|batch| std::mem::take(&mut batch.spans));
        let spans = host::collect(taken);
        let tiles = |(primitive, reach): &Reaching| {
            let spans = reach.spans(&spans[locate(*primitive).0]);
            let lengths = spans.map(|(_, span)| u64::from(span.end - span.first));
            lengths.sum::<u64>()
        };
        Self {
            pairs: sorted.par_iter().with_min_len(RUN).map(tiles).sum(),
            sorted,
            spans,
        }
    }

    /// Makes `list` the next primitives of a tile, at most so many, from place `from` of the sequence on, which moves
    /// on. Empty if there are no more.
    pub(crate) fn next(
        &self,
        [x, y]: [u32; 2],
        from: &mut usize,
        most: usize,
        list: &mut Vec<u32>,
    ) {
        list.clear();
        while let Some((primitive, reach)) = self.sorted.get(*from) {
            if list.len() == most {
                break;
            }
            *from += 1;
            if reach.covers(&self.spans[locate(*primitive).0], x, y) {
                host::push(list, *primitive);
            }
        }
    }

    fn memory_bytes(&self) -> u64 {
        let spans = self.spans.iter().map(|spans| size_of_val(&**spans) as u64);
        size_of_val(&*self.sorted) as u64 + spans.sum::<u64>()
    }
}

/// The rows of tiles that a draw may touch.
struct Rows {
    first: u32,
    /// Of each row: its band, and the number that its first tile has there.
    places: Vec<(u32, u32)>,
}

/// Pairs of a tile, by its number in the band, and a primitive. There is room behind them.
#[derive(Debug, Default)]
struct Pairs {
    pairs: Vec<[u32; 2]>,
    len: usize,
}

/// Pairs that are written together, whether they are wanted or not.
const TOGETHER: usize = 4;

/// Primitives whose reaches are brought together, and whose pairs are counted before the budget is looked at.
const GATHERED: usize = 64;

/// Primitives that a worker brings into order at a time.
const RUN: usize = 4096;

impl TileLists {
    /// Places the survivors named by `order`, in that order, in the lists of the tiles they reach, unless those had more
    /// than `most_pairs` entries together.
    pub(crate) fn build(
        batches: &mut [Projected],
        order: &[(u32, u32)],
        bounds: Rect,
        threads: usize,
        most_pairs: u64,
    ) -> Self {
        if bounds.is_empty() || order.is_empty() {
            return Self {
                first_row: 0,
                columns: 0,
                band_rows: 1,
                bands: Vec::new(),
                stream: None,
            };
        }
        // Visible pixels have coordinates from zero on: the render area lies inside its attachments.
        let tile = |pixel: i64| (pixel.max(0) / i64::from(TILE_SIZE)) as u32;
        let first_row = tile(bounds.y.into());
        let rows = tile(i64::from(bounds.y) + i64::from(bounds.height) - 1) - first_row + 1;
        let columns = tile(i64::from(bounds.x) + i64::from(bounds.width) - 1) + 1;
        let threads = threads.max(1);
        let band_rows = rows.div_ceil(threads as u32);
        let bands = rows.div_ceil(band_rows) as usize;
        let places = |row: u32| (row / band_rows, row % band_rows * columns);
        let grid = Rows {
            first: first_row,
            places: host::collect((0..rows).map(places)),
        };
        let pairs = AtomicU64::new(0);
        let allow = |more: u64| pairs.fetch_add(more, Relaxed) + more <= most_pairs;
        let seen = &*batches;
        let runs: Option<Vec<Vec<Pairs>>> = order
            .par_chunks(order.len().div_ceil(threads))
            .map(|run| grid.expand(seen, run, bands, allow))
            .collect();
        let Some(runs) = runs else {
            return Self {
                first_row,
                columns,
                band_rows,
                bands: Vec::new(),
                stream: Some(Stream::new(batches, order)),
            };
        };
        let bands = (0..bands)
            .into_par_iter()
            .map(|band| {
                let written = runs.iter().map(|run| run[band].written());
                Band::place(&host::collect(written), (band_rows * columns) as usize)
            })
            .collect();
        Self {
            first_row,
            columns,
            band_rows,
            bands,
            stream: None,
        }
    }

    /// The primitives of a tile.
    pub(crate) fn list(&self, tile_x: u32, tile_y: u32) -> &[u32] {
        let of = || {
            let row = tile_y.checked_sub(self.first_row)?;
            let band = self.bands.get((row / self.band_rows) as usize)?;
            let tile = row % self.band_rows * self.columns + tile_x;
            let start = *band.starts.get(tile as usize)?;
            let end = *band.starts.get(tile as usize + 1)?;
            band.primitives.get(start as usize..end as usize)
        };
        if tile_x < self.columns {
            of().unwrap_or_default()
        } else {
            &[]
        }
    }

    /// What there is instead of lists, if those are too long.
    pub(crate) fn stream(&self) -> Option<&Stream> {
        self.stream.as_ref()
    }

    /// How many pairs of tile and primitive there are.
    pub(crate) fn pairs(&self) -> u64 {
        let pairs = |band: &Band| band.primitives.len() as u64;
        let streamed = self.stream.as_ref().map_or(0, |stream| stream.pairs);
        self.bands.iter().map(pairs).sum::<u64>() + streamed
    }

    /// Whether a tile that shares pixels with `rect` has a primitive, or may have one.
    pub(crate) fn any_in(&self, rect: Rect) -> bool {
        if self.stream.is_some() {
            return true;
        }
        let tiles = |start: i32, size: u32| {
            let start = i64::from(start).max(0);
            let end = (start + i64::from(size)).max(start + 1);
            let size = i64::from(TILE_SIZE);
            (start / size) as u32..=((end - 1) / size) as u32
        };
        tiles(rect.y, rect.height)
            .any(|y| tiles(rect.x, rect.width).any(|x| !self.list(x, y).is_empty()))
    }

    /// Bytes of host memory that the lists take.
    pub(crate) fn memory_bytes(&self) -> u64 {
        let bytes = |band: &Band| size_of_val(&*band.starts) + size_of_val(&*band.primitives);
        let lists = self.bands.iter().map(|band| bytes(band) as u64);
        lists.sum::<u64>() + self.stream.as_ref().map_or(0, Stream::memory_bytes)
    }
}

impl Rows {
    /// The pairs of a run of the sorted sequence, in its order, by band.
    /// `None` once the budget does not `allow` for so many more.
    fn expand(
        &self,
        batches: &[Projected],
        run: &[(u32, u32)],
        bands: usize,
        allow: impl Fn(u64) -> bool,
    ) -> Option<Vec<Pairs>> {
        let mut pairs = host::collect((0..bands).map(|_| Pairs::default()));
        let mut count = 0;
        let mut push = |row: u32, span: Span, primitive: u32, count: &mut u64| {
            let row = row.wrapping_sub(self.first) as usize;
            // Rows without tiles may lie outside.
            if let Some(&(band, first)) = self.places.get(row) {
                let first = first + u32::from(span.first);
                *count += span.len() as u64;
                pairs[band as usize].push(first, span.len(), primitive);
            }
        };
        let mut reaches = [Reach::default(); GATHERED];
        for some in run.chunks(GATHERED) {
            // Before any is looked at, so that the waits for memory overlap.
            for (reach, &(_, primitive)) in reaches.iter_mut().zip(some) {
                let (batch, place) = locate(primitive);
                *reach = batches[batch].reaches[place];
            }
            for (reach, &(_, primitive)) in reaches.iter().zip(some) {
                if let Some(rows) = reach.held() {
                    for (row, span) in rows {
                        push(row, span, primitive, &mut count);
                    }
                } else {
                    let others = &batches[locate(primitive).0].spans;
                    for (row, span) in reach.spans(others) {
                        push(row, span, primitive, &mut count);
                    }
                }
            }
            if !allow(std::mem::take(&mut count)) {
                return None;
            }
        }
        Some(pairs)
    }
}

impl Pairs {
    /// Adds a primitive and `count` tiles from `first` on.
    #[inline(always)]
    fn push(&mut self, first: u32, count: usize, primitive: u32) {
        let mut rest = count;
        let mut tile = first;
        loop {
            if self.pairs.len() < self.len + TOGETHER {
                self.grow();
            }
            let room = &mut self.pairs[self.len..self.len + TOGETHER];
            for (pair, tile) in room.iter_mut().zip(tile..) {
                *pair = [tile, primitive];
            }
            self.len += rest.min(TOGETHER);
            if rest <= TOGETHER {
                return;
            }
            rest -= TOGETHER;
            tile += TOGETHER as u32;
        }
    }

    #[cold]
    fn grow(&mut self) {
        let len = (2 * self.pairs.len()).max(1024);
        host::resize(&mut self.pairs, len, [0; 2]);
    }

    fn written(&self) -> &[[u32; 2]] {
        &self.pairs[..self.len]
    }
}

impl Band {
    /// Counts, then places the pairs of a band of so many tiles, in their order.
    fn place(runs: &[&[[u32; 2]]], tiles: usize) -> Self {
        let pairs = || runs.iter().flat_map(|run| run.iter());
        let mut starts: Vec<u32> = host::zeroed(tiles + 1);
        pairs().for_each(|&[tile, _]| starts[tile as usize] += 1);
        let mut total = 0;
        for start in &mut starts {
            total += std::mem::replace(start, total);
        }
        let mut next = host::copied(&starts);
        let mut primitives: Vec<u32> = host::zeroed(total as usize);
        pairs().for_each(|&[tile, primitive]| {
            let next = &mut next[tile as usize];
            primitives[*next as usize] = primitive;
            *next += 1;
        });
        Self { starts, primitives }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gaussian::footprint::Span;

    #[test]
    fn lists_keep_the_sorted_order() {
        let mut batch = Projected::default();
        for (row, spans) in [
            (1, &[(0, 2)][..]),
            (1, &[(1, 2), (0, 3), (0, 0), (0, 0), (0, 0)]),
            (1, &[(0, 1)]),
        ] {
            let mut reach = Reach::new(row, spans.len() as u16, &mut batch.spans);
            for (number, &(first, end)) in (0..).zip(spans) {
                reach.set(&mut batch.spans, number, Span { first, end });
            }
            batch.reaches.push(reach);
        }
        let order = [(5, 2), (6, 0), (7, 1)];
        let bounds = Rect {
            x: 0,
            y: 16,
            width: 40,
            height: 32,
        };
        let lists = TileLists::build(&mut [batch], &order, bounds, 2, u64::MAX);
        assert_eq!(lists.list(0, 1), [2, 0]);
        assert_eq!(lists.list(1, 1), [0, 1]);
        assert_eq!(lists.list(2, 1), []);
        assert_eq!(lists.list(2, 2), [1]);
        assert_eq!(lists.list(0, 0), [], "outside the bounds there is nothing");
        assert_eq!(lists.list(9, 9), []);
        assert_eq!(lists.pairs(), 7);
        assert!(lists.any_in(Rect {
            x: 33,
            y: 40,
            width: 1,
            height: 1
        }));
        assert!(!lists.any_in(Rect {
            x: 33,
            y: 17,
            width: 9,
            height: 3
        }));
    }
}
