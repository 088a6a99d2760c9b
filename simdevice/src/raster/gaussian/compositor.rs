//! Gaussian mode of the tile engine: front to back through a tile's list, with early termination.
//!
//! Most trained Gaussians are a few pixels wide, so a tile is divided into 16 blocks of 4x4 pixels. The fast kernel ([`fast`])
//! takes the list in rounds, and the blocks of each round in turn, each with its 16 pixels in registers. The other kernels
//! ([`by_block`](super::by_block)) take one block after the other through its whole list.
//!
//! Exponents are formed from the block's middle: the Cholesky factor times its offset from the mean is computed in
//! binary64 and rounded once, and from there pixels are at most 1.5 away in x and y. Thin Gaussians that cross many tiles
//! and Gaussians smaller than a pixel are equally precise; no position is ever rounded to binary32, and no value depends
//! on where tiles begin. Where no filter widens a Gaussian thinner than a tenth of a pixel, or an opacity far above 1
//! is to be outweighed, exponents are small differences of large numbers: those of such Gaussians
//! ([`needs_f64`](crate::gaussian::splats::splat::Splat::needs_f64)) are formed in binary64 at every pixel.
//!
//! A draw that tests depth leaves out, pixel by pixel, the Gaussians whose centre fails against what was stored before
//! the draw ([`depth_ranges`](super::depth_ranges)). The parent module applies the tests of a whole draw to a tile's samples.

use super::accumulator::Accumulator;
use super::approximation::Approximation;
use super::by_block::binary16::Half;
use super::by_block::block_kernel::composite_by_block;
use super::by_block::block_lists::BlockLists;
use super::by_block::in_order::InOrder;
use super::by_block::per_pixel::{PerPixel, composite_per_pixel};
use super::by_block::tracking::Tracking;
use super::by_block::wide_sums::WideSums;
use super::depth_ranges::DepthRanges;
use super::fast;
use super::fast::FastScratch;
use super::grid::{BLOCKS, PixelMask, block_and_lane, count, lanes_within};
use super::inputs::{Thresholds, TileCounts, TileInputs};
use super::kernel::Kernel;
use super::mode::{Composite, CompositeByCubic, CompositeByQuadratic, DepthMode, Exponential, FindReached, Mode};
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

/// The number of a tile's accumulators.
const ACCUMULATORS: usize = MAX_SAMPLES as usize + 1;

/// The part of tile buffer B that Gaussian mode uses.
#[derive(Debug)]
pub struct GaussianTile {
    /// One for each sample, and one to find what is reached at all.
    pub(crate) accumulators: Vec<Accumulator>,
    pub(crate) ranges: DepthRanges,
    compositor: Compositor,
}

/// The kernels' scratch. One of the kernels composites a tile.
#[derive(Debug, Default)]
struct Compositor {
    fast: FastScratch,
    /// The lists of the kernels that go block by block.
    lists: BlockLists,
    per_pixel: PerPixel,
    /// A piece of a tile's list, where the draw has none.
    piece: Vec<u32>,
}

impl Default for GaussianTile {
    fn default() -> Self {
        let mut accumulators = Vec::new();
        host::resize(&mut accumulators, ACCUMULATORS, Accumulator::EMPTY);
        Self { accumulators, ranges: DepthRanges::default(), compositor: Compositor::default() }
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
        self.run::<Composite>(draw, level, at, 0, &lanes, counters);
        self.accumulators[0].covered != [0; BLOCKS]
    }

    /// Composites `draw`'s Gaussians in `lanes` of a tile, into an accumulator.
    pub(crate) fn run<M: Mode>(
        &mut self,
        draw: &BinnedDraw,
        level: Level,
        [tile_x, tile_y]: [u32; 2],
        accumulator: usize,
        lanes: &PixelMask,
        counters: &mut Counters,
    ) {
        let list = draw.sorted.tiles.list(tile_x, tile_y);
        self.accumulators[accumulator].clear(lanes);
        if M::DEPTH.finds_mean() {
            self.accumulators[accumulator].clear_means();
        }
        if list.is_empty() && draw.sorted.tiles.walk().is_none() {
            return;
        }
        let kernel = Kernel::of(draw);
        let inputs = TileInputs {
            splats: &draw.sorted.splats,
            identities: draw.identities(),
            kernel,
            list,
            optimizations: draw.optimizations,
            trend: draw.depth_trend,
            half_period: draw.half_period,
            corner: [tile_x, tile_y].map(|tile| tile * TILE_SIZE),
            thresholds: Thresholds::new(draw, M::DEPTH),
            approximation: Approximation::of(&draw.state, &kernel, M::DEPTH),
            ranges: &self.ranges,
        };
        let mut runs = draw.record.as_ref().map(|_| Vec::new());
        let mut ids = draw.keeps_ids.then(Vec::new);
        let compositor = &mut self.compositor;
        let accumulator = &mut self.accumulators[accumulator];
        let counts = match draw.sorted.tiles.walk() {
            None => {
                if let Some(ids) = &mut ids {
                    host::extend(ids, list);
                }
                compositor.composite_list::<M>(level, &inputs, accumulator, runs.as_mut())
            }
            Some(walk) => {
                compositor.composite_walk::<M>(level, &inputs, walk, accumulator, runs.as_mut(), ids.as_mut())
            }
        };
        if let Some((record, runs)) = draw.record.as_ref().zip(runs) {
            let outside = TILE_SIZE * TILE_SIZE - count(lanes);
            record.add(TileWork {
                at: [tile_x, tile_y],
                listed: counts.listed as u32,
                runs,
                contributions: counts.contributions,
                terminated: count(&accumulator.finished()).saturating_sub(outside),
                hidden_rest: counts.hidden_rest,
                ids: ids.unwrap_or_default(),
                ..TileWork::default()
            });
        }
        counters.add(Counter::TilePairsEvaluated, counts.pairs);
        counters.add(Counter::GaussianTilesHidden, counts.tiles_hidden);
        counters.add(Counter::GaussianBlocksHidden, counts.blocks_hidden);
        counters.add(Counter::BlockEvaluations, counts.items);
        counters.add(Counter::BlocksBesideEllipse, counts.open - counts.items - counts.blocks_hidden);
        counters.add(Counter::BlocksLeftOut, counts.blocks_left_out);
        let blocks = (counts.listed - counts.tiles_hidden) * BLOCKS as u64;
        let saturated = blocks - counts.open - counts.blocks_left_out;
        counters.add(Counter::BlocksSaturated, saturated);
        counters.add(Counter::PixelContributions, counts.contributions);
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
        let accumulator = &mut self.accumulators[ACCUMULATORS - 1];
        accumulator.clear(lanes);
        let inputs = TileInputs {
            splats: &draw.sorted.splats,
            identities: None,
            kernel: Kernel::of(draw).in_list_order(),
            list: draw.sorted.tiles.list(tile_x, tile_y),
            optimizations: Optimizations::ALL,
            trend: DepthTrend::None,
            half_period: draw.half_period,
            corner: [tile_x, tile_y].map(|tile| tile * TILE_SIZE),
            // The first Gaussian that reaches a pixel finishes it.
            thresholds: Thresholds {
                transmittance_floor: f32::INFINITY,
                ..Thresholds::new(draw, DepthMode::FindReached)
            },
            approximation: Approximation::EXACT,
            ranges: &self.ranges,
        };
        let compositor = &mut self.compositor;
        match draw.sorted.tiles.walk() {
            None => compositor.composite_list::<FindReached>(level, &inputs, accumulator, None),
            Some(walk) => compositor.composite_walk::<FindReached>(level, &inputs, walk, accumulator, None, None),
        };
        let finished = accumulator.finished();
        std::array::from_fn(|block| finished[block] & lanes[block])
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

impl Compositor {
    /// Composites a tile's list by the draw's kernel.
    fn composite_list<M: Mode>(
        &mut self,
        level: Level,
        inputs: &TileInputs<'_>,
        accumulator: &mut Accumulator,
        runs: Option<&mut Vec<Run>>,
    ) -> TileCounts {
        let exponential = inputs.approximation.exponential;
        let counts = match inputs.kernel {
            Kernel::Fast if M::DEPTH == DepthMode::Composite && exponential.is_approximate() => {
                self.composite_approximately(level, inputs, accumulator, runs)
            }
            Kernel::Fast => {
                let fast = &mut self.fast;
                dispatch!(level, simd => fast::composite::<_, M>(fast, simd, inputs, accumulator, runs))
            }
            _ => self.composite_by_block(level, inputs, accumulator, runs),
        };
        TileCounts { listed: inputs.list.len() as u64, ..counts }
    }

    /// Composites by the fast kernel with powers of two of fewer terms. It is a function of its own, so that there is one
    /// for all modes.
    fn composite_approximately(
        &mut self,
        level: Level,
        inputs: &TileInputs<'_>,
        accumulator: &mut Accumulator,
        runs: Option<&mut Vec<Run>>,
    ) -> TileCounts {
        let fast = &mut self.fast;
        match inputs.approximation.exponential {
            Exponential::Quadratic => dispatch!(level, simd =>
                fast::composite::<_, CompositeByQuadratic>(fast, simd, inputs, accumulator, runs)),
            _ => dispatch!(level, simd =>
                fast::composite::<_, CompositeByCubic>(fast, simd, inputs, accumulator, runs)),
        }
    }

    /// Composites a tile by another kernel than the fast one.
    fn composite_by_block(
        &mut self,
        level: Level,
        inputs: &TileInputs<'_>,
        accumulator: &mut Accumulator,
        runs: Option<&mut Vec<Run>>,
    ) -> TileCounts {
        let lists = &mut self.lists;
        match inputs.kernel {
            Kernel::Half => {
                let kernel = Half::new(&inputs.thresholds);
                dispatch!(level, simd => composite_by_block(simd, kernel, inputs, lists, accumulator, runs))
            }
            Kernel::Exact { .. } if let Some(identities) = inputs.identities => {
                let kernel = Tracking::new(identities);
                dispatch!(level, simd => composite_by_block(simd, kernel, inputs, lists, accumulator, runs))
            }
            Kernel::Exact { depths: Some(depths), .. } => {
                let scratch = &mut self.per_pixel;
                dispatch!(level, simd =>
                    composite_per_pixel(scratch, simd, inputs, depths, lists, accumulator, runs))
            }
            Kernel::Exact { wide_sums: true, .. } => {
                let kernel = WideSums::new();
                dispatch!(level, simd => composite_by_block(simd, kernel, inputs, lists, accumulator, runs))
            }
            Kernel::Fast | Kernel::Exact { .. } => dispatch!(level, simd => {
                let counts = composite_by_block(simd, InOrder, inputs, lists, accumulator, runs);
                accumulator.find_covered(simd);
                counts
            }),
        }
    }

    /// Composites what a tile finds in the sorted sequence, until nothing more can contribute, and appends it to `ids`.
    fn composite_walk<M: Mode>(
        &mut self,
        level: Level,
        inputs: &TileInputs<'_>,
        walk: &SortedWalk,
        accumulator: &mut Accumulator,
        mut runs: Option<&mut Vec<Run>>,
        mut ids: Option<&mut Vec<u32>>,
    ) -> TileCounts {
        let most = match inputs.kernel {
            Kernel::Fast => PIECE,
            // Others divide or sort the whole list.
            _ => usize::MAX,
        };
        let tile = inputs.corner.map(|corner| corner / TILE_SIZE);
        let least = inputs.approximation.least_transmittance;
        let (mut counts, mut from) = (TileCounts::default(), 0);
        let mut piece = std::mem::take(&mut self.piece);
        loop {
            if inputs.optimizations.has(Optimization::EarlyTermination)
                && dispatch!(level, simd => accumulator.open_blocks(simd, least)) == 0
            {
                break;
            }
            walk.next(tile, &mut from, most, &mut piece);
            if piece.is_empty() {
                break;
            }
            if let Some(ids) = &mut ids {
                host::extend(ids, &piece);
            }
            let inputs = TileInputs { list: &piece, ..*inputs };
            counts.add(&self.composite_list::<M>(level, &inputs, accumulator, runs.as_deref_mut()));
        }
        self.piece = piece;
        counts
    }
}
