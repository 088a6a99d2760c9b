//! Tiles that a primitive covers as a whole. In draws of which nothing is left where another does so later they wait to be
//! shaded until a primitive touches them otherwise, or the draw ends.

use super::super::batch::{BlockValues, Quad};
use super::super::coverage::Coverage;
use super::super::pending::Pending;
use super::super::tile::{AREA, SIDE};
use super::{Current, Renderer};
use crate::limits::TILE_SIZE;
use crate::stats::counters::Counter;
use crate::stats::optimizations::Skip;
use fearless_simd::{Simd, f32x16, prelude::*};
use isa::exec::Stopped;

/// Blocks of a tile.
pub(super) const BLOCKS: usize = 16;

/// The first pixel of a block of the tile at pixel `at`.
#[inline(always)]
pub(super) fn block_corner([x, y]: [i32; 2], block: usize) -> [i32; 2] {
    [x + (block % 4 * 4) as i32, y + (block / 4 * 4) as i32]
}

impl Renderer<'_, '_> {
    /// A tile at pixel `at` that a primitive covers as a whole, in a draw with one sample a pixel.
    #[inline(always)]
    pub(super) fn whole_tile<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        current: &mut Current<'_>,
        coverage: &Coverage<N>,
        pending: &mut Pending,
        (tile, at): (usize, [i32; 2]),
    ) -> Result<(), Stopped> {
        let draw = self.draw;
        let (mut lanes, mut passed) = ([u16::MAX; BLOCKS], AREA as u64);
        if draw.tests.any() {
            passed = 0;
            for (block, lanes) in lanes.iter_mut().enumerate() {
                let [x, y] = block_corner(at, block);
                let setup = current.setup;
                let base = setup.depth(setup.barycentrics(x, y));
                let depth = f32x16::simd_from(simd, setup.lane_depth) + base;
                let mut only = [*lanes];
                self.test(simd, &draw.tests, current, depth, &mut only, (tile, block));
                *lanes = only[0];
                passed += u64::from(lanes.count_ones());
            }
        }
        self.samples_passed += passed;
        if passed == AREA as u64 && !draw.defers {
            self.touch_colors(tile, coverage);
        } else if passed == AREA as u64 {
            self.touch_unread(tile);
            let slot = match current.kept {
                Some(slot) => slot,
                None => {
                    let (chunk, primitive) = current.place;
                    *current
                        .kept
                        .insert(pending.keep(current.setup, chunk, primitive))
                }
            };
            if pending.cover(tile, slot) {
                self.counters
                    .add(Counter::QuadsOverwritten, AREA as u64 / 4);
            }
            return Ok(());
        }
        if pending.waits(tile) {
            self.shade_pending(simd, pending, tile)?;
            // The batch may have begun anew.
            current.record = None;
        }
        self.shade_tile(simd, current, (tile, at), &lanes)
    }

    /// Shades a tile that waits, if it does.
    pub(super) fn shade_pending<S: Simd>(
        &mut self,
        simd: S,
        pending: &mut Pending,
        tile: usize,
    ) -> Result<(), Stopped> {
        let Some(kept) = pending.take(tile) else {
            return Ok(());
        };
        let draw = self.draw;
        let chunk = &draw.draw.chunks[kept.chunk];
        let primitive = &chunk.primitives[kept.primitive as usize];
        let mut current = Current {
            primitive,
            varyings: &chunk.varyings,
            setup: &kept.setup,
            place: (kept.chunk, kept.primitive),
            record: None,
            kept: None,
            range: self.depth_range(primitive),
        };
        let side = (self.place.size / TILE_SIZE) as usize;
        let place = [tile % side, tile / side];
        let corner = [0, 1].map(|axis| {
            (self.place.at[axis] * self.place.size) as i32 + (place[axis] * SIDE) as i32
        });
        simd.vectorize(
            #[inline(always)]
            || self.shade_tile(simd, &mut current, (tile, corner), &[u16::MAX; BLOCKS]),
        )
    }

    /// Shades lanes of a tile's blocks, of which nothing is left to be tested, in a draw with one sample a pixel.
    #[inline(always)]
    fn shade_tile<S: Simd>(
        &mut self,
        simd: S,
        current: &mut Current<'_>,
        (tile, at): (usize, [i32; 2]),
        lanes: &[u16; BLOCKS],
    ) -> Result<(), Stopped> {
        if self.draw.takes_tiles && *lanes == [u16::MAX; BLOCKS] {
            self.touch_read(tile);
            return self.shade_full_tile(simd, current, (tile, at));
        }
        let needs = self.draw.needs;
        let mut touched = false;
        for (block, &lanes) in lanes.iter().enumerate() {
            if lanes == 0 && self.draw.skips.has(Skip::MaskedQuads) {
                self.quads_masked += 4;
                continue;
            }
            let corner = block_corner(at, block);
            let values = BlockValues::new(simd, current.setup, corner, needs);
            if !touched {
                self.touch_read(tile);
                touched = true;
            }
            let quad = Quad {
                tile: tile as u8,
                place: (block * 16) as u8,
                ..Quad::default()
            };
            self.append(current, quad, &[lanes], &values)?;
        }
        Ok(())
    }
}
