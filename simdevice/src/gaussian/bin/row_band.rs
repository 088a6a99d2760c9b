//! Bands of rows of tiles: the second step of binning. The entries of each tile of a band are counted, and then placed.

use super::tile_runs::TileRun;
use devmem::host;

/// The lists of a band, which is some rows of tiles.
#[derive(Debug, Default)]
pub(crate) struct RowBand {
    /// The index of the first entry of each tile's list, row by row.
    pub(super) starts: Vec<u32>,
    /// The index one past the last entry of each tile's list. One more entry after it is unused.
    pub(super) ends: Vec<u32>,
    pub(super) primitives: Vec<u32>,
}

/// The positions of the lists of a band's tiles.
pub(crate) struct TileCounts {
    /// The index of each tile's first entry, and the end of all. Each list has one unused entry.
    starts: Vec<u32>,
    pub(super) pairs: u64,
}

impl TileCounts {
    /// The counts of a band of `tiles` tiles, from its runs.
    pub(super) fn new(runs: &[&[TileRun]], tiles: usize) -> Self {
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
    pub(super) fn place(runs: &[&[TileRun]], counts: TileCounts) -> Self {
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
