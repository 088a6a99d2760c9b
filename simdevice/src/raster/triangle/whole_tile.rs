//! Tiles that one primitive covers completely, in draws without tests after shading. If a later primitive of the draw
//! may overwrite such a tile, it is deferred, and the earlier primitive is then never shaded there. If the only inputs
//! of fragments are varyings, the tile is a batch that needs no list of quads.

use super::batch::{BlockValues, LANES, perspective_correct, varying};
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

/// The inputs of the fragments of a tile.
#[derive(Debug)]
pub struct FullTile {
    /// The linear barycentrics of corners 1 and 2, pixel by pixel.
    pub(super) linear: [[f32; AREA]; 2],
    /// The perspective-correct barycentrics.
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
    /// Computes the barycentrics of all pixels. If `needs.inverse_w`, it computes perspective-correct ones, too.
    #[inline(always)]
    pub(super) fn find_barycentrics<S: Simd>(&mut self, simd: S, setup: &TriangleSetup, at: [i32; 2], needs: Needs) {
        for block in 0..BLOCKS {
            let pixels = 16 * block..16 * (block + 1);
            let values = BlockValues::new(simd, setup, block_corner(at, block), needs);
            for (linear, lanes) in self.linear.iter_mut().zip(values.barycentrics) {
                lanes.store_slice(&mut linear[pixels.clone()]);
            }
            if needs.inverse_w {
                let weights = both(setup.weights, |weight| f32x16::splat(simd, weight));
                let [p1, p2] = perspective_correct(simd, values.barycentrics, values.inverse_w, weights);
                p1.store_slice(&mut self.perspective[0][pixels.clone()]);
                p2.store_slice(&mut self.perspective[1][pixels]);
            }
        }
    }

    /// Interpolates a varying for all pixels.
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

/// The number of tiles of the largest macro-tile.
const MAX_TILES: usize = (MAX_MACRO_TILE_SIZE / TILE_SIZE).pow(2) as usize;

/// A primitive for which tiles are deferred.
#[derive(Debug)]
pub struct DeferredPrimitive {
    pub setup: TriangleSetup,
    /// The number of its segment in the draw; `primitive` is its number in the segment.
    pub segment: usize,
    pub primitive: u32,
    /// The number of tiles that are deferred for it.
    tiles: u32,
}

/// The deferred tiles of a macro-tile.
#[derive(Debug)]
pub struct DeferredTiles {
    /// The index in `primitives` for each tile that is deferred.
    tiles: [Option<u8>; MAX_TILES],
    /// The primitives. There are at most as many as tiles, since those without tiles are replaced.
    primitives: Vec<DeferredPrimitive>,
}

impl Default for DeferredTiles {
    fn default() -> Self {
        Self { tiles: [None; MAX_TILES], primitives: Vec::new() }
    }
}

impl DeferredTiles {
    /// Removes all tiles and primitives.
    pub fn clear(&mut self) {
        self.tiles = [None; MAX_TILES];
        self.primitives.clear();
    }

    /// Adds a primitive and returns its slot. [`DeferredTiles::defer`] must be called for it next.
    #[cold]
    pub fn add(&mut self, setup: &TriangleSetup, segment: usize, primitive: u32) -> u8 {
        let deferred = DeferredPrimitive { setup: setup.clone(), segment, primitive, tiles: 0 };
        let slot = match self.primitives.iter().position(|deferred| deferred.tiles == 0) {
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

    /// Defers a tile for the primitive in a slot. Returns true if it was deferred for another.
    pub fn defer(&mut self, tile: usize, slot: u8) -> bool {
        self.primitives[usize::from(slot)].tiles += 1;
        let before = self.tiles[tile].replace(slot);
        if let Some(before) = before {
            self.primitives[usize::from(before)].tiles -= 1;
        }
        before.is_some()
    }

    /// True if a tile is deferred.
    pub fn is_deferred(&self, tile: usize) -> bool {
        self.tiles[tile].is_some()
    }

    /// Takes the primitive for which a tile is deferred, if there is one. The tile is then no longer deferred.
    pub fn take(&mut self, tile: usize) -> Option<&DeferredPrimitive> {
        let slot = usize::from(self.tiles[tile].take()?);
        self.primitives[slot].tiles -= 1;
        Some(&self.primitives[slot])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[gaurast_runner::test]
    fn the_last_primitive_is_what_a_tile_waits_for() {
        let mut deferred = DeferredTiles::default();
        let setup = TriangleSetup::default();
        for round in 0..1000u32 {
            // Each primitive covers a few tiles, and later ones replace it in some.
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
            assert_eq!(deferred.take(tile).map(|deferred| deferred.primitive), newest);
            assert!(deferred.take(tile).is_none());
        }
        assert!(deferred.primitives.iter().all(|deferred| deferred.tiles == 0));
    }
}
