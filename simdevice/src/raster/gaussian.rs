//! Gaussian mode of the tile engine: front to back through a tile's list, with early termination.
//!
//! Most trained Gaussians are a few pixels wide, so a tile is taken as 16 blocks of 4x4 pixels, and lists are
//! worked off in three phases, a chunk at a time. Phase 1 ([`chunk`]) tests one Gaussian against all 16 blocks in one vector,
//! conservatively, and sets its bit in the words of those that it may reach. Phase 2 ([`pixels`]) finds the alphas of all
//! that are reached, and phase 3 takes the blocks in turn, each with its 16 pixels in registers, through their alphas.
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

mod approximation;
mod by_block;
mod chunk;
mod grid;
mod half;
mod layer;
mod masks;
mod passing;
mod per_pixel;
mod pixels;
pub mod resolve;
mod stream;
pub(crate) mod tile_draw;
mod wide_sums;

use crate::format::depth::DepthEncoding;
use crate::gaussian::depth::Trend;
use crate::gaussian::splat::Splat;
use crate::gaussian::{GaussianDraw, locate};
use crate::limits::TILE_SIZE;
use crate::stats::counters::{Counter, Counters};
use crate::stats::optimizations::{Skip, Skips};
use crate::stats::recorder;
use crate::stats::recorder::{Run, TileWork};
use approximation::Way;
use by_block::TileMode;
use chunk::{Chunk, Reaching, hidden_blocks};
use devmem::dispatch;
use fearless_simd::{Level, Simd, mask32x16, prelude::*};
use layer::{ANY_LIGHT, Lanes, Layer, block_and_lane, count, lanes_within};
use passing::Passing;
use per_pixel::PerPixel;
use pixels::Alphas;
use std::slice;

const TILE: usize = TILE_SIZE as usize;
/// Pixels of a block, which are the lanes of a vector.
const LANES: usize = 16;
/// The side of a block in pixels.
const BLOCK: usize = 4;
/// Blocks of a tile.
const BLOCKS: usize = 16;
/// A bit for each of them.
const ALL_BLOCKS: u64 = (1 << BLOCKS) - 1;
/// Gaussians of a chunk: as many as phases pass on through the first-level cache, and a word has bits.
const CHUNK: usize = 32;

/// Powers of two are formed down to this one.
const MOST_FALL: f64 = 126.0;

/// Layers of a tile: one for each sample, and one to find what is reached at all.
const LAYERS: usize = crate::limits::MAX_SAMPLES as usize + 1;

/// The part of tile buffer B that Gaussian mode uses.
#[derive(Debug)]
pub struct GaussianTile {
    layers: [Layer; LAYERS],
    passing: Passing,
    chunk: Chunk,
    /// Apart, so that both are small enough never to be wanting.
    alphas: Box<Alphas>,
    /// What may reach each block, where a mode parts lists so.
    lists: [Vec<u32>; BLOCKS],
    per_pixel: PerPixel,
    /// A piece of a tile's list, where the draw has none.
    piece: Vec<u32>,
}

/// What the kernel does about depth; a constant, so that what isn't done costs nothing. Each from [`NO_DEPTH`] on does what
/// those from there to it do; before it are those of [`approximation`].
type DepthMode = u8;
/// Nothing: it only finishes the pixels that some Gaussian reaches.
const FIND_REACHED: DepthMode = 0;
/// It composites.
const NO_DEPTH: DepthMode = 3;
/// It leaves out what fails the test.
const TEST_DEPTH: DepthMode = 4;
/// It also finds the median.
const FIND_MEDIAN: DepthMode = 5;
/// And what the mean is made of.
const FIND_MEAN: DepthMode = 6;

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
    depth_unit: DepthEncoding,
    /// The mode, for code that is the same for all of them: where time matters it is a constant.
    depth_mode: DepthMode,
}

impl Thresholds {
    fn new(draw: &GaussianDraw, depth_mode: DepthMode) -> Self {
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
            depth_mode,
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
            chunk: Chunk::default(),
            alphas: Box::default(),
            lists: Default::default(),
            per_pixel: PerPixel::default(),
            piece: Vec::new(),
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
        let list = draw.sorted.tiles.list(tile_x, tile_y);
        let to = &mut self.layers[layer];
        to.clear(lanes);
        if DEPTH == FIND_MEAN {
            to.clear_means();
        }
        if list.is_empty() && draw.sorted.tiles.stream().is_none() {
            return;
        }
        let corner = [tile_x, tile_y].map(|tile| tile * TILE_SIZE);
        let mode = TileMode::of(draw);
        let task = Task {
            splats: &draw.sorted.splats,
            mode,
            list,
            skips: draw.skips,
            trend: draw.depth_trend,
            half_period: draw.half_period,
            corner,
            thresholds: Thresholds::new(draw, DEPTH),
            way: Way::of(&draw.state, &mode, DEPTH),
        };
        let mut runs = draw.record.as_ref().map(|_| Vec::new());
        let work = match draw.sorted.tiles.stream() {
            None => self.composite_list::<DEPTH>(level, &task, layer, runs.as_mut()),
            Some(stream) => {
                self.composite_stream::<DEPTH>(level, &task, stream, layer, runs.as_mut())
            }
        };
        if let Some((record, runs)) = draw.record.as_ref().zip(runs) {
            let outside = TILE_SIZE * TILE_SIZE - count(lanes);
            record.add(TileWork {
                at: [tile_x, tile_y],
                listed: work.listed as u32,
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
        counters.add(Counter::BlocksLeftOut, work.blocks_left_out);
        let blocks = (work.listed - work.tiles_hidden) * BLOCKS as u64;
        let saturated = blocks - work.open - work.blocks_left_out;
        counters.add(Counter::BlocksSaturated, saturated);
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
            splats: &draw.sorted.splats,
            mode: TileMode::of(draw).in_list_order(),
            list: draw.sorted.tiles.list(tile_x, tile_y),
            skips: Skips::ALL,
            trend: Trend::None,
            half_period: draw.half_period,
            corner: [tile_x, tile_y].map(|tile| tile * TILE_SIZE),
            // The first Gaussian that reaches a pixel finishes it.
            thresholds: Thresholds {
                transmittance_floor: f32::INFINITY,
                ..Thresholds::new(draw, FIND_REACHED)
            },
            way: Way::EXACT,
        };
        match draw.sorted.tiles.stream() {
            None => self.composite_list::<FIND_REACHED>(level, &task, LAYER, None),
            Some(stream) => {
                self.composite_stream::<FIND_REACHED>(level, &task, stream, LAYER, None)
            }
        };
        let finished = self.layers[LAYER].finished();
        std::array::from_fn(|block| finished[block] & lanes[block])
    }

    /// Composites the task's list; the way depends on the draw's mode.
    fn composite_list<const DEPTH: DepthMode>(
        &mut self,
        level: Level,
        task: &Task<'_>,
        layer: usize,
        runs: Option<&mut Vec<Run>>,
    ) -> Work {
        let work = match task.mode {
            TileMode::Fast if DEPTH == NO_DEPTH && task.way.has_fast_powers() => {
                self.composite_with_fast_powers(level, task, layer, runs)
            }
            TileMode::Fast => {
                dispatch!(level, simd => self.composite::<_, DEPTH>(simd, task, layer, runs))
            }
            _ => self.composite_by_block(level, task, layer, runs),
        };
        Work {
            listed: task.list.len() as u64,
            ..work
        }
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
        let end_early = task.skips.has(Skip::Saturated);
        for block in 0..BLOCKS {
            layer.find_most_fall(simd, block, task.thresholds);
        }
        for primitive in task.list.iter().take(CHUNK) {
            task.prefetch(Some(primitive));
        }
        for (number, chunk) in task.list.chunks(CHUNK).enumerate() {
            let next_chunk = task.list.get((number + 1) * CHUNK..).unwrap_or_default();
            let open = if end_early {
                layer.open_blocks(simd, task.way.light)
            } else {
                ALL_BLOCKS
            };
            if DEPTH <= NO_DEPTH && end_early && task.way.light != ANY_LIGHT {
                let left_out = layer.open_blocks(simd, ANY_LIGHT) & !open;
                // If no block is open, none will be.
                let of = if open == 0 {
                    task.list.len() - number * CHUNK
                } else {
                    chunk.len()
                };
                work.blocks_left_out += u64::from(left_out.count_ones()) * of as u64;
            }
            if open == 0 {
                break;
            }
            let blocks = open.count_ones() as u8;
            let rows = if runs.is_some() { layer.open_rows() } else { 0 };
            if DEPTH > NO_DEPTH
                && self
                    .passing
                    .hides_from(task.splat(chunk[0]).depth, task.trend)
            {
                let rest = &task.list[number * CHUNK..];
                work.tiles_hidden += rest.len() as u64;
                if let Some(runs) = &mut runs {
                    work.hidden_rest = rest.len() as u32;
                    let open = mask32x16::from_bitmask(simd, open);
                    recorder::push_run(runs, hidden_run(simd, task, rest, (open, rows, blocks)));
                }
                break;
            }
            let (items_before, hidden_before) = (work.items, work);
            let (mut blocks_of_hidden, mut from) = (0, 0);
            let reaching = loop {
                let placed = self.chunk.place::<_, DEPTH>(
                    simd,
                    task,
                    (chunk, from, next_chunk),
                    (open, &self.passing),
                    runs.is_some(),
                );
                work.open += placed.count * u64::from(blocks);
                work.tiles_hidden += placed.tiles_hidden;
                work.blocks_hidden += placed.blocks_hidden;
                blocks_of_hidden += placed.blocks_of_hidden;
                let Some(&primitive) = chunk.get(placed.end) else {
                    break placed.reaching;
                };
                // It is steep; what is before it is composited first.
                work.items += count_bits(&placed.reaching);
                let to = (&self.chunk, &mut *self.alphas);
                let (passing, thresholds) = (&self.passing, task.thresholds);
                work.contributions +=
                    layer.evaluate::<_, DEPTH>(simd, &placed.reaching, to, passing, thresholds);
                let splat = task.splat(primitive);
                let shown = if DEPTH <= NO_DEPTH {
                    open
                } else {
                    open & passing.blocks(simd, splat.depth).to_bitmask()
                };
                let (open, exact) = (u64::from(blocks), u64::from(shown.count_ones()));
                work.open += open;
                work.blocks_hidden += open - exact;
                work.items += exact;
                work.contributions +=
                    layer.evaluate_steep::<_, DEPTH>(simd, splat, shown, passing, task);
                from = placed.end + 1;
            };
            work.pairs += chunk.len() as u64;
            work.items += count_bits(&reaching);
            if let Some(runs) = &mut runs {
                recorder::push_run(
                    runs,
                    Run {
                        primitives: chunk.len() as u32,
                        rows,
                        blocks,
                        reached: (work.items - items_before) as u32,
                        hidden: (work.tiles_hidden - hidden_before.tiles_hidden) as u32,
                        hidden_blocks: blocks_of_hidden
                            + (work.blocks_hidden - hidden_before.blocks_hidden) as u32,
                    },
                );
            }
            let (chunk, passing) = ((&self.chunk, &mut *self.alphas), &self.passing);
            work.contributions +=
                layer.evaluate::<_, DEPTH>(simd, &reaching, chunk, passing, task.thresholds);
        }
        layer.find_covered(simd);
        work
    }
}

/// What a tile's Gaussians are.
#[derive(Clone, Copy)]
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
    way: Way,
}

impl Task<'_> {
    #[inline(always)]
    fn splat(&self, primitive: u32) -> &Splat {
        let (batch, place) = locate(primitive);
        &self.splats[batch][place]
    }

    /// Has a primitive's splat on its way.
    #[inline(always)]
    fn prefetch(&self, primitive: Option<&u32>) {
        if let Some(&primitive) = primitive {
            devmem::prefetch(slice::from_ref(self.splat(primitive)));
        }
    }
}

/// What compositing a tile took.
#[derive(Clone, Copy, Debug, Default)]
struct Work {
    /// Entries of the tile's list, as far as there was need of it.
    listed: u64,
    pairs: u64,
    items: u64,
    /// Blocks that were not finished, summed over the pairs.
    open: u64,
    contributions: u64,
    tiles_hidden: u64,
    blocks_hidden: u64,
    blocks_left_out: u64,
    /// Of the hidden, those that end a list, if work is recorded.
    hidden_rest: u32,
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

/// How many pairs of a block and a Gaussian there are.
fn count_bits(reaching: &Reaching) -> u64 {
    reaching
        .iter()
        .map(|bits| u64::from(bits.count_ones()))
        .sum()
}

#[cfg(test)]
mod tests;
