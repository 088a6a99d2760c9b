//! Gaussian mode of the tile engine: front to back through a tile's list, with early termination.
//!
//! Most trained Gaussians are a few pixels wide, so a tile is taken as 16 blocks of 4x4 pixels, and lists are
//! worked off in two phases, a chunk at a time. Phase 1 tests one Gaussian against all 16 blocks in one vector,
//! conservatively, and appends (Gaussian, block) items; phase 2 is a flat loop over the items, each evaluating
//! 16 pixels, without a branch that is hard to predict.
//!
//! Exponents are formed from the pixel of the tile nearest the mean: the factor times the offset of that pixel
//! is computed in binary64 and rounded once, and from there on pixels are small integers away. Needles that
//! cross many tiles and dust smaller than a pixel lose nothing alike, and no position is ever rounded to
//! binary32.

use crate::counters::{Counter, Counters};
use crate::gaussian::project::Splat;
use crate::gaussian::{GaussianDraw, TILE_SIZE, locate};
use crate::packet::{GaussianState, Rect};
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16, prelude::*, u32x16};

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
    /// The pixel of the tile nearest the mean, from the tile's corner.
    anchor: [f32; 2],
    /// `u` and `v` at its centre.
    at_anchor: [f32; 2],
    factor: [f32; 3],
    log2_opacity: f32,
    color: [f32; 3],
    /// How far below `log2_opacity` the exponent may fall, with a margin for rounding.
    room: f32,
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
        let work =
            dispatch!(level, simd => self.composite(simd, &draw.splats, list, corner, thresholds));
        counters.add(Counter::TilePairsEvaluated, work.pairs);
        counters.add(Counter::BlockEvaluations, work.items);
        counters.add(Counter::PixelContributions, work.contributions);
        self.covered.iter().any(|&lanes| lanes != 0)
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
    ) -> Work {
        let mut work = Work::default();
        for chunk in list.chunks(CHUNK) {
            let open = self.open_blocks();
            if open == 0 {
                break;
            }
            for (record, &primitive) in self.chunk.iter_mut().zip(chunk) {
                let (batch, place) = locate(primitive);
                *record = Record::new(&splats[batch][place], corner, thresholds.log2_floor);
            }
            let items = find_items(simd, &self.chunk[..chunk.len()], open, &mut self.items);
            work.pairs += chunk.len() as u64;
            work.items += items as u64;
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
            let dx = across + f32x16::splat(simd, BLOCK_X[block] - g.anchor[0]);
            let dy = down + f32x16::splat(simd, BLOCK_Y[block] - g.anchor[1]);
            let u = dx.mul_add(
                f32x16::splat(simd, g.factor[0]),
                f32x16::splat(simd, g.at_anchor[0]),
            );
            let v = dy.mul_add(
                f32x16::splat(simd, g.factor[2]),
                f32x16::splat(simd, g.at_anchor[1]),
            );
            let v = dx.mul_add(f32x16::splat(simd, g.factor[1]), v);
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

/// The offset of each lane's pixel from its block's corner.
const LANE_X: [f32; LANES] = grid(1.0, true);
const LANE_Y: [f32; LANES] = grid(1.0, false);
/// The offset of each block's corner from its tile's corner.
const BLOCK_X: [f32; BLOCKS] = grid(4.0, true);
const BLOCK_Y: [f32; BLOCKS] = grid(4.0, false);

/// The column or row, times `step`, of each cell of a 4x4 grid.
const fn grid(step: f32, column: bool) -> [f32; 16] {
    let mut out = [0.0; 16];
    let mut cell = 0;
    while cell < 16 {
        out[cell] = step * (if column { cell % 4 } else { cell / 4 }) as f32;
        cell += 1;
    }
    out
}

impl Record {
    #[inline(always)]
    fn new(splat: &Splat, corner: [u32; 2], log2_floor: f32) -> Self {
        let [left, top] = corner.map(f64::from);
        let at = [splat.mean[0] - left, splat.mean[1] - top];
        // The index of the pixel that the mean lies in, or of the nearest one of this tile.
        // Truncation is the floor of what is not negative, and what is becomes zero.
        let nearest = |at: f64| f64::from(at.clamp(0.0, TILE as f64 - 1.0) as i32);
        let anchor = [nearest(at[0]), nearest(at[1])];
        let d = [anchor[0] + 0.5 - at[0], anchor[1] + 0.5 - at[1]];
        let [a, b, c] = splat.factor;
        let room = splat.log2_opacity - log2_floor;
        Self {
            anchor: [anchor[0] as f32, anchor[1] as f32],
            at_anchor: [(a * d[0]) as f32, (b * d[0] + c * d[1]) as f32],
            factor: [a as f32, b as f32, c as f32],
            log2_opacity: splat.log2_opacity,
            color: splat.color,
            room: room + 1e-3 + 1e-5 * room.abs(),
        }
    }
}

/// Phase 1: writes an item `record * BLOCKS + block` for every open block that a record may reach, in the
/// records' order. Returns how many there are.
#[inline(always)]
fn find_items<S: Simd>(simd: S, records: &[Record], open: u64, items: &mut [u32]) -> usize {
    let open = mask32x16::from_bitmask(simd, open);
    let blocks = u32x16::from_fn(simd, |block| block as u32);
    // Half of the distance between a block's first and last pixel centres, and its middle.
    let half = (BLOCK as f32 - 1.0) / 2.0;
    let middle_x = f32x16::simd_from(simd, BLOCK_X) + f32x16::splat(simd, half);
    let middle_y = f32x16::simd_from(simd, BLOCK_Y) + f32x16::splat(simd, half);
    let zero = f32x16::splat(simd, 0.0);
    let mut count = 0;
    for (number, g) in records.iter().enumerate() {
        let dx = middle_x - f32x16::splat(simd, g.anchor[0]);
        let dy = middle_y - f32x16::splat(simd, g.anchor[1]);
        let [a, b, c] = g.factor;
        let u = dx.mul_add(f32x16::splat(simd, a), f32x16::splat(simd, g.at_anchor[0]));
        let v = dy.mul_add(f32x16::splat(simd, c), f32x16::splat(simd, g.at_anchor[1]));
        let v = dx.mul_add(f32x16::splat(simd, b), v);
        // The least |u| and |v| over the block's centres, each for itself: together they bound u^2 + v^2.
        let least_u = (u.abs() - f32x16::splat(simd, half * a.abs())).max(zero);
        let least_v = (v.abs() - f32x16::splat(simd, half * (b.abs() + c.abs()))).max(zero);
        let least = least_v.mul_add(least_v, least_u * least_u);
        let reached = least.simd_le(f32x16::splat(simd, g.room)) & open;
        let named = blocks + u32x16::splat(simd, (number * BLOCKS) as u32);
        let Some(room) = items.get_mut(count..count + LANES) else {
            // Items have room for all blocks of all records and one vector more.
            return count;
        };
        named.compress(reached).store_slice(room);
        count += reached.to_bitmask().count_ones() as usize;
    }
    count
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
