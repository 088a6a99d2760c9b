//! Binning: depth-sorted primitives to lists per tile.
//!
//! Sorting comes first, and placement is stable, so that every list is in depth order without a sort of its
//! own. Workers take runs of the sorted sequence and write down which tiles of a row each primitive reaches, apart for
//! each band of rows of tiles; then workers take bands, count and place. What primitives reach differs in ways that no
//! branch foresees, so that what is small is written and placed without any.
//!
//! Where lists would outgrow their budget, as those of a million Gaussians that fill a large screen do, there are none:
//! each tile then walks the sorted sequence itself, a piece at a time, until it is saturated.

use super::footprint::{HELD_ROWS, TileFootprint, TileSpan};
use super::splat::{ProjectedGroup, locate};
use crate::limits::TILE_SIZE;
use crate::simd::three;
use crate::state::Rect;
use devmem::host;
use rayon::prelude::*;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

/// The lists of some rows of tiles.
#[derive(Debug, Default)]
struct RowBand {
    /// Where each tile's list begins, row by row.
    starts: Vec<u32>,
    /// Where it ends: there is room for one more behind it.
    ends: Vec<u32>,
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
    bands: Vec<RowBand>,
    /// What there is instead of lists.
    walk: Option<SortedWalk>,
}

/// A primitive and what it reaches.
type Reaching = (u32, TileFootprint);

/// The survivors in depth order, for tiles to find theirs among them.
#[derive(Debug)]
pub(crate) struct SortedWalk {
    sorted: Vec<Reaching>,
    /// Of each group.
    spans: Vec<Vec<TileSpan>>,
    pairs: u64,
}

impl SortedWalk {
    fn new(groups: &mut [ProjectedGroup], order: &[(u32, u32)]) -> Self {
        let mut sorted: Vec<Reaching> = host::with_capacity(order.len());
        let seen = &*groups;
        // It writes to the room that there is.
        order
            .par_iter()
            .with_min_len(RUN)
            .map(|&(_, primitive)| {
                let (group, place) = locate(primitive);
                (primitive, seen[group].reaches[place])
            })
            .collect_into_vec(&mut sorted);
        let taken = groups
            .iter_mut()
            .map(|group| std::mem::take(&mut group.spans));
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

/// What groups reach, close together.
struct Groups<'a> {
    reaches: Vec<&'a [TileFootprint]>,
    spans: Vec<&'a [TileSpan]>,
}

/// The rows of tiles that a draw may touch.
struct Rows {
    first: u32,
    /// Of each row: its band, and the number that its first tile has there. One more is for all others.
    places: Vec<(u32, u32)>,
}

/// Tiles that follow one another in a row of a band, and a primitive that reaches them: the first one's number and, from
/// bit [`COUNT_AT`] on, how many; then the primitive.
type TileRun = [u32; 2];

/// Bits of a tile's number in its band.
const COUNT_AT: u32 = 22;

/// The most tiles of a band.
const MAX_TILES: u32 = 1 << COUNT_AT;

/// The most tiles of a strip.
const MAX_COUNT: u32 = (1 << (32 - COUNT_AT)) - 1;

/// TileRuns of a band in the order of primitives. There is room behind them.
#[derive(Debug)]
struct TileRuns {
    strips: Vec<TileRun>,
    len: usize,
}

/// Primitives whose reaches are fetched ahead, and whose pairs are counted before the budget is looked at.
const GATHERED: usize = 64;

/// TileRuns that there is room for in the beginning, for each primitive: most have one or two.
const STRIPS_PER_PRIMITIVE: usize = 2;

/// Primitives that a worker brings into order at a time.
const RUN: usize = 4096;

impl TileLists {
    /// Places the survivors named by `order`, in that order, in the lists of the tiles they reach, unless those had more
    /// than `most_pairs` entries together.
    pub(crate) fn build(
        groups: &mut [ProjectedGroup],
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
                walk: None,
            };
        }
        // Visible pixels have coordinates from zero on: the render area lies inside its attachments.
        let tile = |pixel: i64| (pixel.max(0) / i64::from(TILE_SIZE)) as u32;
        let first_row = tile(bounds.y.into());
        let rows = tile(i64::from(bounds.y) + i64::from(bounds.height) - 1) - first_row + 1;
        let columns = tile(i64::from(bounds.x) + i64::from(bounds.width) - 1) + 1;
        let threads = threads.max(1);
        let band_rows = rows
            .div_ceil(threads as u32)
            .min((MAX_TILES / columns).max(1));
        let bands = rows.div_ceil(band_rows) as usize;
        let places = |row: u32| (row / band_rows, row % band_rows * columns);
        let grid = Rows {
            first: first_row,
            places: host::collect((0..rows).map(places).chain([(bands as u32 - 1, 0)])),
        };
        let pairs = AtomicU64::new(0);
        let allow = |more: u64| pairs.fetch_add(more, Relaxed) + more <= most_pairs;
        let seen = Groups {
            reaches: host::collect(groups.iter().map(|group| &*group.reaches)),
            spans: host::collect(groups.iter().map(|group| &*group.spans)),
        };
        let runs: Option<Vec<Vec<TileRuns>>> = order
            .par_chunks(order.len().div_ceil(threads))
            .map(|run| grid.expand(&seen, run, bands, allow))
            .collect();
        let Some(runs) = runs else {
            return Self {
                first_row,
                columns,
                band_rows,
                bands: Vec::new(),
                walk: Some(SortedWalk::new(groups, order)),
            };
        };
        let bands = (0..bands)
            .into_par_iter()
            .map(|band| {
                let written = runs.iter().map(|run| run[band].written());
                RowBand::place(&host::collect(written), (band_rows * columns) as usize)
            })
            .collect();
        Self {
            first_row,
            columns,
            band_rows,
            bands,
            walk: None,
        }
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
        if tile_x < self.columns {
            of().unwrap_or_default()
        } else {
            &[]
        }
    }

    /// What there is instead of lists, if those are too long.
    pub(crate) fn walk(&self) -> Option<&SortedWalk> {
        self.walk.as_ref()
    }

    /// How many pairs of tile and primitive there are.
    pub(crate) fn pairs(&self) -> u64 {
        // Each list has room for one more.
        let pairs = |band: &RowBand| (band.primitives.len() - band.starts.len()) as u64;
        let streamed = self.walk.as_ref().map_or(0, |stream| stream.pairs);
        self.bands.iter().map(pairs).sum::<u64>() + streamed
    }

    /// Whether a tile that shares pixels with `rect` has a primitive, or may have one.
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
        tiles(rect.y, rect.height)
            .any(|y| tiles(rect.x, rect.width).any(|x| !self.list(x, y).is_empty()))
    }

    /// Bytes of host memory that the lists take.
    pub(crate) fn memory_bytes(&self) -> u64 {
        let bytes =
            |band: &RowBand| 2 * size_of_val(&*band.starts) + size_of_val(&*band.primitives);
        let lists = self.bands.iter().map(|band| bytes(band) as u64);
        lists.sum::<u64>() + self.walk.as_ref().map_or(0, SortedWalk::memory_bytes)
    }
}

impl Rows {
    /// The strips of a run of the sorted sequence, in its order, by band.
    /// `None` once the budget does not `allow` for so many more.
    fn expand(
        &self,
        groups: &Groups<'_>,
        run: &[(u32, u32)],
        bands: usize,
        allow: impl Fn(u64) -> bool,
    ) -> Option<Vec<TileRuns>> {
        let about = run.len() * STRIPS_PER_PRIMITIVE / bands;
        let mut strips = host::collect((0..bands).map(|_| TileRuns::with_room(about)));
        let others = self.places.len() - 1;
        let strip = |(row, span): (u32, TileSpan)| {
            // Rows without tiles may lie outside.
            let row = (row.wrapping_sub(self.first) as usize).min(others);
            let (band, first) = self.places[row];
            let first = first + u32::from(span.first);
            (band as usize, first, span.len() as u32)
        };
        let reach_of = |&(_, primitive): &(u32, u32)| {
            let (group, place) = locate(primitive);
            &groups.reaches[group][place]
        };
        let mut ahead = run.chunks(GATHERED).skip(1);
        for some in run.chunks(GATHERED) {
            // They lie anywhere, so that each would be waited for.
            for next in ahead.next().unwrap_or_default() {
                devmem::prefetch(std::slice::from_ref(reach_of(next)));
            }
            let mut count = 0;
            for named in some {
                let (reach, &(_, primitive)) = (reach_of(named), named);
                if let Some(rows) = reach.held() {
                    let [one, two, three] = three(rows, strip);
                    count += u64::from(one.2 + two.2 + three.2);
                    if one.0 == three.0 && one.2.max(two.2).max(three.2) <= MAX_COUNT {
                        let of = [(one.1, one.2), (two.1, two.2), (three.1, three.2)];
                        strips[one.0].push_small(of, primitive);
                        continue;
                    }
                    for (band, first, tiles) in [one, two, three] {
                        strips[band].push(first, tiles, primitive);
                    }
                } else {
                    let others = groups.spans[locate(primitive).0];
                    for (band, first, tiles) in reach.spans(others).map(strip) {
                        count += u64::from(tiles);
                        strips[band].push(first, tiles, primitive);
                    }
                }
            }
            if !allow(count) {
                return None;
            }
        }
        Some(strips)
    }
}

impl TileRuns {
    /// None yet, with room for about so many.
    fn with_room(count: usize) -> Self {
        Self {
            strips: host::filled([0; 2], count.max(1024)),
            len: 0,
        }
    }

    /// Adds what a primitive reaches in three rows: the first tile of each and how many, at most [`MAX_COUNT`].
    #[inline(always)]
    fn push_small(&mut self, rows: [(u32, u32); HELD_ROWS], primitive: u32) {
        if self.strips.len() < self.len + HELD_ROWS {
            self.grow();
        }
        let room = &mut self.strips[self.len..self.len + HELD_ROWS];
        let mut len = 0;
        for (first, count) in rows {
            // What has no tiles is written over.
            room[len] = [first | count << COUNT_AT, primitive];
            len += usize::from(count > 0);
        }
        self.len += len;
    }

    /// Adds a primitive and `count` tiles from `first` on.
    fn push(&mut self, mut first: u32, mut count: u32, primitive: u32) {
        while count > 0 {
            if self.len == self.strips.len() {
                self.grow();
            }
            let some = count.min(MAX_COUNT);
            self.strips[self.len] = [first | some << COUNT_AT, primitive];
            self.len += 1;
            first += some;
            count -= some;
        }
    }

    #[cold]
    fn grow(&mut self) {
        let len = 2 * self.strips.len();
        host::resize(&mut self.strips, len, [0; 2]);
    }

    fn written(&self) -> &[TileRun] {
        &self.strips[..self.len]
    }
}

impl RowBand {
    /// Counts, then places the strips of a band of so many tiles, in their order.
    fn place(runs: &[&[TileRun]], tiles: usize) -> Self {
        let parts = |[tile, primitive]: TileRun| {
            let first = tile & ((1 << COUNT_AT) - 1);
            (first as usize, tile >> COUNT_AT, primitive)
        };
        // Changes of the count from tile to tile.
        let mut starts: Vec<u32> = host::zeroed(tiles + 1);
        for &strip in runs.iter().copied().flatten() {
            let (first, count, _) = parts(strip);
            let end = first + count as usize;
            starts[first] = starts[first].wrapping_add(1);
            starts[end] = starts[end].wrapping_sub(1);
        }
        let (mut total, mut count) = (0, 0u32);
        for start in &mut starts {
            count = count.wrapping_add(*start);
            *start = total;
            // Room for one more.
            total += count + 1;
        }
        let mut ends = host::copied(&starts);
        let mut primitives: Vec<u32> = host::zeroed(total as usize);
        for &strip in runs.iter().copied().flatten() {
            let (first, count, primitive) = parts(strip);
            // Most have one tile or two, which no branch foresees: what is not wanted is written over.
            let mut put = |tile: usize, wanted: bool| {
                let end = ends[tile];
                primitives[end as usize] = primitive;
                ends[tile] = end + u32::from(wanted);
            };
            put(first, true);
            put(first + 1, count > 1);
            for tile in 2..count as usize {
                put(first + tile, true);
            }
        }
        Self {
            starts,
            ends,
            primitives,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn lists_are_what_the_spans_say(
            // Wide enough for spans of more than one strip.
            columns in prop_oneof![1..8u16, 1000..2100u16],
            first_row in 0..3u16,
            rows in 1..9u16,
            reached in prop::collection::vec((0..9u16, prop::collection::vec((0..2100u16, 0..2100u16), 0..6)), 1..80),
            threads in 1..5usize,
        ) {
            // Clipped to the tiles that there are.
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

    #[test]
    fn lists_keep_the_sorted_order() {
        let mut group = ProjectedGroup::default();
        for (row, spans) in [
            (1, &[(0, 2)][..]),
            (1, &[(1, 2), (0, 3), (0, 0), (0, 0), (0, 0)]),
            (1, &[(0, 1)]),
        ] {
            let mut reach = TileFootprint::new(row, spans.len() as u16, &mut group.spans);
            for (number, &(first, end)) in (0..).zip(spans) {
                reach.set(&mut group.spans, number, TileSpan { first, end });
            }
            group.reaches.push(reach);
        }
        let order = [(5, 2), (6, 0), (7, 1)];
        let bounds = Rect {
            x: 0,
            y: 16,
            width: 40,
            height: 32,
        };
        let lists = TileLists::build(&mut [group], &order, bounds, 2, u64::MAX);
        assert_eq!(lists.list(0, 1), [2, 0]);
        assert_eq!(lists.list(1, 1), [0, 1]);
        assert_eq!(lists.list(2, 1), [0; 0]);
        assert_eq!(lists.list(2, 2), [1]);
        assert_eq!(
            lists.list(0, 0),
            [0; 0],
            "outside the bounds there is nothing"
        );
        assert_eq!(lists.list(9, 9), [0; 0]);
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
