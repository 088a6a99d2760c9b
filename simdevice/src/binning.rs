//! Binning: depth-sorted primitives to lists per tile.
//!
//! Sorting comes first, and placement is stable, so that every list is in depth order without a sort of its
//! own. Workers take runs of the sorted sequence and bucket what they reach by rows of tiles; then each row is
//! counted and placed by one worker, whose counters and lists stay in its cache.

use crate::gaussian::footprint::{Span, TILE_SIZE};
use crate::gaussian::locate;
use crate::gaussian::project::Projected;
use crate::packet::Rect;
use rayon::prelude::*;

/// A primitive's tiles in one row.
#[derive(Clone, Copy, Debug)]
struct RowEntry {
    primitive: u32,
    first: u16,
    end: u16,
}

/// The lists of one row of tiles.
#[derive(Debug, Default)]
struct Row {
    /// Where tile `x`'s list begins, for each tile of the row and one past.
    starts: Vec<u32>,
    primitives: Vec<u32>,
}

/// Lists of primitives by tile, each in the order of the sorted sequence.
#[derive(Debug)]
pub(crate) struct TileLists {
    /// The row of tiles that `rows[0]` is.
    first_row: u32,
    rows: Vec<Row>,
}

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
                rows: Vec::new(),
            };
        }
        // Visible pixels have coordinates from zero on: the render area lies inside its attachments.
        let tile = |pixel: i64| (pixel.max(0) / i64::from(TILE_SIZE)) as u32;
        let first_row = tile(bounds.y.into());
        let last_row = tile(i64::from(bounds.y) + i64::from(bounds.height) - 1);
        let columns = tile(i64::from(bounds.x) + i64::from(bounds.width) - 1) + 1;
        let row_count = (last_row - first_row + 1) as usize;

        // Several runs for each worker, so that one that is late does not keep the others waiting.
        let run = order.len().div_ceil(4 * threads.max(1)).max(1024);
        let runs: Vec<Vec<Vec<RowEntry>>> = order
            .par_chunks(run)
            .map(|names| {
                let mut rows = vec![Vec::with_capacity(2 * run / row_count); row_count];
                for &(_, primitive) in names {
                    let (batch, place) = locate(primitive);
                    for &Span { row, first, end } in batches[batch].spans_of(place) {
                        let row = (u32::from(row) - first_row) as usize;
                        rows[row].push(RowEntry {
                            primitive,
                            first,
                            end,
                        });
                    }
                }
                rows
            })
            .collect();
        let rows = (0..row_count)
            .into_par_iter()
            .map(|row| Row::place(columns, || runs.iter().flat_map(move |run| &run[row])))
            .collect();
        Self { first_row, rows }
    }

    /// The primitives of a tile.
    pub(crate) fn list(&self, tile_x: u32, tile_y: u32) -> &[u32] {
        let row = tile_y
            .checked_sub(self.first_row)
            .and_then(|row| self.rows.get(row as usize));
        row.and_then(|row| {
            let start = *row.starts.get(tile_x as usize)?;
            let end = *row.starts.get(tile_x as usize + 1)?;
            row.primitives.get(start as usize..end as usize)
        })
        .unwrap_or_default()
    }

    /// How many pairs of tile and primitive there are.
    pub(crate) fn pairs(&self) -> u64 {
        self.rows
            .iter()
            .map(|row| row.primitives.len() as u64)
            .sum()
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
        let bytes = |row: &Row| size_of_val(&*row.starts) + size_of_val(&*row.primitives);
        self.rows.iter().map(|row| bytes(row) as u64).sum()
    }
}

impl Row {
    /// Counts, then places what `entries` gives, in its order.
    fn place<'a, I: Iterator<Item = &'a RowEntry>>(columns: u32, entries: impl Fn() -> I) -> Self {
        let mut starts = vec![0u32; columns as usize + 1];
        for entry in entries() {
            for count in &mut starts[usize::from(entry.first)..usize::from(entry.end)] {
                *count += 1;
            }
        }
        let mut total = 0;
        for start in &mut starts {
            total += std::mem::replace(start, total);
        }
        let mut next = starts.clone();
        let mut primitives = vec![0; total as usize];
        for entry in entries() {
            for next in &mut next[usize::from(entry.first)..usize::from(entry.end)] {
                primitives[*next as usize] = entry.primitive;
                *next += 1;
            }
        }
        Self { starts, primitives }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_keep_the_sorted_order() {
        let mut batch = Projected::default();
        for tiles in [&[(1, 0, 2)][..], &[(1, 1, 2), (2, 0, 3)], &[(1, 0, 1)]] {
            let tiles = tiles.iter();
            batch
                .spans
                .extend(tiles.map(|&(row, first, end)| Span { row, first, end }));
            batch.span_ends.push(batch.spans.len() as u32);
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
