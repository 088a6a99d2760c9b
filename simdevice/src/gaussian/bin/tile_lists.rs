//! Tile lists: bins depth-sorted primitives to a list per tile.
//!
//! Sorting comes first, and placement is stable, so that every list is in depth order without a sort of its own. First,
//! workers take parts of the sorted sequence and write the runs of tiles that each primitive reaches, separately for
//! each band of rows of tiles. Then workers take bands, count the entries of each tile, and place them. The number of
//! tiles of a primitive is hard to predict for the processor, so that small primitives are written and placed without
//! branches.
//!
//! If the lists would exceed their budget, as those of a million Gaussians that fill a large screen do, none are made:
//! each tile then searches the sorted sequence itself, a piece at a time, until it is saturated.

use super::row_band::{RowBand, TileCounts};
use super::sorted_walk::SortedWalk;
use super::tile_runs::{Groups, MOST_BAND_TILES, RowPlace, Rows, TileRuns};
use crate::gaussian::splats::group::ProjectedGroup;
use crate::limits::TILE_SIZE;
use crate::state::Rect;
use devmem::host;
use rayon::prelude::*;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

/// Lists of primitives by tile, each in the order of the sorted sequence.
#[derive(Debug)]
pub(crate) struct TileLists {
    /// The first row of tiles that the bounds touch.
    first_row: u32,
    /// The number of tiles in a row.
    columns: u32,
    /// The number of rows in a band. The last band may have fewer.
    band_rows: u32,
    bands: Vec<RowBand>,
    /// The sorted sequence, if there are no lists.
    walk: Option<SortedWalk>,
}

impl TileLists {
    /// Places the primitives of `order`, in that order, in the lists of the tiles that they reach. If the lists had
    /// more than `most_pairs` entries in total, none are made, and tiles search the sorted sequence.
    pub(crate) fn build(
        groups: &mut [ProjectedGroup],
        order: &[(u32, u32)],
        bounds: Rect,
        threads: usize,
        most_pairs: u64,
    ) -> Self {
        if bounds.is_empty() || order.is_empty() {
            return Self { first_row: 0, columns: 0, band_rows: 1, bands: Vec::new(), walk: None };
        }
        // Visible pixels have coordinates from zero on: the render area lies inside its attachments.
        let tile = |pixel: i64| (pixel.max(0) / i64::from(TILE_SIZE)) as u32;
        let first_row = tile(bounds.y.into());
        let rows = tile(i64::from(bounds.y) + i64::from(bounds.height) - 1) - first_row + 1;
        let columns = tile(i64::from(bounds.x) + i64::from(bounds.width) - 1) + 1;
        let threads = threads.max(1);
        let most_rows = (MOST_BAND_TILES / columns).max(1);
        let band_rows = rows.div_ceil(threads as u32).min(most_rows);
        let bands = rows.div_ceil(band_rows) as usize;
        let place = |row: u32| RowPlace { band: row / band_rows, first_tile: row % band_rows * columns };
        let grid = Rows {
            first: first_row,
            places: host::collect((0..rows).map(place).chain([RowPlace { band: bands as u32 - 1, first_tile: 0 }])),
            columns,
        };
        // Each run has at least one pair.
        let written = AtomicU64::new(0);
        let allow = |more: u64| written.fetch_add(more, Relaxed) + more <= most_pairs;
        let seen = Groups {
            reaches: host::collect(groups.iter().map(|group| &*group.reaches)),
            spans: host::collect(groups.iter().map(|group| &*group.spans)),
        };
        let runs: Option<Vec<Vec<TileRuns>>> =
            order.par_chunks(order.len().div_ceil(threads)).map(|run| grid.expand(&seen, run, bands, allow)).collect();
        let bands = runs.and_then(|runs| {
            let of_band = |band: usize| host::collect(runs.iter().map(|run| run[band].settled()));
            let tiles = (band_rows * columns) as usize;
            let counted: Vec<TileCounts> =
                (0..bands).into_par_iter().map(|band| TileCounts::new(&of_band(band), tiles)).collect();
            let pairs = counted.iter().map(|counts| counts.pairs).sum::<u64>();
            let place = |(band, counts)| RowBand::place(&of_band(band), counts);
            let place_all = || counted.into_par_iter().enumerate().map(place).collect();
            (pairs <= most_pairs).then(place_all)
        });
        let Some(bands) = bands else {
            return Self {
                first_row,
                columns,
                band_rows,
                bands: Vec::new(),
                walk: Some(SortedWalk::new(groups, order)),
            };
        };
        Self { first_row, columns, band_rows, bands, walk: None }
    }

    /// The primitives of a tile.
    pub(crate) fn list(&self, tile_x: u32, tile_y: u32) -> &[u32] {
        let of = || {
            let row = tile_y.checked_sub(self.first_row)?;
            let band = self.bands.get((row / self.band_rows) as usize)?;
            let tile = row % self.band_rows * self.columns + tile_x;
            let start = *band.starts.get(tile as usize)?;
            let end = *band.ends.get(tile as usize)?;
            band.primitives.get(start as usize..end as usize)
        };
        if tile_x < self.columns { of().unwrap_or_default() } else { &[] }
    }

    /// The sorted sequence that tiles search, if there are no lists.
    pub(crate) fn walk(&self) -> Option<&SortedWalk> {
        self.walk.as_ref()
    }

    /// The number of pairs of tile and primitive.
    pub(crate) fn pairs(&self) -> u64 {
        // Each list has one unused entry.
        let pairs = |band: &RowBand| (band.primitives.len() - band.starts.len()) as u64;
        let streamed = self.walk.as_ref().map_or(0, |stream| stream.pairs);
        self.bands.iter().map(pairs).sum::<u64>() + streamed
    }

    /// True if a tile that shares pixels with `rect` has a primitive, or may have one.
    pub(crate) fn any_in(&self, rect: Rect) -> bool {
        if self.walk.is_some() {
            return true;
        }
        let tiles = |start: i32, size: u32| {
            let start = i64::from(start).max(0);
            let end = (start + i64::from(size)).max(start + 1);
            let size = i64::from(TILE_SIZE);
            (start / size) as u32..=((end - 1) / size) as u32
        };
        tiles(rect.y, rect.height).any(|y| tiles(rect.x, rect.width).any(|x| !self.list(x, y).is_empty()))
    }

    /// The bytes of host memory that the lists take.
    pub(crate) fn memory_bytes(&self) -> u64 {
        let bytes = |band: &RowBand| 2 * size_of_val(&*band.starts) + size_of_val(&*band.primitives);
        let lists = self.bands.iter().map(|band| bytes(band) as u64);
        lists.sum::<u64>() + self.walk.as_ref().map_or(0, SortedWalk::memory_bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gaussian::splats::footprint::{TileFootprint, TileSpan};
    use proptest::prelude::*;

    proptest! {
        #[gaurast_runner::test]
        fn lists_are_what_the_spans_say(
            // Wide enough for spans of many columns.
            columns in prop_oneof![1..8u16, 1000..2100u16],
            first_row in 0..3u16,
            rows in 1..9u16,
            reached in prop::collection::vec((0..9u16, prop::collection::vec((0..2100u16, 0..2100u16), 0..6)), 1..80),
            threads in 1..5usize,
        ) {
            // Clipped to the grid of tiles.
            let clip = |&(first, len): &(u16, u16)| {
                let first = first.min(columns - 1);
                TileSpan { first, end: (first + len).min(columns) }
            };
            let mut group = ProjectedGroup::default();
            let mut expected = vec![Vec::new(); usize::from(rows) * usize::from(columns)];
            let mut pairs = 0;
            for (primitive, (row, spans)) in (0..).zip(&reached) {
                let row = (*row).min(rows - 1);
                let spans: Vec<TileSpan> = spans.iter().take((rows - row).into()).map(clip).collect();
                let mut reach = TileFootprint::new(first_row + row, spans.len() as u16, &mut group.spans);
                for (number, &span) in (0..).zip(&spans) {
                    reach.set(&mut group.spans, number, span);
                    for column in span.first..span.end {
                        let tile = usize::from(row + number) * usize::from(columns) + usize::from(column);
                        expected[tile].push(primitive);
                        pairs += 1;
                    }
                }
                group.reaches.push(reach);
            }
            let order: Vec<(u32, u32)> = (0..reached.len() as u32).map(|primitive| (7, primitive)).collect();
            let bounds = Rect {
                x: 0,
                y: i32::from(first_row) * 16,
                width: u32::from(columns) * 16 - 5,
                height: u32::from(rows) * 16 - 15,
            };
            let lists = TileLists::build(&mut [group], &order, bounds, threads, u64::MAX);
            prop_assert_eq!(lists.pairs(), pairs);
            for (tile, expected) in expected.iter().enumerate() {
                let (x, y) = (tile % usize::from(columns), tile / usize::from(columns));
                prop_assert_eq!(lists.list(x as u32, y as u32 + u32::from(first_row)), expected);
            }
        }
    }

    #[gaurast_runner::test]
    fn lists_keep_the_sorted_order() {
        let mut group = ProjectedGroup::default();
        for (row, spans) in [(1, &[(0, 2)][..]), (1, &[(1, 2), (0, 3), (0, 0), (0, 0), (0, 0)]), (1, &[(0, 1)])] {
            let mut reach = TileFootprint::new(row, spans.len() as u16, &mut group.spans);
            for (number, &(first, end)) in (0..).zip(spans) {
                reach.set(&mut group.spans, number, TileSpan { first, end });
            }
            group.reaches.push(reach);
        }
        let order = [(5, 2), (6, 0), (7, 1)];
        let bounds = Rect { x: 0, y: 16, width: 40, height: 32 };
        let lists = TileLists::build(&mut [group], &order, bounds, 2, u64::MAX);
        assert_eq!(lists.list(0, 1), [2, 0]);
        assert_eq!(lists.list(1, 1), [0, 1]);
        assert_eq!(lists.list(2, 1), [0; 0]);
        assert_eq!(lists.list(2, 2), [1]);
        assert_eq!(lists.list(0, 0), [0; 0], "outside the bounds there is nothing");
        assert_eq!(lists.list(9, 9), [0; 0]);
        assert_eq!(lists.pairs(), 7);
        assert!(lists.any_in(Rect { x: 33, y: 40, width: 1, height: 1 }));
        assert!(!lists.any_in(Rect { x: 33, y: 17, width: 9, height: 3 }));
    }
}
