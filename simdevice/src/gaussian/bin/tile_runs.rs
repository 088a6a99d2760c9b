//! Runs of tiles: the first step of binning. A part of the sorted sequence is expanded to the runs of tiles that its primitives
//! reach, separately for each band of rows of tiles.

use crate::gaussian::splats::footprint::{FIRST_TILE_BITS, HELD_ROWS, PackedSpan, TileFootprint, TileSpan};
use crate::gaussian::splats::splat::SplatIndex;
use devmem::host;

/// The footprints of each group, and their spans.
pub(crate) struct Groups<'a> {
    pub(super) reaches: Vec<&'a [TileFootprint]>,
    pub(super) spans: Vec<&'a [TileSpan]>,
}

/// The rows of tiles that a draw may touch.
pub(crate) struct Rows {
    pub(super) first: u32,
    /// The place of each row. One more element stands for all other rows.
    pub(super) places: Vec<RowPlace>,
    /// The number of tiles in a row.
    pub(super) columns: u32,
}

/// The place of a row of tiles in its band.
#[derive(Clone, Copy, Debug)]
pub(super) struct RowPlace {
    pub(super) band: u32,
    /// The number in the band of the row's first tile.
    pub(super) first_tile: u32,
}

/// Consecutive tiles of a row, and a primitive that reaches them.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TileRun {
    /// Tiles by their number in the band.
    pub(super) tiles: PackedSpan,
    pub(super) primitive: u32,
}

/// The most tiles of a band: their numbers fit into a [`PackedSpan`].
pub(crate) const MOST_BAND_TILES: u32 = 1 << FIRST_TILE_BITS;

impl TileRun {
    /// The run of a span in the row whose first tile has number `row_start` in the band.
    #[inline(always)]
    fn new(row_start: u32, span: PackedSpan, primitive: u32) -> Self {
        Self { tiles: span.moved_by(row_start), primitive }
    }

    /// The number in the band of its first tile, and that after its last.
    #[inline(always)]
    pub(super) fn tiles(self) -> [usize; 2] {
        self.tiles.tiles().map(|tile| tile as usize)
    }
}

/// The most runs that wait before they are appended to the others of their band.
const WAITING: usize = 256;

/// The runs of a band in the order of primitives.
#[derive(Debug)]
pub(crate) struct TileRuns {
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

impl Rows {
    /// The runs of a part of the sorted sequence, in its order, by band. `None` as soon as `allow` refuses the number
    /// of runs that were added last.
    pub(super) fn expand(
        &self,
        groups: &Groups<'_>,
        part: &[(u32, u32)],
        bands: usize,
        allow: impl Fn(u64) -> bool,
    ) -> Option<Vec<TileRuns>> {
        let about = part.len() * RUNS_PER_PRIMITIVE / bands;
        let mut runs = host::collect((0..bands).map(|_| TileRuns::with_capacity(about)));
        let reach_of = |&(_, primitive): &(u32, u32)| {
            let index = SplatIndex::new(primitive);
            &groups.reaches[index.group][index.place]
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
                let others = groups.spans[SplatIndex::new(primitive).group];
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
                let RowPlace { band, first_tile } = place(row);
                if band == place(row + HELD_ROWS as u32 - 1).band {
                    let runs = &mut runs[band as usize];
                    runs.push_rows(first_tile, spans, self.columns, primitive);
                    continue;
                }
            }
            let others = groups.spans[SplatIndex::new(primitive).group];
            for (row, span) in reach.spans(others) {
                let RowPlace { band, first_tile } = place(row);
                runs[band as usize].push(first_tile, span, primitive);
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
    fn with_capacity(count: usize) -> Self {
        Self { runs: host::with_capacity(count), waiting: Box::new([TileRun::default(); WAITING]), len: 0 }
    }

    /// Adds a run of `primitive` for each row that has tiles. The first tile of the first row has number `row_start`,
    /// and a row has `columns` tiles.
    #[inline(always)]
    fn push_rows(&mut self, mut row_start: u32, spans: [PackedSpan; HELD_ROWS], columns: u32, primitive: u32) {
        if self.len > WAITING - HELD_ROWS {
            self.settle();
        }
        let slots = &mut self.waiting[self.len..self.len + HELD_ROWS];
        let mut len = 0;
        for span in spans {
            // A run without tiles is overwritten by the next.
            slots[len] = TileRun::new(row_start, span, primitive);
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
    pub(super) fn settled(&self) -> &[TileRun] {
        &self.runs
    }
}
