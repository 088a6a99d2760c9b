//! Gaussian mode of the tile engine: front to back through a tile's list, with early termination.
//!
//! Most trained Gaussians are a few pixels wide, so a tile is taken as 16 blocks of 4x4 pixels, and lists are
//! worked off in two phases, a chunk at a time. Phase 1 tests one Gaussian against all 16 blocks in one vector,
//! conservatively, and appends (Gaussian, block) items; phase 2 is a flat loop over the items, each evaluating
//! 16 pixels, without a branch that is hard to predict.
//!
//! Exponents are formed from the block's middle: the Cholesky factor times its offset from the mean is computed in
//! binary64 and rounded once, and from there pixels are at most 1.5 away in x and y. Needles that cross many tiles
//! and dust smaller than a pixel lose nothing alike; no position is ever rounded to binary32, and no value depends
//! on where tiles begin.

use crate::counters::{Counter, Counters};
use crate::gaussian::project::Splat;
use crate::gaussian::{GaussianDraw, TILE_SIZE, locate};
use crate::packet::{GaussianState, Rect};
use crate::trace::{self, Run, TileWork};
use fearless_simd::{Level, Simd, dispatch, f32x16, f64x8, mask32x16, prelude::*, u32x16};

const TILE: usize = TILE_SIZE as usize;
/// Pixels of a block, which are the lanes of a vector.
const LANES: usize = 16;
/// The side of a block in pixels.
const BLOCK: usize = 4;
/// Blocks of a tile.
const BLOCKS: usize = 16;
/// Gaussians of a chunk: as many as phase 1 and phase 2 pass through the first-level cache.
const CHUNK: usize = 32;

/// A tile's accumulated colour and transmittance: the part of tile buffer B that Gaussian mode uses.
///
/// Arrays are indexed by block, then by pixel of the block, both row by row.
#[derive(Debug)]
#[repr(align(64))]
pub struct GaussianTile {
    color: [[[f32; LANES]; BLOCKS]; 3],
    /// Transmittance; negative where the pixel is finished or is not to be touched.
    transmittance: [[f32; LANES]; BLOCKS],
    /// Bit `lane` of entry `block` tells that some Gaussian contributed.
    covered: [u32; BLOCKS],
    chunk: [Record; CHUNK],
    items: [u32; CHUNK * BLOCKS + LANES],
}

/// What the two phases need of a Gaussian in this tile.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
struct Record {
    /// `u` and `v` at the middle of each block.
    u: [f32; BLOCKS],
    v: [f32; BLOCKS],
    /// How `u` grows with x, and `v` with x and y.
    factor: [f32; 3],
    log2_opacity: f32,
    color: [f32; 3],
}

/// The constants of a draw.
#[derive(Clone, Copy, Debug)]
struct Thresholds {
    log2_floor: f32,
    alpha_floor: f32,
    alpha_ceiling: f32,
    transmittance_floor: f32,
}

impl Thresholds {
    fn new(state: &GaussianState) -> Self {
        Self {
            log2_floor: state.alpha_floor.log2().max(-150.0),
            alpha_floor: state.alpha_floor,
            alpha_ceiling: state.alpha_ceiling,
            transmittance_floor: state.transmittance_floor,
        }
    }
}

impl Default for GaussianTile {
    fn default() -> Self {
        Self {
            color: [[[0.0; LANES]; BLOCKS]; 3],
            transmittance: [[1.0; LANES]; BLOCKS],
            covered: [0; BLOCKS],
            chunk: [Record::default(); CHUNK],
            items: [0; CHUNK * BLOCKS + LANES],
        }
    }
}

/// The block of a pixel of a tile, and the lane in it.
fn block_and_lane(x: usize, y: usize) -> (usize, usize) {
    (
        y / BLOCK * (TILE / BLOCK) + x / BLOCK,
        y % BLOCK * BLOCK + x % BLOCK,
    )
}

impl GaussianTile {
    /// Composites `draw`'s Gaussians in the tile at (`tile_x`, `tile_y`), in tiles from the framebuffer's
    /// corner. Returns whether any pixel was covered.
    pub fn render(
        &mut self,
        draw: &GaussianDraw,
        level: Level,
        tile_x: u32,
        tile_y: u32,
        counters: &mut Counters,
    ) -> bool {
        let list = draw.tiles.list(tile_x, tile_y);
        if list.is_empty() {
            return false;
        }
        let corner = [tile_x, tile_y].map(|tile| tile * TILE_SIZE);
        self.clear(corner, draw.bounds);
        let thresholds = Thresholds::new(&draw.state);
        let mut runs = draw.record.as_ref().map(|_| Vec::new());
        let work = dispatch!(level, simd =>
            self.composite(simd, &draw.splats, list, corner, thresholds, runs.as_mut()));
        if let Some((record, runs)) = draw.record.as_ref().zip(runs) {
            record.add(TileWork {
                at: [tile_x, tile_y],
                listed: list.len() as u32,
                runs,
                contributions: work.contributions,
                terminated: self.finished_pixels(corner, draw.bounds),
                ..TileWork::default()
            });
        }
        counters.add(Counter::TilePairsEvaluated, work.pairs);
        counters.add(Counter::BlockEvaluations, work.items);
        counters.add(Counter::PixelContributions, work.contributions);
        self.covered.iter().any(|&lanes| lanes != 0)
    }

    /// How many pixels of the tile were covered.
    pub fn covered_pixels(&self) -> u64 {
        self.covered
            .iter()
            .map(|lanes| u64::from(lanes.count_ones()))
            .sum()
    }

    /// The premultiplied colour and coverage (C, 1 - T) of a pixel of the tile, if it was covered.
    pub fn pixel(&self, x: usize, y: usize) -> Option<[f32; 4]> {
        let (block, lane) = block_and_lane(x, y);
        let covered = self.covered[block] >> lane & 1 == 1;
        covered.then(|| {
            let [r, g, b] = [0, 1, 2].map(|channel| self.color[channel][block][lane]);
            [r, g, b, 1.0 - self.transmittance[block][lane].abs()]
        })
    }

    /// Makes the pixels of `bounds` fresh, and the others finished.
    fn clear(&mut self, corner: [u32; 2], bounds: Rect) {
        self.color = [[[0.0; LANES]; BLOCKS]; 3];
        self.covered = [0; BLOCKS];
        let [left, top] = corner.map(i64::from);
        let size = i64::from(TILE_SIZE);
        let tile = Rect {
            x: left as i32,
            y: top as i32,
            width: TILE_SIZE,
            height: TILE_SIZE,
        };
        let inside = bounds.intersect(tile);
        if i64::from(inside.width) == size && i64::from(inside.height) == size {
            self.transmittance = [[1.0; LANES]; BLOCKS];
            return;
        }
        self.transmittance = [[-1.0; LANES]; BLOCKS];
        let first = [i64::from(inside.x) - left, i64::from(inside.y) - top].map(|at| at as usize);
        for y in first[1]..first[1] + inside.height as usize {
            for x in first[0]..first[0] + inside.width as usize {
                let (block, lane) = block_and_lane(x, y);
                self.transmittance[block][lane] = 1.0;
            }
        }
    }

    #[inline(always)]
    fn composite<S: Simd>(
        &mut self,
        simd: S,
        splats: &[Vec<Splat>],
        list: &[u32],
        corner: [u32; 2],
        thresholds: Thresholds,
        mut runs: Option<&mut Vec<Run>>,
    ) -> Work {
        let mut work = Work::default();
        for chunk in list.chunks(CHUNK) {
            let open = self.open_blocks();
            if open == 0 {
                break;
            }
            let blocks = open.count_ones() as u8;
            let rows = if runs.is_some() { self.open_rows() } else { 0 };
            let open = mask32x16::from_bitmask(simd, open);
            let mut items = 0;
            for (number, &primitive) in chunk.iter().enumerate() {
                let (batch, place) = locate(primitive);
                let splat = &splats[batch][place];
                let record = &mut self.chunk[number % CHUNK];
                let reached = record.place(simd, splat, corner, thresholds.log2_floor);
                let Some(room) = self.items.get_mut(items..items + LANES) else {
                    // There is room for all blocks of all records, and for a vector more.
                    break;
                };
                items += append_items(simd, number, reached & open, room);
            }
            work.pairs += chunk.len() as u64;
            work.items += items as u64;
            if let Some(runs) = &mut runs {
                let (primitives, reached) = (chunk.len() as u32, items as u32);
                trace::push_run(
                    runs,
                    Run {
                        primitives,
                        rows,
                        blocks,
                        reached,
                    },
                );
            }
            work.contributions += self.evaluate(simd, items, thresholds);
        }
        work
    }

    /// Bit `block` tells that a pixel of the block is not finished.
    #[inline(always)]
    fn open_blocks(&self) -> u64 {
        let mut open = 0;
        for (block, lanes) in self.transmittance.iter().enumerate() {
            let any = lanes
                .iter()
                .fold(false, |any, &t| any | (t.to_bits() >> 31 == 0));
            open |= u64::from(any) << block;
        }
        open
    }

    /// How many rows have a pixel that is not finished.
    fn open_rows(&self) -> u8 {
        let open = |&y: &usize| {
            (0..TILE).any(|x| {
                let (block, lane) = block_and_lane(x, y);
                self.transmittance[block][lane].is_sign_positive()
            })
        };
        (0..TILE).filter(open).count() as u8
    }

    /// How many pixels of `bounds` are finished.
    fn finished_pixels(&self, corner: [u32; 2], bounds: Rect) -> u32 {
        let tile = Rect {
            x: corner[0] as i32,
            y: corner[1] as i32,
            width: TILE_SIZE,
            height: TILE_SIZE,
        };
        let inside = bounds.intersect(tile);
        let finished = self
            .transmittance
            .iter()
            .flatten()
            .filter(|t| t.is_sign_negative());
        let outside = TILE_SIZE * TILE_SIZE - inside.width * inside.height;
        (finished.count() as u32).saturating_sub(outside)
    }

    /// Phase 2: composites the first `count` items; returns how many pixels accepted one.
    #[inline(always)]
    fn evaluate<S: Simd>(&mut self, simd: S, count: usize, thresholds: Thresholds) -> u64 {
        let across = f32x16::simd_from(simd, LANE_X);
        let down = f32x16::simd_from(simd, LANE_Y);
        let floor = f32x16::splat(simd, thresholds.alpha_floor);
        let ceiling = f32x16::splat(simd, thresholds.alpha_ceiling);
        let finish = f32x16::splat(simd, thresholds.transmittance_floor);
        let zero = f32x16::splat(simd, 0.0);
        let mut contributions = 0;
        for &item in &self.items[..count] {
            let block = item as usize % BLOCKS;
            let g = &self.chunk[item as usize / BLOCKS % CHUNK];
            let [a, b, c] = g.factor;
            let u = across.mul_add(f32x16::splat(simd, a), f32x16::splat(simd, g.u[block]));
            let v = down.mul_add(f32x16::splat(simd, c), f32x16::splat(simd, g.v[block]));
            let v = across.mul_add(f32x16::splat(simd, b), v);
            let exponent = f32x16::splat(simd, g.log2_opacity) - v.mul_add(v, u * u);
            let alpha = exp2(simd, exponent).min(ceiling);

            let t = f32x16::from_slice(simd, &self.transmittance[block]);
            let weight = t * alpha;
            let rest = t - weight;
            let reached = alpha.simd_ge(floor) & t.simd_ge(zero);
            let accepted = reached & rest.simd_ge(finish);
            let finished = reached & rest.simd_lt(finish);
            let t = accepted.select(rest, finished.select(zero - t, t));
            t.store_slice(&mut self.transmittance[block]);
            let weight = accepted.select(weight, zero);
            for (channel, color) in self.color.iter_mut().zip(g.color) {
                let sum = f32x16::from_slice(simd, &channel[block]);
                let sum = weight.mul_add(f32x16::splat(simd, color), sum);
                sum.store_slice(&mut channel[block]);
            }
            let accepted = accepted.to_bitmask() as u32;
            self.covered[block] |= accepted;
            contributions += u64::from(accepted.count_ones());
        }
        contributions
    }
}

/// What compositing a tile took.
#[derive(Clone, Copy, Debug, Default)]
struct Work {
    pairs: u64,
    items: u64,
    contributions: u64,
}

/// Half of the distance between a block's first and last pixel centres.
const HALF: f32 = (BLOCK as f32 - 1.0) / 2.0;
/// The offset of each lane's pixel from the middle of its block.
const LANE_X: [f32; LANES] = grid(true);
const LANE_Y: [f32; LANES] = grid(false);
/// The offset of the middle of each block from its tile's corner.
const BLOCK_X: [f64; BLOCKS] = middles(true);
const BLOCK_Y: [f64; BLOCKS] = middles(false);

const BLOCK_NUMBERS: [u32; BLOCKS] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// The column or row of each cell of a 4x4 grid, from the grid's middle.
const fn grid(column: bool) -> [f32; LANES] {
    let mut out = [0.0; LANES];
    let mut cell = 0;
    while cell < LANES {
        let at = if column { cell % BLOCK } else { cell / BLOCK };
        out[cell] = at as f32 - HALF;
        cell += 1;
    }
    out
}

/// The middle, in x or y, of each block of a tile.
const fn middles(column: bool) -> [f64; BLOCKS] {
    let mut out = [0.0; BLOCKS];
    let mut block = 0;
    while block < BLOCKS {
        let at = if column { block % 4 } else { block / 4 };
        out[block] = (BLOCK * at) as f64 + BLOCK as f64 / 2.0;
        block += 1;
    }
    out
}

impl Record {
    /// Phase 1: makes this the record of `splat` in the tile at `corner`. Returns which blocks it may reach.
    #[inline(always)]
    fn place<S: Simd>(
        &mut self,
        simd: S,
        splat: &Splat,
        corner: [u32; 2],
        log2_floor: f32,
    ) -> mask32x16<S> {
        let [a, b, c] = splat.factor;
        let from_mean = |axis: usize| f64::from(corner[axis]) - splat.mean[axis];
        let (from_x, from_y) = (from_mean(0), from_mean(1));
        // Columns repeat in both halves of the blocks.
        let dx = f64x8::from_slice(simd, &BLOCK_X[..8]) + from_x;
        let upper = f64x8::from_slice(simd, &BLOCK_Y[..8]) + from_y;
        let lower = f64x8::from_slice(simd, &BLOCK_Y[8..]) + from_y;
        let u = dx * a;
        let sheared = dx * b;
        let u: f32x16<S> = u.narrow(u);
        let v: f32x16<S> = (sheared + upper * c).narrow(sheared + lower * c);
        u.store_slice(&mut self.u);
        v.store_slice(&mut self.v);
        let [a, b, c] = [a as f32, b as f32, c as f32];
        self.factor = [a, b, c];
        self.log2_opacity = splat.log2_opacity;
        self.color = splat.color;
        // How far the exponent may fall, with a margin for rounding.
        let room = splat.log2_opacity - log2_floor;
        let room = room + 1e-3 + 1e-5 * room.abs();
        // The least |u| and |v| over a block's centres, each for itself: together they bound u^2 + v^2.
        let least_u = (u.abs() - HALF * a.abs()).max(0.0);
        let least_v = (v.abs() - HALF * (b.abs() + c.abs())).max(0.0);
        let least = least_v.mul_add(least_v, least_u * least_u);
        least.simd_le(room)
    }
}

/// Writes an item `number * BLOCKS + block` for each of `blocks` to the front of `items`, in order; returns how many
/// there are.
#[inline(always)]
fn append_items<S: Simd>(simd: S, number: usize, blocks: mask32x16<S>, items: &mut [u32]) -> usize {
    let named = u32x16::simd_from(simd, BLOCK_NUMBERS) + (number * BLOCKS) as u32;
    named.compress(blocks).store_slice(items);
    blocks.to_bitmask().count_ones() as usize
}

/// A polynomial fitted to 2^f for f in [-1/2, 1/2], highest power first; relative error 9.2e-8.
#[allow(
    clippy::approx_constant,
    reason = "the coefficients are fitted; one comes near ln 2"
)]
const POWER_OF_TWO: [f32; 6] = [
    0.001_326_472_7,
    0.009_671_513,
    0.055_507_336,
    0.240_222_42,
    0.693_147,
    1.0,
];

/// 2 to the power of `x`, for `x` below 1; below -126 the result is 2^-126. Error: at most 1.9 ulp with
/// fused multiply-add, 2.1 ulp without (measured).
///
/// `x = n + f` with `f` in [-1/2, 1/2], and 2^f is [`POWER_OF_TWO`].
#[allow(
    clippy::approx_constant,
    reason = "the coefficients are fitted; one comes near ln 2"
)]
#[inline(always)]
fn exp2<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    let constant = |value| f32x16::splat(simd, value);
    let x = x.max(constant(-126.0)).min(constant(1.0));
    // Adding 1.5 * 2^23 rounds to an integer, which then stands in the low bits.
    let shifter = constant(12_582_912.0);
    let shifted = x + shifter;
    let f = x - (shifted - shifter);
    let [first, rest @ ..] = POWER_OF_TWO;
    let mut p = constant(first);
    for coefficient in rest {
        p = p.mul_add(f, constant(coefficient));
    }
    let exponent = shifted.to_bits() << 23;
    f32x16::from_bits(p.to_bits() + exponent)
}

#[cfg(test)]
mod tests;
