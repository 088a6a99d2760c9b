//! Tiles that one primitive covers as a whole, in draws that test nothing after shading. They wait to be shaded where a
//! later primitive of the draw may overwrite them: then the earlier one is never shaded there. Where fragments take nothing
//! but varyings they are a batch that needs no list of quads.

use super::batch::{BlockValues, LANES, divided, varying};
use super::setup::{Needs, TriangleSetup};
use crate::limits::{MAX_MACRO_TILE_SIZE, TILE_SIZE};
use crate::program::interface::Interpolation;
use crate::raster::tile::{AREA, BLOCKS, block_corner};
use crate::simd::{bits_of, both, three};
use fearless_simd::{Simd, f32x16, prelude::*};
use isa::Vector;
use isa::machine::LaneMask;

// A tile fills the largest batch.
const _: () = assert!(AREA == LANES);

/// What the fragments of a tile get.
#[derive(Debug)]
pub struct FullTile {
    /// The barycentrics of corners 1 and 2, pixel by pixel.
    pub(super) linear: [[f32; AREA]; 2],
    /// The same, perspective-correct.
    pub(super) perspective: [[f32; AREA]; 2],
    pub(super) attributes: Vec<[f32; 3]>,
    pub(super) all: LaneMask,
    pub(super) none: LaneMask,
}

impl Default for FullTile {
    fn default() -> Self {
        Self {
            linear: [[0.0; AREA]; 2],
            perspective: [[0.0; AREA]; 2],
            attributes: Vec::new(),
            all: LaneMask::first(AREA),
            none: LaneMask::none(),
        }
    }
}

impl FullTile {
    /// Finds the barycentrics of all pixels; perspective-correct ones, too, if 1 / w is needed.
    #[inline(always)]
    pub(super) fn find_barycentrics<S: Simd>(
        &mut self,
        simd: S,
        setup: &TriangleSetup,
        at: [i32; 2],
        needs: Needs,
    ) {
        for block in 0..BLOCKS {
            let pixels = 16 * block..16 * (block + 1);
            let values = BlockValues::new(simd, setup, block_corner(at, block), needs);
            for (linear, lanes) in self.linear.iter_mut().zip(values.barycentrics) {
                lanes.store_slice(&mut linear[pixels.clone()]);
            }
            if needs.inverse_w {
                let weights = both(setup.weights, |weight| f32x16::splat(simd, weight));
                let [p1, p2] = divided(simd, values.barycentrics, values.inverse_w, weights);
                p1.store_slice(&mut self.perspective[0][pixels.clone()]);
                p2.store_slice(&mut self.perspective[1][pixels]);
            }
        }
    }

    /// A varying of all pixels.
    #[inline(always)]
    pub(super) fn interpolate<S: Simd>(
        &self,
        simd: S,
        interpolation: Interpolation,
        divides: bool,
        attribute: [f32; 3],
        out: &mut [Vector],
    ) {
        let [b1, b2] = match interpolation {
            Interpolation::Flat => return out.fill(Vector([attribute[0].to_bits(); 16])),
            Interpolation::Perspective if divides => &self.perspective,
            _ => &self.linear,
        };
        let (b1, b2) = (b1.as_chunks::<16>().0, b2.as_chunks::<16>().0);
        let attribute = three(attribute, |value| f32x16::splat(simd, value));
        for (out, (b1, b2)) in out.iter_mut().zip(b1.iter().zip(b2)) {
            let b1 = f32x16::simd_from(simd, *b1);
            let b2 = f32x16::simd_from(simd, *b2);
            *out = Vector(bits_of(varying(attribute, [b1, b2])).into());
        }
    }
}

/// Tiles of the largest macro-tile.
const MAX_TILES: usize = (MAX_MACRO_TILE_SIZE / TILE_SIZE).pow(2) as usize;

/// A primitive that tiles wait for.
#[derive(Debug)]
pub struct DeferredPrimitive {
    pub setup: TriangleSetup,
    /// Its segment among the draw's, and its place there.
    pub segment: usize,
    pub primitive: u32,
    /// How many tiles wait for it.
    tiles: u32,
}

/// The tiles of a macro-tile that wait.
#[derive(Debug)]
pub struct DeferredTiles {
    /// Which of `primitives` each waits for.
    tiles: [Option<u8>; MAX_TILES],
    /// As many as there are tiles, at most, since those that no tile waits for are replaced.
    primitives: Vec<DeferredPrimitive>,
}

impl Default for DeferredTiles {
    fn default() -> Self {
        Self {
            tiles: [None; MAX_TILES],
            primitives: Vec::new(),
        }
    }
}

impl DeferredTiles {
    /// Forgets everything.
    pub fn clear(&mut self) {
        self.tiles = [None; MAX_TILES];
        self.primitives.clear();
    }

    /// Adds a primitive, for which [`DeferredTiles::defer`] must be called next; returns where.
    #[cold]
    pub fn add(&mut self, setup: &TriangleSetup, segment: usize, primitive: u32) -> u8 {
        let deferred = DeferredPrimitive {
            setup: setup.clone(),
            segment,
            primitive,
            tiles: 0,
        };
        let slot = match self
            .primitives
            .iter()
            .position(|deferred| deferred.tiles == 0)
        {
            Some(slot) => {
                self.primitives[slot] = deferred;
                slot
            }
            None => {
                self.primitives.push(deferred);
                self.primitives.len() - 1
            }
        };
        slot as u8
    }

    /// Lets a tile wait for the primitive at a place. Tells whether it waited for another.
    pub fn defer(&mut self, tile: usize, slot: u8) -> bool {
        self.primitives[usize::from(slot)].tiles += 1;
        let before = self.tiles[tile].replace(slot);
        if let Some(before) = before {
            self.primitives[usize::from(before)].tiles -= 1;
        }
        before.is_some()
    }

    /// Tells whether a tile waits.
    pub fn is_deferred(&self, tile: usize) -> bool {
        self.tiles[tile].is_some()
    }

    /// The primitive that a tile waited for, if any: it waits no more.
    pub fn take(&mut self, tile: usize) -> Option<&DeferredPrimitive> {
        let slot = usize::from(self.tiles[tile].take()?);
        self.primitives[slot].tiles -= 1;
        Some(&self.primitives[slot])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_primitive_is_what_a_tile_waits_for() {
        let mut deferred = DeferredTiles::default();
        let setup = TriangleSetup::default();
        for round in 0..1000u32 {
            // Each primitive covers a few tiles, of which later ones take some.
            let slot = deferred.add(&setup, 0, round);
            for tile in 0..5 {
                let tile = (round as usize * 7 + tile * 3) % MAX_TILES;
                deferred.defer(tile, slot);
            }
            assert!(deferred.primitives.len() <= MAX_TILES);
        }
        let mut newest = [None; MAX_TILES];
        for round in 0..1000u32 {
            for tile in 0..5 {
                newest[(round as usize * 7 + tile * 3) % MAX_TILES] = Some(round);
            }
        }
        for (tile, newest) in newest.into_iter().enumerate() {
            assert_eq!(deferred.is_deferred(tile), newest.is_some());
            assert_eq!(
                deferred.take(tile).map(|deferred| deferred.primitive),
                newest
            );
            assert!(deferred.take(tile).is_none());
        }
        assert!(
            deferred
                .primitives
                .iter()
                .all(|deferred| deferred.tiles == 0)
        );
    }
}
