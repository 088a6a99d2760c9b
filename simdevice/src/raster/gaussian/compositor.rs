//! Gaussian mode of the tile engine: front to back through a tile's list, with early termination.
//!
//! Most trained Gaussians are a few pixels wide, so a tile is taken as 16 blocks of 4x4 pixels, and lists are worked
//! off in three phases, a round at a time. Phase 1 ([`staging`]) tests a vector of Gaussians against each of the 16
//! blocks, conservatively, and sets their bits in the words of those that they may reach. Phase 2 ([`pixels`]) finds
//! the alphas of all that are reached, and phase 3 takes the blocks in turn, each with its 16 pixels in registers,
//! through their alphas.
//!
//! Exponents are formed from the block's middle: the Cholesky factor times its offset from the mean is computed in
//! binary64 and rounded once, and from there pixels are at most 1.5 away in x and y. Needles that cross many tiles
//! and dust smaller than a pixel lose nothing alike; no position is ever rounded to binary32, and no value depends
//! on where tiles begin. Where no filter widens a Gaussian thinner than a tenth of a pixel, or an opacity far above 1
//! is to be outweighed, exponents are small differences of large numbers: those of such steep Gaussians are formed in
//! binary64 at every pixel.
//!
//! A draw that tests depth leaves out, pixel by pixel, the Gaussians whose centre fails against what was stored before
//! the draw ([`depth_ranges`]). What the tests of a whole draw do to a tile's samples is said in the parent module.
//!
//! [`staging`]: super::staging
//! [`pixels`]: super::pixels
//! [`depth_ranges`]: super::depth_ranges

use super::accumulator::Accumulator;
use super::approximation::Approximation;
use super::by_block::binary16::Half;
use super::by_block::block_kernel::composite_by_block;
use super::by_block::block_lists::BlockLists;
use super::by_block::in_order::InOrder;
use super::by_block::per_pixel::{PerPixel, composite_per_pixel};
use super::by_block::tracking::{Tracked, Tracking};
use super::by_block::wide_sums::WideSums;
use super::depth_ranges::DepthRanges;
use super::fast;
use super::fast::FastScratch;
use super::grid::{BLOCKS, PixelMask, block_and_lane, count, lanes_within};
use super::inputs::{Thresholds, TileCounts, TileInputs};
use super::kernel::Kernel;
use super::mode::{DepthMode, FAST_POWERS, FASTER_POWERS, FIND_MEAN, FIND_REACHED, NO_DEPTH};
use crate::gaussian::BinnedDraw;
use crate::gaussian::bin::sorted_walk::SortedWalk;
use crate::gaussian::view::center_depth::DepthTrend;
use crate::limits::{MAX_SAMPLES, TILE_SIZE};
use crate::stats::counters::{Counter, Counters};
use crate::stats::optimizations::{Optimization, Optimizations};
use crate::stats::recorder::{Run, TileWork};
use devmem::{dispatch, host};
use fearless_simd::Level;

/// Primitives of a piece of a sorted walk. The fast kernel goes on where it was, so that pieces change no bit.
const PIECE: usize = 1024;

/// Layers of a tile: one for each sample, and one to find what is reached at all.
const ACCUMULATORS: usize = MAX_SAMPLES as usize + 1;

/// The part of tile buffer B that Gaussian mode uses.
#[derive(Debug)]
pub struct GaussianTile {
    pub(crate) accumulators: [Accumulator; ACCUMULATORS],
    pub(crate) ranges: DepthRanges,
    fast: FastScratch,
    /// The lists of the kernels that part lists by blocks.
    lists: BlockLists,
    per_pixel: PerPixel,
    /// By accumulator, what a fragment program reads of Gaussians, if it does.
    pub(crate) tracked: Vec<Tracked>,
    /// A piece of a tile's list, where the draw has none.
    piece: Vec<u32>,
}

impl Default for GaussianTile {
    fn default() -> Self {
        Self {
            accumulators: [Accumulator::EMPTY; ACCUMULATORS],
            ranges: DepthRanges::default(),
            fast: FastScratch::default(),
            lists: Default::default(),
            per_pixel: PerPixel::default(),
            tracked: Vec::new(),
            piece: Vec::new(),
        }
    }
}

impl GaussianTile {
    /// Composites `draw`'s Gaussians in the tile at (`tile_x`, `tile_y`), in tiles from the framebuffer's
    /// corner, without tests. Returns whether any pixel was covered.
    pub fn render(
        &mut self,
        draw: &BinnedDraw,
        level: Level,
        tile_x: u32,
        tile_y: u32,
        counters: &mut Counters,
    ) -> bool {
        let at = [tile_x, tile_y];
        let lanes = lanes_within(draw.bounds, at.map(|tile| tile * TILE_SIZE));
        self.run::<NO_DEPTH>(draw, level, at, 0, &lanes, counters);
        self.accumulators[0].covered != [0; BLOCKS]
    }

    /// Composites `draw`'s Gaussians in `lanes` of a tile, into a accumulator.
    pub(crate) fn run<const DEPTH: DepthMode>(
        &mut self,
        draw: &BinnedDraw,
        level: Level,
        [tile_x, tile_y]: [u32; 2],
        accumulator: usize,
        lanes: &PixelMask,
        counters: &mut Counters,
    ) {
        let list = draw.sorted.tiles.list(tile_x, tile_y);
        let to = &mut self.accumulators[accumulator];
        to.clear(lanes);
        if DEPTH == FIND_MEAN {
            to.clear_means();
            if draw.identities().is_some() {
                self.clear_tracked(accumulator);
            }
        }
        if list.is_empty() && draw.sorted.tiles.walk().is_none() {
            return;
        }
        let corner = [tile_x, tile_y].map(|tile| tile * TILE_SIZE);
        let mode = Kernel::of(draw);
        let task = TileInputs {
            splats: &draw.sorted.splats,
            mode,
            list,
            optimizations: draw.optimizations,
            trend: draw.depth_trend,
            half_period: draw.half_period,
            corner,
            thresholds: Thresholds::new(draw, DEPTH),
            way: Approximation::of(&draw.state, &mode, DEPTH),
        };
        let mut runs = draw.record.as_ref().map(|_| Vec::new());
        let work = match draw.sorted.tiles.walk() {
            None => self.composite_list::<DEPTH>(level, &task, accumulator, runs.as_mut()),
            Some(walk) => self.composite_walk::<DEPTH>(level, &task, walk, accumulator, runs.as_mut()),
        };
        if let Some((record, runs)) = draw.record.as_ref().zip(runs) {
            let outside = TILE_SIZE * TILE_SIZE - count(lanes);
            record.add(TileWork {
                at: [tile_x, tile_y],
                listed: work.listed as u32,
                runs,
                contributions: work.contributions,
                terminated: count(&self.accumulators[accumulator].finished()).saturating_sub(outside),
                hidden_rest: work.hidden_rest,
                ..TileWork::default()
            });
        }
        counters.add(Counter::TilePairsEvaluated, work.pairs);
        counters.add(Counter::GaussianTilesHidden, work.tiles_hidden);
        counters.add(Counter::GaussianBlocksHidden, work.blocks_hidden);
        counters.add(Counter::BlockEvaluations, work.items);
        counters.add(Counter::BlocksBesideEllipse, work.open - work.items - work.blocks_hidden);
        counters.add(Counter::BlocksLeftOut, work.blocks_left_out);
        let blocks = (work.listed - work.tiles_hidden) * BLOCKS as u64;
        let saturated = blocks - work.open - work.blocks_left_out;
        counters.add(Counter::BlocksSaturated, saturated);
        counters.add(Counter::PixelContributions, work.contributions);
    }

    /// Resets what is tracked of an accumulator's pixels.
    fn clear_tracked(&mut self, accumulator: usize) {
        if self.tracked.len() <= accumulator {
            host::resize(&mut self.tracked, accumulator + 1, Tracked::EMPTY);
        }
        self.tracked[accumulator] = Tracked::EMPTY;
    }

    /// The pixels of `lanes` that some Gaussian of `draw` reaches with an alpha of the floor or more, whatever its
    /// depth.
    pub(crate) fn reached(
        &mut self,
        draw: &BinnedDraw,
        level: Level,
        [tile_x, tile_y]: [u32; 2],
        lanes: &PixelMask,
    ) -> PixelMask {
        const LAYER: usize = ACCUMULATORS - 1;
        self.accumulators[LAYER].clear(lanes);
        let task = TileInputs {
            splats: &draw.sorted.splats,
            mode: Kernel::of(draw).in_list_order(),
            list: draw.sorted.tiles.list(tile_x, tile_y),
            optimizations: Optimizations::ALL,
            trend: DepthTrend::None,
            half_period: draw.half_period,
            corner: [tile_x, tile_y].map(|tile| tile * TILE_SIZE),
            // The first Gaussian that reaches a pixel finishes it.
            thresholds: Thresholds { transmittance_floor: f32::INFINITY, ..Thresholds::new(draw, FIND_REACHED) },
            way: Approximation::EXACT,
        };
        match draw.sorted.tiles.walk() {
            None => self.composite_list::<FIND_REACHED>(level, &task, LAYER, None),
            Some(walk) => self.composite_walk::<FIND_REACHED>(level, &task, walk, LAYER, None),
        };
        let finished = self.accumulators[LAYER].finished();
        std::array::from_fn(|block| finished[block] & lanes[block])
    }

    /// Composites the task's list by its kernel.
    fn composite_list<const DEPTH: DepthMode>(
        &mut self,
        level: Level,
        task: &TileInputs<'_>,
        accumulator: usize,
        runs: Option<&mut Vec<Run>>,
    ) -> TileCounts {
        let work = match task.mode {
            Kernel::Fast if DEPTH == NO_DEPTH && task.way.powers != NO_DEPTH => {
                self.composite_with_fast_powers(level, task, accumulator, runs)
            }
            Kernel::Fast => {
                let to = (&mut self.accumulators[accumulator], &self.ranges);
                let fast = &mut self.fast;
                dispatch!(level, simd => fast::composite::<_, DEPTH>(fast, simd, task, to, runs))
            }
            _ => self.composite_by_block(level, task, accumulator, runs),
        };
        TileCounts { listed: task.list.len() as u64, ..work }
    }

    /// As the fast kernel, with powers of two of fewer terms. Apart, so that it is there once.
    fn composite_with_fast_powers(
        &mut self,
        level: Level,
        task: &TileInputs<'_>,
        accumulator: usize,
        runs: Option<&mut Vec<Run>>,
    ) -> TileCounts {
        let to = (&mut self.accumulators[accumulator], &self.ranges);
        let fast = &mut self.fast;
        match task.way.powers {
            FASTER_POWERS => dispatch!(level, simd =>
                fast::composite::<_, FASTER_POWERS>(fast, simd, task, to, runs)),
            _ => dispatch!(level, simd =>
                fast::composite::<_, FAST_POWERS>(fast, simd, task, to, runs)),
        }
    }

    /// Composites a tile by another kernel than the fast one.
    fn composite_by_block(
        &mut self,
        level: Level,
        task: &TileInputs<'_>,
        accumulator: usize,
        runs: Option<&mut Vec<Run>>,
    ) -> TileCounts {
        let to = (&mut self.accumulators[accumulator], &self.ranges);
        let lists = &mut self.lists;
        match task.mode {
            Kernel::Half => {
                let kernel = Half::new(&task.thresholds);
                dispatch!(level, simd => composite_by_block(simd, kernel, task, lists, to, runs))
            }
            Kernel::Exact { identities: Some(identities), .. } => {
                let Some(tracked) = self.tracked.get_mut(accumulator) else {
                    return TileCounts::default();
                };
                let kernel = Tracking::new(identities, tracked);
                dispatch!(level, simd => composite_by_block(simd, kernel, task, lists, to, runs))
            }
            Kernel::Exact { depths: Some(depths), .. } => {
                let scratch = &mut self.per_pixel;
                dispatch!(level, simd =>
                    composite_per_pixel(scratch, simd, task, depths, lists, to, runs))
            }
            Kernel::Exact { wide_sums: true, .. } => {
                let kernel = WideSums::new();
                dispatch!(level, simd => composite_by_block(simd, kernel, task, lists, to, runs))
            }
            Kernel::Fast | Kernel::Exact { .. } => {
                let (accumulator, ranges) = to;
                dispatch!(level, simd => {
                    let to = (&mut *accumulator, ranges);
                    let work = composite_by_block(simd, InOrder, task, lists, to, runs);
                    accumulator.find_covered(simd);
                    work
                })
            }
        }
    }

    /// Composites what a tile finds in the sorted sequence, until nothing more can contribute.
    fn composite_walk<const DEPTH: DepthMode>(
        &mut self,
        level: Level,
        task: &TileInputs<'_>,
        walk: &SortedWalk,
        accumulator: usize,
        mut runs: Option<&mut Vec<Run>>,
    ) -> TileCounts {
        let most = match task.mode {
            Kernel::Fast => PIECE,
            // Others part or sort the whole list.
            _ => usize::MAX,
        };
        let tile = task.corner.map(|corner| corner / TILE_SIZE);
        let (mut work, mut from) = (TileCounts::default(), 0);
        let mut piece = std::mem::take(&mut self.piece);
        loop {
            if task.optimizations.has(Optimization::EarlyTermination)
                && dispatch!(level, simd => self.accumulators[accumulator].open_blocks(simd, task.way.light)) == 0
            {
                break;
            }
            walk.next(tile, &mut from, most, &mut piece);
            if piece.is_empty() {
                break;
            }
            let task = TileInputs { list: &piece, ..*task };
            let more = self.composite_list::<DEPTH>(level, &task, accumulator, runs.as_deref_mut());
            work.add(&more);
        }
        self.piece = piece;
        work
    }

    /// The premultiplied colour and coverage (C, 1 - T) of a pixel of the tile, if it was covered.
    pub fn pixel(&self, x: usize, y: usize) -> Option<[f32; 4]> {
        self.sample(0, x, y)
    }

    /// Returns the same as [`GaussianTile::pixel`], of an accumulator.
    fn sample(&self, accumulator: usize, x: usize, y: usize) -> Option<[f32; 4]> {
        let accumulator = &self.accumulators[accumulator];
        let (block, lane) = block_and_lane(x, y);
        let covered = accumulator.covered[block] >> lane & 1 == 1;
        covered.then(|| {
            let [r, g, b] = [0, 1, 2].map(|channel| accumulator.color[channel][block][lane]);
            [r, g, b, 1.0 - accumulator.transmittance[block][lane].abs()]
        })
    }
}
