//! Tiles of draws that have no lists, since those would be too long.

use super::{DepthMode, GaussianTile, Run, Skip, Task, TileMode, Work};
use crate::binning::Stream;
use crate::limits::TILE_SIZE;
use devmem::dispatch;
use fearless_simd::Level;

/// Primitives of a piece. The fast kernel goes on where it was, so that pieces change no bit.
const PIECE: usize = 1024;

impl GaussianTile {
    /// Composites what a tile finds in the sorted sequence, until nothing more can contribute.
    pub(super) fn composite_stream<const DEPTH: DepthMode>(
        &mut self,
        level: Level,
        task: &Task<'_>,
        stream: &Stream,
        layer: usize,
        mut runs: Option<&mut Vec<Run>>,
    ) -> Work {
        let most = match task.mode {
            TileMode::Fast => PIECE,
            // Others part or sort the whole list.
            _ => usize::MAX,
        };
        let tile = task.corner.map(|corner| corner / TILE_SIZE);
        let (mut work, mut from) = (Work::default(), 0);
        let mut piece = std::mem::take(&mut self.piece);
        loop {
            if task.skips.has(Skip::Saturated)
                && dispatch!(level, simd => self.layers[layer].open_blocks(simd, task.way.light))
                    == 0
            {
                break;
            }
            stream.next(tile, &mut from, most, &mut piece);
            if piece.is_empty() {
                break;
            }
            let task = Task {
                list: &piece,
                ..*task
            };
            let more = self.composite_list::<DEPTH>(level, &task, layer, runs.as_deref_mut());
            work.add(&more);
        }
        self.piece = piece;
        work
    }
}

impl Work {
    fn add(&mut self, more: &Self) {
        self.listed += more.listed;
        self.pairs += more.pairs;
        self.items += more.items;
        self.open += more.open;
        self.contributions += more.contributions;
        self.tiles_hidden += more.tiles_hidden;
        self.blocks_hidden += more.blocks_hidden;
        self.blocks_left_out += more.blocks_left_out;
        self.hidden_rest += more.hidden_rest;
    }
}
