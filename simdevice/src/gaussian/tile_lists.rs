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

use super::footprint::{FIRST_TILE_BITS, HELD_ROWS, PackedSpan, TileFootprint, TileSpan};
use super::splat::{ProjectedGroup, locate};
use crate::limits::TILE_SIZE;
use crate::state::Rect;
use devmem::host;
use rayon::prelude::*;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

/// The lists of a band, which is some rows of tiles.
#[derive(Debug, Default)]
struct RowBand {
    /// The index of the first entry of each tile's list, row by row.
    starts: Vec<u32>,
    /// The index one past the last entry of each tile's list. One more entry after it is unused.
    ends: Vec<u32>,
    primitives: Vec<u32>,
}

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

/// A primitive and its footprint.
type Reaching = (u32, TileFootprint);

/// The primitives in depth order with their footprints. Each tile searches them for its own.
#[derive(Debug)]
pub(crate) struct SortedWalk {
    sorted: Vec<Reaching>,
    /// The spans of each group's footprints.
    spans: Vec<Vec<TileSpan>>,
    pairs: u64,
}

impl SortedWalk {
    fn new(groups: &mut [ProjectedGroup], order: &[(u32, u32)]) -> Self {
        let mut sorted: Vec<Reaching> = host::with_capacity(order.len());
        let seen = &*groups;
        // It writes into the reserved capacity.
        order
            .par_iter()
            .with_min_len(RUN)
            .map(|&(_, primitive)| {
                let (group, place) = locate(primitive);
                (primitive, seen[group].reaches[place])
            })
            .collect_into_vec(&mut sorted);
        let taken = groups.iter_mut().map(|group| std::mem::take(&mut group.spans));
        let spans = host::collect(taken);
        let tiles = |(primitive, reach): &Reaching| {
            let spans = reach.spans(&spans[locate(*primitive).0]);
            let lengths = spans.map(|(_, span)| u64::from(span.end - span.first));
            lengths.sum::<u64>()
        };
        Self { pairs: sorted.par_iter().with_min_len(RUN).map(tiles).sum(), sorted, spans }
    }

    /// Replaces `list` by the next primitives of a tile, at most `most`, from index `from` of the sequence on, and
    /// advances `from`. `list` is empty if there are no more.
    pub(crate) fn next(&self, [x, y]: [u32; 2], from: &mut usize, most: usize, list: &mut Vec<u32>) {
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

/// The footprints of each group, and their spans.
struct Groups<'a> {
    reaches: Vec<&'a [TileFootprint]>,
    spans: Vec<&'a [TileSpan]>,
}

/// The rows of tiles that a draw may touch.
struct Rows {
    first: u32,
    /// The band of each row, and the number in the band of the row's first tile. One more element stands for all other
    /// rows.
    places: Vec<(u32, u32)>,
    /// The number of tiles in a row.
    columns: u32,
}

/// Consecutive tiles of a row, and a primitive that reaches them.
#[derive(Clone, Copy, Debug, Default)]
struct TileRun {
    /// Tiles by their number in the band.
    tiles: PackedSpan,
    primitive: u32,
}

/// The most tiles of a band: their numbers fit into a [`PackedSpan`].
const MOST_BAND_TILES: u32 = 1 << FIRST_TILE_BITS;

impl TileRun {
    /// The run of a span in the row whose first tile has number `row_start` in the band.
    #[inline(always)]
    fn new(row_start: u32, span: PackedSpan, primitive: u32) -> Self {
        Self { tiles: span.moved_by(row_start), primitive }
    }

    /// The number in the band of its first tile, and that after its last.
    #[inline(always)]
    fn tiles(self) -> [usize; 2] {
        self.tiles.tiles().map(|tile| tile as usize)
    }
}

/// The most runs that wait before they are appended to the others of their band.
const WAITING: usize = 256;

/// The runs of a band in the order of primitives.
#[derive(Debug)]
struct TileRuns {
    runs: Vec<TileRun>,
    /// The last runs. Elements from `len` on are unused.
    waiting: Box<[TileRun; WAITING]>,
    len: usize,
}

/// The number of primitives whose footprints are prefetched, and whose runs are counted before the budget is checked
/// again.
const GATHERED: usize = 64;

/// The initial capacity in runs per primitive. Most primitives have one or two.
const RUNS_PER_PRIMITIVE: usize = 2;

/// The least number of primitives per task in gathering the sorted sequence.
const RUN: usize = 4096;

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
        let places = |row: u32| (row / band_rows, row % band_rows * columns);
        let grid = Rows {
            first: first_row,
            places: host::collect((0..rows).map(places).chain([(bands as u32 - 1, 0)])),
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

impl Rows {
    /// The runs of a part of the sorted sequence, in its order, by band. `None` as soon as `allow` refuses the number
    /// of runs that were added last.
    fn expand(
        &self,
        groups: &Groups<'_>,
        part: &[(u32, u32)],
        bands: usize,
        allow: impl Fn(u64) -> bool,
    ) -> Option<Vec<TileRuns>> {
        let about = part.len() * RUNS_PER_PRIMITIVE / bands;
        let mut runs = host::collect((0..bands).map(|_| TileRuns::with_room(about)));
        let reach_of = |&(_, primitive): &(u32, u32)| {
            let (group, place) = locate(primitive);
            &groups.reaches[group][place]
        };
        let Some(first) = part.first() else {
            return Some(runs);
        };
        let mut ahead = [reach_of(first); GATHERED];
        let mut next = part.chunks(GATHERED);
        // Footprints are scattered in memory, so they are prefetched.
        let mut fetch = |ahead: &mut [_; GATHERED]| {
            for (reach, named) in ahead.iter_mut().zip(next.next().unwrap_or_default()) {
                *reach = reach_of(named);
                devmem::prefetch(std::slice::from_ref(*reach));
            }
        };
        fetch(&mut ahead);
        for some in part.chunks(GATHERED) {
            let reaches = ahead;
            fetch(&mut ahead);
            let before = written(&runs);
            if let [runs] = &mut *runs {
                self.expand_to_one(groups, some, &reaches, runs);
            } else {
                self.expand_to_bands(groups, some, &reaches, &mut runs);
            }
            if !allow((written(&runs) - before) as u64) {
                return None;
            }
        }
        runs.iter_mut().for_each(TileRuns::settle);
        Some(runs)
    }

    /// Adds the runs of `some` primitives, whose footprints are `reaches`, to those of the only band.
    #[inline(always)]
    fn expand_to_one(
        &self,
        groups: &Groups<'_>,
        some: &[(u32, u32)],
        reaches: &[&TileFootprint; GATHERED],
        runs: &mut TileRuns,
    ) {
        // Inline rows without tiles may lie outside of the bounds.
        let row_start = |row: u32| row.wrapping_sub(self.first).wrapping_mul(self.columns);
        for (&(_, primitive), reach) in some.iter().zip(reaches) {
            if let Some((row, spans)) = reach.held() {
                runs.push_rows(row_start(row), spans, self.columns, primitive);
            } else {
                let others = groups.spans[locate(primitive).0];
                for (row, span) in reach.spans(others) {
                    runs.push(row_start(row), span, primitive);
                }
            }
        }
    }

    /// Adds the runs of `some` primitives, whose footprints are `reaches`, to those of their bands.
    fn expand_to_bands(
        &self,
        groups: &Groups<'_>,
        some: &[(u32, u32)],
        reaches: &[&TileFootprint; GATHERED],
        runs: &mut [TileRuns],
    ) {
        let others = self.places.len() - 1;
        // Inline rows without tiles may lie outside of the bounds.
        let place = |row: u32| self.places[(row.wrapping_sub(self.first) as usize).min(others)];
        for (&(_, primitive), reach) in some.iter().zip(reaches) {
            if let Some((row, spans)) = reach.held() {
                let (band, row_start) = place(row);
                if band == place(row + HELD_ROWS as u32 - 1).0 {
                    let runs = &mut runs[band as usize];
                    runs.push_rows(row_start, spans, self.columns, primitive);
                    continue;
                }
            }
            let others = groups.spans[locate(primitive).0];
            for (row, span) in reach.spans(others) {
                let (band, row_start) = place(row);
                runs[band as usize].push(row_start, span, primitive);
            }
        }
    }
}

/// The number of runs that are written in all bands.
fn written(runs: &[TileRuns]) -> usize {
    runs.iter().map(|runs| runs.runs.len() + runs.len).sum()
}

impl TileRuns {
    /// Makes an empty list with capacity for about `count` runs.
    fn with_room(count: usize) -> Self {
        Self { runs: host::with_capacity(count), waiting: Box::new([TileRun::default(); WAITING]), len: 0 }
    }

    /// Adds a run of `primitive` for each row that has tiles. The first tile of the first row has number `row_start`,
    /// and a row has `columns` tiles.
    #[inline(always)]
    fn push_rows(&mut self, mut row_start: u32, spans: [PackedSpan; HELD_ROWS], columns: u32, primitive: u32) {
        if self.len > WAITING - HELD_ROWS {
            self.settle();
        }
        let room = &mut self.waiting[self.len..self.len + HELD_ROWS];
        let mut len = 0;
        for span in spans {
            // A run without tiles is overwritten by the next.
            room[len] = TileRun::new(row_start, span, primitive);
            len += usize::from(!span.is_empty());
            row_start = row_start.wrapping_add(columns);
        }
        self.len += len;
    }

    /// Adds the run of a span, if it has tiles. The first tile of its row has number `row_start`.
    fn push(&mut self, row_start: u32, span: TileSpan, primitive: u32) {
        if span.len() == 0 {
            return;
        }
        if self.len == WAITING {
            self.settle();
        }
        self.waiting[self.len] = TileRun::new(row_start, span.into(), primitive);
        self.len += 1;
    }

    /// Appends the waiting runs to the others.
    #[inline(never)]
    fn settle(&mut self) {
        host::extend(&mut self.runs, &self.waiting[..self.len]);
        self.len = 0;
    }

    /// The runs that do not wait.
    fn settled(&self) -> &[TileRun] {
        &self.runs
    }
}

/// The positions of the lists of a band's tiles.
struct TileCounts {
    /// The index of each tile's first entry, and the end of all. Each list has one unused entry.
    starts: Vec<u32>,
    pairs: u64,
}

impl TileCounts {
    /// The counts of a band of `tiles` tiles, from its runs.
    fn new(runs: &[&[TileRun]], tiles: usize) -> Self {
        // First, the change of the count from each tile to the next.
        let mut starts: Vec<u32> = host::zeroed(tiles + 1);
        for runs in runs {
            for &run in *runs {
                let [first, end] = run.tiles();
                starts[first] = starts[first].wrapping_add(1);
                starts[end] = starts[end].wrapping_sub(1);
            }
        }
        let (mut pairs, mut count) = (0, 0u32);
        for (number, start) in starts.iter_mut().enumerate() {
            count = count.wrapping_add(*start);
            // If it does not fit, there are too many pairs.
            *start = (pairs + number as u64) as u32;
            pairs += u64::from(count);
        }
        Self { starts, pairs }
    }
}

impl RowBand {
    /// Places the runs of a band, in their order.
    fn place(runs: &[&[TileRun]], counts: TileCounts) -> Self {
        let TileCounts { starts, pairs } = counts;
        let mut ends = host::copied(&starts);
        let mut primitives: Vec<u32> = host::zeroed(pairs as usize + starts.len());
        for runs in runs {
            for &run in *runs {
                let [first, end] = run.tiles();
                let count = run.tiles.len();
                // Most runs have one tile or two, which is hard to predict. An unwanted entry is overwritten by the
                // next.
                let mut put = |tile: usize, wanted: bool| {
                    let end = ends[tile];
                    primitives[end as usize] = run.primitive;
                    ends[tile] = end + u32::from(wanted);
                };
                put(first, true);
                put(first + 1, count > 1);
                if count > 2 {
                    (first + 2..end).for_each(|tile| put(tile, true));
                }
            }
        }
        Self { starts, ends, primitives }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
