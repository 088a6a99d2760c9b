//! Makes sure that tiles of attachments are there before anything is drawn to them, as far as they are needed.

use super::super::coverage::Coverage;
use super::super::tile::Tile;
use super::Renderer;
use crate::limits::TILE_SIZE;
use crate::state::Rect;
use crate::stats::counters::Counter;
use crate::stats::optimizations::Skip;

impl Renderer<'_, '_> {
    /// Makes sure that depth and stencil of a tile are there.
    pub(super) fn touch_tests(&mut self, tile: usize) {
        let (targets, layer) = (self.draw.targets, self.place.layer);
        if let Some(target) = targets
            .depth
            .filter(|_| !self.buffers.depth.is_touched(tile))
        {
            let tile = self.tile_of(tile);
            self.buffers.depth.touch(target, layer, &tile);
        }
        if let Some(target) = targets
            .stencil
            .filter(|_| !self.buffers.stencil.is_touched(tile))
        {
            let tile = self.tile_of(tile);
            self.buffers.stencil.touch(target, layer, &tile);
        }
    }

    /// Makes sure that a tile of the colours written is there.
    #[inline(always)]
    pub(super) fn touch_colors<const N: usize>(&mut self, tile: usize, coverage: &Coverage<N>) {
        for (index, output) in self.draw.colors.iter().enumerate() {
            let Some(output) = output else { continue };
            if self.buffers.color[index].is_touched(tile) {
                continue;
            }
            // What is overwritten as a whole need not be loaded or cleared.
            let state = &self.draw.draw.state;
            if self.draw.keeps_all
                && output.overwrites()
                && coverage.is_whole()
                && state.sample_mask & 15 == 15
                && self.draw.skips.has(Skip::OverwrittenTiles)
            {
                self.buffers.color[index].touch_unread(tile);
                self.counters.add(Counter::TilesOverwritten, 1);
            } else if let Some(target) = &self.draw.targets.color[index] {
                let tile = self.tile_of(tile);
                self.buffers.color[index].touch(target, self.place.layer, &tile);
            }
        }
    }

    /// A tile of the macro-tile.
    #[cold]
    fn tile_of(&self, index: usize) -> Tile {
        let side = self.place.size / TILE_SIZE;
        let [column, row] = self.place.at;
        let at = [
            column * side + index as u32 % side,
            row * side + index as u32 / side,
        ];
        let whole = Rect {
            x: (at[0] * TILE_SIZE) as i32,
            y: (at[1] * TILE_SIZE) as i32,
            width: TILE_SIZE,
            height: TILE_SIZE,
        };
        Tile {
            index,
            at,
            pixels: whole.intersect(self.draw.area),
        }
    }

    /// Makes sure that a tile of the colours written is there, of which nothing will be left.
    pub(super) fn touch_unread(&mut self, tile: usize) {
        if !self.draw.skips.has(Skip::OverwrittenTiles) {
            return self.touch_read(tile);
        }
        for (index, output) in self.draw.colors.iter().enumerate() {
            if output.is_some() && !self.buffers.color[index].is_touched(tile) {
                self.buffers.color[index].touch_unread(tile);
                self.counters.add(Counter::TilesOverwritten, 1);
            }
        }
    }

    /// Makes sure that a tile of the colours written is there, with what it holds.
    pub(super) fn touch_read(&mut self, tile: usize) {
        for (index, output) in self.draw.colors.iter().enumerate() {
            if output.is_some()
                && !self.buffers.color[index].is_touched(tile)
                && let Some(target) = &self.draw.targets.color[index]
            {
                let tile = self.tile_of(tile);
                self.buffers.color[index].touch(target, self.place.layer, &tile);
            }
        }
    }
}
