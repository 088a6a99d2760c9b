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
//! on where tiles begin. Where no filter widens a Gaussian thinner than a tenth of a pixel, or an opacity far above 1
//! is to be outweighed, exponents are small differences of large numbers: those of such steep Gaussians are formed in
//! binary64 at every pixel.
//!
//! A draw that tests depth leaves out, pixel by pixel, the Gaussians whose centre fails against what was stored before
//! the draw ([`passing`]). What the tests of a whole draw do to a tile's samples is said in [`tile_draw`].

mod by_block;
mod exp2;
mod half;
mod layer;
mod passing;
mod per_pixel;
pub mod resolve;
pub(crate) mod tile_draw;

use super::DepthCode;
use super::tile::place;
use crate::counters::{Counter, Counters};
use crate::gaussian::depth::Trend;
use crate::gaussian::project::Splat;
use crate::gaussian::{GaussianDraw, TILE_SIZE, locate};
use crate::lanes::{bits_of, floats_of};
use crate::skips::{Skip, Skips};
use crate::trace::{self, Run, TileWork};
use by_block::TileMode;
use exp2::exp2_of_negated;
use fearless_simd::{Level, Simd, dispatch, f32x16, f64x8, mask32x16, prelude::*, u32x16};
use layer::{Lanes, Layer, block_and_lane, count, lanes_within};
use passing::Passing;
use per_pixel::PerPixel;

const TILE: usize = TILE_SIZE as usize;
/// Pixels of a block, which are the lanes of a vector.
const LANES: usize = 16;
/// The side of a block in pixels.
const BLOCK: usize = 4;
/// Blocks of a tile.
const BLOCKS: usize = 16;
/// A bit for each of them.
const ALL_BLOCKS: u64 = (1 << BLOCKS) - 1;
/// The sign bit of a binary32 number.
const SIGN: u32 = 1 << 31;
/// Gaussians of a chunk: as many as phase 1 and phase 2 pass through the first-level cache.
const CHUNK: usize = 32;

/// Powers of two are formed down to this one.
const MOST_FALL: f64 = 126.0;

/// Layers of a tile: one for each sample, and one to find what is reached at all.
const LAYERS: usize = super::MAX_SAMPLES as usize + 1;

/// The part of tile buffer B that Gaussian mode uses.
#[derive(Debug)]
pub struct GaussianTile {
    layers: [Layer; LAYERS],
    passing: Passing,
    /// Where the chunk's Gaussians are brought together before they are looked at.
    splats: [Splat; CHUNK],
    chunk: [Record; CHUNK],
    items: [u32; CHUNK * BLOCKS + LANES],
    /// What may reach each block, where a mode parts lists so.
    lists: [Vec<u32>; BLOCKS],
    per_pixel: PerPixel,
}

/// What the kernel does about depth; a constant, so that what isn't done costs nothing.
type DepthMode = u8;
/// Nothing.
const NO_DEPTH: DepthMode = 0;
/// It leaves out what fails the test.
const TEST_DEPTH: DepthMode = 1;
/// It also finds the median.
const FIND_MEDIAN: DepthMode = 2;
/// And what the mean is made of.
const FIND_MEAN: DepthMode = 3;

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
    /// As [`Splat::depth`].
    depth: u32,
}

/// The constants of a draw.
#[derive(Clone, Copy, Debug)]
struct Thresholds {
    /// Minus the base-2 logarithm of the alpha floor: no Gaussian contributes where its alpha has fallen further.
    most_fall: f32,
    /// For modes that compare alpha itself.
    alpha_floor: f32,
    alpha_ceiling: f32,
    transmittance_floor: f32,
    /// What numbers of depths mean.
    depth_unit: DepthCode,
}

impl Thresholds {
    fn new(draw: &GaussianDraw) -> Self {
        let state = &draw.state;
        // Where there is no floor, less than the least normal number is nothing. No alpha reaches a floor above the
        // ceiling.
        let most_fall = if state.alpha_floor <= state.alpha_ceiling {
            (-f64::from(state.alpha_floor).log2()).min(MOST_FALL) as f32
        } else {
            f32::NEG_INFINITY
        };
        Self {
            depth_unit: draw.depth_unit,
            most_fall,
            alpha_floor: state.alpha_floor,
            alpha_ceiling: state.alpha_ceiling,
            transmittance_floor: state.transmittance_floor,
        }
    }
}

impl Default for GaussianTile {
    fn default() -> Self {
        Self {
            layers: [Layer::EMPTY; LAYERS],
            passing: Passing::default(),
            splats: [Splat::default(); CHUNK],
            chunk: [Record::default(); CHUNK],
            items: [0; CHUNK * BLOCKS + LANES],
            lists: Default::default(),
            per_pixel: PerPixel::default(),
        }
    }
}

impl GaussianTile {
    /// Composites `draw`'s Gaussians in the tile at (`tile_x`, `tile_y`), in tiles from the framebuffer's
    /// corner, without tests. Returns whether any pixel was covered.
    pub fn render(
        &mut self,
        draw: &GaussianDraw,
        level: Level,
        tile_x: u32,
        tile_y: u32,
        counters: &mut Counters,
    ) -> bool {
        let at = [tile_x, tile_y];
        let lanes = lanes_within(draw.bounds, at.map(|tile| tile * TILE_SIZE));
        self.run::<NO_DEPTH>(draw, level, at, 0, &lanes, counters);
        self.layers[0].covered != [0; BLOCKS]
    }

    /// Composites `draw`'s Gaussians in `lanes` of a tile, into a layer.
    fn run<const DEPTH: DepthMode>(
        &mut self,
        draw: &GaussianDraw,
        level: Level,
        [tile_x, tile_y]: [u32; 2],
        layer: usize,
        lanes: &Lanes,
        counters: &mut Counters,
    ) {
        let list = draw.tiles.list(tile_x, tile_y);
        let to = &mut self.layers[layer];
        to.clear(lanes);
        if DEPTH == FIND_MEAN {
            to.clear_means();
        }
        if list.is_empty() {
            return;
        }
        let corner = [tile_x, tile_y].map(|tile| tile * TILE_SIZE);
        let task = Task {
            splats: &draw.splats,
            mode: TileMode::of(draw),
            list,
            skips: draw.skips,
            trend: draw.depth_trend,
            half_period: draw.half_period,
            corner,
            thresholds: Thresholds::new(draw),
        };
        let mut runs = draw.record.as_ref().map(|_| Vec::new());
        let work = match task.mode {
            TileMode::Fast => dispatch!(level, simd =>
                self.composite::<_, DEPTH>(simd, &task, layer, runs.as_mut())),
            _ => self.composite_by_block::<DEPTH>(level, &task, layer, runs.as_mut()),
        };
        if let Some((record, runs)) = draw.record.as_ref().zip(runs) {
            let outside = TILE_SIZE * TILE_SIZE - count(lanes);
            record.add(TileWork {
                at: [tile_x, tile_y],
                listed: list.len() as u32,
                runs,
                contributions: work.contributions,
                terminated: count(&self.layers[layer].finished()).saturating_sub(outside),
                hidden_rest: work.hidden_rest,
                ..TileWork::default()
            });
        }
        counters.add(Counter::TilePairsEvaluated, work.pairs);
        counters.add(Counter::GaussianTilesHidden, work.tiles_hidden);
        counters.add(Counter::GaussianBlocksHidden, work.blocks_hidden);
        counters.add(Counter::BlockEvaluations, work.items);
        counters.add(
            Counter::BlocksBesideEllipse,
            work.open - work.items - work.blocks_hidden,
        );
        let blocks = (list.len() as u64 - work.tiles_hidden) * BLOCKS as u64;
        counters.add(Counter::BlocksSaturated, blocks - work.open);
        counters.add(Counter::PixelContributions, work.contributions);
    }

    /// Which of `lanes` some Gaussian of `draw` reaches with an alpha of the floor or more, whatever its depth.
    fn reached(
        &mut self,
        draw: &GaussianDraw,
        level: Level,
        [tile_x, tile_y]: [u32; 2],
        lanes: &Lanes,
    ) -> Lanes {
        const LAYER: usize = LAYERS - 1;
        self.layers[LAYER].clear(lanes);
        let task = Task {
            splats: &draw.splats,
            mode: TileMode::of(draw).in_list_order(),
            list: draw.tiles.list(tile_x, tile_y),
            skips: Skips::ALL,
            trend: Trend::None,
            half_period: draw.half_period,
            corner: [tile_x, tile_y].map(|tile| tile * TILE_SIZE),
            // The first Gaussian that reaches a pixel finishes it.
            thresholds: Thresholds {
                transmittance_floor: f32::INFINITY,
                ..Thresholds::new(draw)
            },
        };
        match task.mode {
            TileMode::Fast => {
                dispatch!(level, simd => self.composite::<_, NO_DEPTH>(simd, &task, LAYER, None));
            }
            _ => {
                self.composite_by_block::<NO_DEPTH>(level, &task, LAYER, None);
            }
        }
        let finished = self.layers[LAYER].finished();
        std::array::from_fn(|block| finished[block] & lanes[block])
    }

    /// How many pixels of the tile were covered.
    pub fn covered_pixels(&self) -> u64 {
        count(&self.layers[0].covered).into()
    }

    /// The premultiplied colour and coverage (C, 1 - T) of a pixel of the tile, if it was covered.
    pub fn pixel(&self, x: usize, y: usize) -> Option<[f32; 4]> {
        self.sample(0, x, y)
    }

    /// As [`GaussianTile::pixel`], of a layer.
    fn sample(&self, layer: usize, x: usize, y: usize) -> Option<[f32; 4]> {
        let layer = &self.layers[layer];
        let (block, lane) = block_and_lane(x, y);
        let covered = layer.covered[block] >> lane & 1 == 1;
        covered.then(|| {
            let [r, g, b] = [0, 1, 2].map(|channel| layer.color[channel][block][lane]);
            [r, g, b, 1.0 - layer.transmittance[block][lane].abs()]
        })
    }

    #[inline(always)]
    fn composite<S: Simd, const DEPTH: DepthMode>(
        &mut self,
        simd: S,
        task: &Task<'_>,
        layer: usize,
        mut runs: Option<&mut Vec<Run>>,
    ) -> Work {
        let mut work = Work::default();
        let layer = &mut self.layers[layer];
        let bounded = task.skips.has(Skip::Blocks);
        let end_early = task.skips.has(Skip::Saturated);
        for (number, chunk) in task.list.chunks(CHUNK).enumerate() {
            let open = if end_early {
                layer.open_blocks()
            } else {
                ALL_BLOCKS
            };
            if open == 0 {
                break;
            }
            let blocks = open.count_ones() as u8;
            let rows = if runs.is_some() { layer.open_rows() } else { 0 };
            let open = mask32x16::from_bitmask(simd, open);
            if DEPTH != NO_DEPTH
                && self
                    .passing
                    .hides_from(task.splat(chunk[0]).depth, task.trend)
            {
                let rest = &task.list[number * CHUNK..];
                work.tiles_hidden += rest.len() as u64;
                if let Some(runs) = &mut runs {
                    work.hidden_rest = rest.len() as u32;
                    trace::push_run(runs, hidden_run(simd, task, rest, (open, rows, blocks)));
                }
                break;
            }
            let (mut items, mut reached_before) = (0, 0);
            let (hidden_before, mut hidden) = (work, 0);
            // Before any is looked at, so that the waits for memory overlap.
            for (splat, &primitive) in self.splats.iter_mut().zip(chunk) {
                *splat = *task.splat(primitive);
            }
            for (number, splat) in self.splats.iter().enumerate().take(chunk.len()) {
                if DEPTH != NO_DEPTH && self.passing.hides(splat.depth) {
                    work.tiles_hidden += 1;
                    if runs.is_some() {
                        hidden += hidden_blocks(simd, splat, task, open);
                    }
                    continue;
                }
                if splat.steep {
                    // What is before it is composited first.
                    let before = &self.items[..items];
                    work.contributions += layer.evaluate::<_, DEPTH>(
                        simd,
                        before,
                        &self.chunk,
                        &self.passing,
                        task.thresholds,
                    );
                    let shown = if DEPTH == NO_DEPTH {
                        open
                    } else {
                        open & self.passing.blocks(simd, splat.depth)
                    };
                    let (open, shown) = (u64::from(blocks), shown.to_bitmask());
                    let exact = u64::from(shown.count_ones());
                    work.open += open;
                    work.blocks_hidden += open - exact;
                    work.items += items as u64 + exact;
                    reached_before += items as u32 + exact as u32;
                    items = 0;
                    work.contributions +=
                        layer.evaluate_steep::<_, DEPTH>(simd, splat, shown, &self.passing, task);
                    continue;
                }
                let record = &mut self.chunk[number % CHUNK];
                let reached = record.place(simd, splat, task.corner, task.thresholds.most_fall);
                let mut reached = if bounded { reached & open } else { open };
                work.open += u64::from(blocks);
                if DEPTH != NO_DEPTH {
                    record.depth = splat.depth;
                    let shown = self.passing.blocks(simd, splat.depth);
                    let hidden = (reached & !shown).to_bitmask();
                    work.blocks_hidden += u64::from(hidden.count_ones());
                    reached &= shown;
                }
                let Some(room) = self.items.get_mut(items..items + LANES) else {
                    // There is room for all blocks of all records, and for a vector more.
                    break;
                };
                items += append_items(simd, number, reached, room);
            }
            work.pairs += chunk.len() as u64;
            work.items += items as u64;
            if let Some(runs) = &mut runs {
                let (primitives, reached) = (chunk.len() as u32, reached_before + items as u32);
                trace::push_run(
                    runs,
                    Run {
                        primitives,
                        rows,
                        blocks,
                        reached,
                        hidden: (work.tiles_hidden - hidden_before.tiles_hidden) as u32,
                        hidden_blocks: hidden
                            + (work.blocks_hidden - hidden_before.blocks_hidden) as u32,
                    },
                );
            }
            let (items, chunk) = (&self.items[..items], &self.chunk);
            work.contributions +=
                layer.evaluate::<_, DEPTH>(simd, items, chunk, &self.passing, task.thresholds);
        }
        work
    }
}

impl Layer {
    /// Phase 2: composites `items`; returns how many pixels accepted one.
    #[inline(always)]
    fn evaluate<S: Simd, const DEPTH: DepthMode>(
        &mut self,
        simd: S,
        items: &[u32],
        chunk: &[Record; CHUNK],
        passing: &Passing,
        thresholds: Thresholds,
    ) -> u64 {
        let across = f32x16::simd_from(simd, LANE_X);
        let down = f32x16::simd_from(simd, LANE_Y);
        let mut contributions = 0;
        for &item in items {
            let block = item as usize % BLOCKS;
            let g = &chunk[item as usize / BLOCKS % CHUNK];
            let [a, b, c] = g.factor;
            let u = across.mul_add(f32x16::splat(simd, a), f32x16::splat(simd, g.u[block]));
            let v = down.mul_add(f32x16::splat(simd, c), f32x16::splat(simd, g.v[block]));
            let v = across.mul_add(f32x16::splat(simd, b), v);
            let opacity = f32x16::splat(simd, g.log2_opacity);
            let fall = v.mul_add(v, u.mul_sub(u, opacity));
            let look = (g.color, g.depth);
            contributions +=
                self.accumulate::<_, DEPTH>(simd, block, fall, look, passing, thresholds);
        }
        contributions
    }

    /// As [`Layer::evaluate`], of one steep Gaussian in `blocks`: exponents are formed in binary64.
    #[inline(always)]
    fn evaluate_steep<S: Simd, const DEPTH: DepthMode>(
        &mut self,
        simd: S,
        splat: &Splat,
        blocks: u64,
        passing: &Passing,
        task: &Task<'_>,
    ) -> u64 {
        let mut contributions = 0;
        for block in (0..BLOCKS).filter(|block| blocks >> block & 1 == 1) {
            let fall = falls_64(simd, splat, task, block);
            let look = (splat.color, splat.depth);
            contributions +=
                self.accumulate::<_, DEPTH>(simd, block, fall, look, passing, task.thresholds);
        }
        contributions
    }

    /// Composites a Gaussian of a colour and a depth in a block, where alpha is 2 to the power of `-fall`; returns
    /// how many pixels accepted it.
    #[inline(always)]
    fn accumulate<S: Simd, const DEPTH: DepthMode>(
        &mut self,
        simd: S,
        block: usize,
        fall: f32x16<S>,
        (color, depth): ([f32; 3], u32),
        passing: &Passing,
        thresholds: Thresholds,
    ) -> u64 {
        let most_fall = f32x16::splat(simd, thresholds.most_fall);
        let ceiling = f32x16::splat(simd, thresholds.alpha_ceiling);
        let finish = f32x16::splat(simd, thresholds.transmittance_floor);
        // Where alpha has fallen too far this is meaningless, and so is what follows from it; `reached` leaves it out.
        let alpha = exp2_of_negated(simd, fall).min(ceiling);
        let t = f32x16::from_slice(simd, &self.transmittance[block]);
        let weight = t * alpha;
        let rest = t - weight;
        let mut reached = fall.simd_le(most_fall);
        if DEPTH != NO_DEPTH {
            reached &= passing.pixels(simd, block, depth);
        }
        // A finished pixel's transmittance is negative, and what is left of it fails like one below the floor.
        let accepted = reached & rest.simd_ge(finish);
        if DEPTH >= FIND_MEDIAN {
            let median = u32x16::from_slice(simd, &self.median[block]);
            let first_half = accepted & t.simd_ge(0.5);
            let median = first_half.select(u32x16::splat(simd, depth), median);
            median.store_slice(&mut self.median[block]);
        }
        let finished =
            bits_of(t) | reached.select(u32x16::splat(simd, SIGN), u32x16::splat(simd, 0));
        let t = accepted.select(rest, floats_of(finished));
        t.store_slice(&mut self.transmittance[block]);
        let weight = accepted.select(weight, f32x16::splat(simd, 0.0));
        if DEPTH == FIND_MEAN {
            let depth = f32x16::splat(simd, thresholds.depth_unit.decode(depth));
            let [depths, weights] = &mut self.means;
            let sum = f32x16::from_slice(simd, &depths[block]);
            weight.mul_add(depth, sum).store_slice(&mut depths[block]);
            let sum = f32x16::from_slice(simd, &weights[block]) + weight;
            sum.store_slice(&mut weights[block]);
        }
        for (channel, color) in self.color.iter_mut().zip(color) {
            let sum = f32x16::from_slice(simd, &channel[block]);
            let sum = weight.mul_add(f32x16::splat(simd, color), sum);
            sum.store_slice(&mut channel[block]);
        }
        let accepted = accepted.to_bitmask() as u32;
        self.covered[block] |= accepted;
        u64::from(accepted.count_ones())
    }
}

/// How far a Gaussian's alpha has fallen at a block's pixels, formed in binary64: minus its base-2 logarithm, but no less
/// than -1, which is more than any ceiling, and still a power that is formed.
///
/// What is wider than the period of a panorama counts where it is nearer than its copies.
#[inline(always)]
fn falls_64<S: Simd>(simd: S, splat: &Splat, task: &Task<'_>, block: usize) -> f32x16<S> {
    let [a, b, c] = splat.factor;
    let from_mean = |axis: usize| f64::from(task.corner[axis]) - splat.mean[axis];
    let opacity = f64x8::splat(simd, splat.log2_opacity.into());
    let half_period = if splat.wide {
        task.half_period
    } else {
        f64::INFINITY
    };
    let within = f64x8::splat(simd, half_period);
    let nothing = f64x8::splat(simd, 1e3);
    let middle = [BLOCK_X[block] + from_mean(0), BLOCK_Y[block] + from_mean(1)];
    let fall = |first: usize| {
        let dx = f64x8::from_slice(simd, &LANE_X_64[first..first + 8]) + middle[0];
        let dy = f64x8::from_slice(simd, &LANE_Y_64[first..first + 8]) + middle[1];
        let (u, v) = (dx * a, dx * b + dy * c);
        let fall = u * u + v * v - opacity;
        let inside = dx.simd_ge(-within) & dx.simd_lt(within);
        inside.select(fall, nothing)
    };
    let fall: f32x16<S> = fall(0).narrow(fall(8));
    fall.max(-1.0)
}

/// What a tile's Gaussians are.
struct Task<'a> {
    splats: &'a [Vec<Splat>],
    mode: TileMode<'a>,
    list: &'a [u32],
    /// What is left out.
    skips: Skips,
    trend: Trend,
    /// As [`GaussianDraw::half_period`].
    half_period: f64,
    corner: [u32; 2],
    thresholds: Thresholds,
}

impl Task<'_> {
    #[inline(always)]
    fn splat(&self, primitive: u32) -> &Splat {
        let (batch, place) = locate(primitive);
        &self.splats[batch][place]
    }
}

/// What compositing a tile took.
#[derive(Clone, Copy, Debug, Default)]
struct Work {
    pairs: u64,
    items: u64,
    /// Blocks that were not finished, summed over the pairs.
    open: u64,
    contributions: u64,
    tiles_hidden: u64,
    blocks_hidden: u64,
    /// Of the hidden, those that end a list, if work is recorded.
    hidden_rest: u32,
}

/// Of the `open` blocks of a tile, those that a Gaussian would be evaluated in if depths did not hide it.
#[inline(always)]
fn hidden_blocks<S: Simd>(simd: S, splat: &Splat, task: &Task<'_>, open: mask32x16<S>) -> u32 {
    let bounded = task.skips.has(Skip::Blocks) && !splat.steep;
    let reached = if bounded {
        let most_fall = task.thresholds.most_fall;
        open & Record::default().place(simd, splat, task.corner, most_fall)
    } else {
        open
    };
    reached.to_bitmask().count_ones()
}

/// What a trace tells of the Gaussians at a list's end that depths hide in all of the tile, of which `open` blocks and
/// so many rows and blocks are unfinished.
#[inline(always)]
fn hidden_run<S: Simd>(
    simd: S,
    task: &Task<'_>,
    rest: &[u32],
    (open, rows, blocks): (mask32x16<S>, u8, u8),
) -> Run {
    let mut run = Run {
        primitives: rest.len() as u32,
        rows,
        blocks,
        hidden: rest.len() as u32,
        ..Run::default()
    };
    for &primitive in rest {
        run.hidden_blocks += hidden_blocks(simd, task.splat(primitive), task, open);
    }
    run
}

/// Half of the distance between a block's first and last pixel centres.
const HALF: f32 = (BLOCK as f32 - 1.0) / 2.0;
/// The offset of each lane's pixel from the middle of its block.
const LANE_X: [f32; LANES] = grid(true);
const LANE_Y: [f32; LANES] = grid(false);
const LANE_X_64: [f64; LANES] = widened(LANE_X);
const LANE_Y_64: [f64; LANES] = widened(LANE_Y);
/// The offset of the middle of each block from its tile's corner.
const BLOCK_X: [f64; BLOCKS] = middles(true);
const BLOCK_Y: [f64; BLOCKS] = middles(false);

const BLOCK_NUMBERS: [u32; BLOCKS] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// The column or row of each lane's pixel, from the block's middle.
const fn grid(column: bool) -> [f32; LANES] {
    let mut out = [0.0; LANES];
    let mut pixel = 0;
    while pixel < LANES {
        let (x, y) = (pixel % BLOCK, pixel / BLOCK);
        out[place(x, y) % LANES] = (if column { x } else { y }) as f32 - HALF;
        pixel += 1;
    }
    out
}

/// The same numbers in binary64.
const fn widened(lanes: [f32; LANES]) -> [f64; LANES] {
    let mut out = [0.0; LANES];
    let mut lane = 0;
    while lane < LANES {
        out[lane] = lanes[lane] as f64;
        lane += 1;
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
        most_fall: f32,
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
        let room = splat.log2_opacity + most_fall;
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
    if S::f32s::LEN == LANES {
        named.compress(blocks).store_slice(items);
        return blocks.to_bitmask().count_ones() as usize;
    }
    // Halves are compressed without a branch.
    let (first, second) = named.split();
    let (in_first, in_second) = simd.split_mask32x16(blocks);
    let (first, second) = (first.compress(in_first), second.compress(in_second));
    let count = in_first.to_bitmask().count_ones() as usize;
    first.store_slice(&mut items[..LANES / 2]);
    second.store_slice(&mut items[count..][..LANES / 2]);
    count + in_second.to_bitmask().count_ones() as usize
}

#[cfg(test)]
mod tests;
