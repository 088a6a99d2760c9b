//! Tiles that a primitive covers as a whole and that wait to be shaded, since a later primitive of the draw may overwrite
//! them: then the earlier one is never shaded there.

use super::setup::Setup;
use crate::limits::{MAX_MACRO_TILE_SIZE, TILE_SIZE};

/// Tiles of the largest macro-tile.
const MAX_TILES: usize = (MAX_MACRO_TILE_SIZE / TILE_SIZE).pow(2) as usize;

/// A primitive that tiles wait for.
#[derive(Debug)]
pub struct Kept {
    pub setup: Setup,
    /// Its chunk among the draw's, and its place there.
    pub chunk: usize,
    pub primitive: u32,
    /// How many tiles wait for it.
    tiles: u32,
}

/// The tiles of a macro-tile that wait.
#[derive(Debug)]
pub struct Pending {
    /// Which of `kept` each waits for.
    tiles: [Option<u8>; MAX_TILES],
    /// As many as there are tiles, at most, since those that no tile waits for are replaced.
    kept: Vec<Kept>,
}

impl Default for Pending {
    fn default() -> Self {
        Self {
            tiles: [None; MAX_TILES],
            kept: Vec::new(),
        }
    }
}

impl Pending {
    /// Forgets everything.
    pub fn clear(&mut self) {
        self.tiles = [None; MAX_TILES];
        self.kept.clear();
    }

    /// Keeps a primitive, for which [`Pending::cover`] must be called next; returns where.
    #[cold]
    pub fn keep(&mut self, setup: &Setup, chunk: usize, primitive: u32) -> u8 {
        let kept = Kept {
            setup: setup.clone(),
            chunk,
            primitive,
            tiles: 0,
        };
        let slot = match self.kept.iter().position(|kept| kept.tiles == 0) {
            Some(slot) => {
                self.kept[slot] = kept;
                slot
            }
            None => {
                self.kept.push(kept);
                self.kept.len() - 1
            }
        };
        slot as u8
    }

    /// Lets a tile wait for the primitive at a place. Returns whether it waited for another.
    pub fn cover(&mut self, tile: usize, slot: u8) -> bool {
        self.kept[usize::from(slot)].tiles += 1;
        let before = self.tiles[tile].replace(slot);
        if let Some(before) = before {
            self.kept[usize::from(before)].tiles -= 1;
        }
        before.is_some()
    }

    /// Whether a tile waits.
    pub fn waits(&self, tile: usize) -> bool {
        self.tiles[tile].is_some()
    }

    /// The primitive that a tile waited for, if any: it waits no more.
    pub fn take(&mut self, tile: usize) -> Option<&Kept> {
        let slot = usize::from(self.tiles[tile].take()?);
        self.kept[slot].tiles -= 1;
        Some(&self.kept[slot])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_primitive_is_what_a_tile_waits_for() {
        let mut pending = Pending::default();
        let setup = Setup::default();
        for round in 0..1000u32 {
            // Each primitive covers a few tiles, of which later ones take some.
            let slot = pending.keep(&setup, 0, round);
            for tile in 0..5 {
                let tile = (round as usize * 7 + tile * 3) % MAX_TILES;
                pending.cover(tile, slot);
            }
            assert!(pending.kept.len() <= MAX_TILES);
        }
        let mut newest = [None; MAX_TILES];
        for round in 0..1000u32 {
            for tile in 0..5 {
                newest[(round as usize * 7 + tile * 3) % MAX_TILES] = Some(round);
            }
        }
        for (tile, newest) in newest.into_iter().enumerate() {
            assert_eq!(pending.waits(tile), newest.is_some());
            assert_eq!(pending.take(tile).map(|kept| kept.primitive), newest);
            assert!(pending.take(tile).is_none());
        }
        assert!(pending.kept.iter().all(|kept| kept.tiles == 0));
    }
}
