//! Binning: depth-sorted primitives to lists per tile.
//!
//! Sorting comes first, and placement is stable, so that every list is in depth order without a sort of its
//! own. Workers take runs of the sorted sequence and write down the pairs of a tile and a primitive, apart for each band
//! of rows of tiles; then workers take bands, count and place. What primitives reach differs in ways that no branch
//! foresees, so that pairs are written first and are all alike later.

use crate::gaussian::footprint::{Reach, Span, TILE_SIZE};
use crate::gaussian::locate;
use crate::gaussian::project::Projected;
use crate::packet::Rect;
use rayon::prelude::*;

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

/// Primitives whose reaches are brought together at a time.
const GATHERED: usize = 64;

impl TileLists {
    /// Places the survivors named by `order`, in that order, in the lists of the tiles they reach.
    pub(crate) fn build(
        batches: &[Projected],
        order: &[(u32, u32)],
        bounds: Rect,
        threads: usize,
    ) -> Self {
        if bounds.is_empty() || order.is_empty() {
            return Self {
                first_row: 0,
                columns: 0,
                band_rows: 1,
                bands: Vec::new(),
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
            places: (0..rows).map(places).collect(),
        };
        let runs: Vec<Vec<Pairs>> = order
            .par_chunks(order.len().div_ceil(threads))
            .map(|run| grid.expand(batches, run, bands))
            .collect();
        let bands = (0..bands)
            .into_par_iter()
            .map(|band| {
                let pairs: Vec<&[[u32; 2]]> = runs.iter().map(|run| run[band].written()).collect();
                Band::place(&pairs, (band_rows * columns) as usize)
            })
            .collect();
        Self {
            first_row,
            columns,
            band_rows,
            bands,
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

    /// How many pairs of tile and primitive there are.
    pub(crate) fn pairs(&self) -> u64 {
        let pairs = |band: &Band| band.primitives.len() as u64;
        self.bands.iter().map(pairs).sum()
    }

    /// Whether a tile that shares pixels with `rect` has a primitive.
    pub(crate) fn any_in(&self, rect: Rect) -> bool {
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
        self.bands.iter().map(|band| bytes(band) as u64).sum()
    }
}

impl Rows {
    /// The pairs of a run of the sorted sequence, in its order, by band.
    fn expand(&self, batches: &[Projected], run: &[(u32, u32)], bands: usize) -> Vec<Pairs> {
        let mut pairs: Vec<Pairs> = (0..bands).map(|_| Pairs::default()).collect();
        let mut push = |row: u32, span: Span, primitive: u32| {
            let row = row.wrapping_sub(self.first) as usize;
            // Rows without tiles may lie outside.
            if let Some(&(band, first)) = self.places.get(row) {
                let first = first + u32::from(span.first);
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
                        push(row, span, primitive);
                    }
                } else {
                    let others = &batches[locate(primitive).0].spans;
                    for (row, span) in reach.spans(others) {
                        push(row, span, primitive);
                    }
                }
            }
        }
        pairs
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
        self.pairs.resize((2 * self.pairs.len()).max(1024), [0; 2]);
    }

    fn written(&self) -> &[[u32; 2]] {
        &self.pairs[..self.len]
    }
}

impl Band {
    /// Counts, then places the pairs of a band of so many tiles, in their order.
    fn place(runs: &[&[[u32; 2]]], tiles: usize) -> Self {
        let pairs = || runs.iter().flat_map(|run| run.iter());
        let mut starts = vec![0u32; tiles + 1];
        pairs().for_each(|&[tile, _]| starts[tile as usize] += 1);
        let mut total = 0;
        for start in &mut starts {
            total += std::mem::replace(start, total);
        }
        let mut next = starts.clone();
        let mut primitives = vec![0; total as usize];
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
        let lists = TileLists::build(&[batch], &order, bounds, 2);
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
