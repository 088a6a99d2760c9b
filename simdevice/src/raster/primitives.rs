//! Triangle mode of the tile engine: the primitives of a draw, one after another, through coverage, early tests and
//! shading.

use super::batch::{Batch, BlockValues, QUADS, Quad, Samples, at_sample, offset};
use super::coverage::{Coverage, bits};
use super::depth::Tests;
use super::pending::Pending;
use super::prepared::TileDraw;
use super::prepared::Timing;
use super::quads::Quads;
use super::recording::{self, MacroTileWork};
use super::setup::Setup;
use super::tile::{AREA, SIDE};
use crate::geometry::{Primitive, Varyings};
use crate::limits::TILE_SIZE;
use crate::program::fragment::{FragmentMachines, FragmentStage};
use crate::program::interface::FragmentInput;
use crate::raster::batch::add_attributes;
use crate::raster::output::{Buffers, lanes_of};
use crate::raster::setup::Needs;
use crate::raster::tile::{BLOCKS, Tile, block_corner};
use crate::raster::write::{test, write};
use crate::simd::both;
use crate::state::Rect;
use crate::stats::counters::{Counter, Counters};
use crate::stats::optimizations::Optimization;
use devmem::dispatch;
use fearless_simd::{Simd, f32x16, prelude::*};
use isa::exec::{Stopped, Watchdog};
use std::sync::atomic::AtomicBool;

mod full_tile;

use full_tile::FullTile;

/// What a worker needs besides.
#[derive(Debug, Default)]
pub struct Scratch {
    batch: Box<Batch>,
    full: Box<FullTile>,
    pending: Box<Pending>,
}

/// From how many blocks of a tile on it pays to ask whether a primitive is hidden in all of it.
const HIDDEN_BLOCKS: u32 = 6;

/// The macro-tile that a worker renders.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub layer: u32,
    /// Column and row of the macro-tile.
    pub at: [u32; 2],
    /// Its side in pixels.
    pub size: u32,
}

/// Renders what a draw covers of a macro-tile.
///
/// # Errors
/// [`Stopped`] if its program ran for too long, or `cancel` was set.
pub fn render(
    draw: &TileDraw<'_>,
    place: Place,
    buffers: &mut Buffers,
    scratch: &mut Scratch,
    counters: &mut Counters,
    cancel: &AtomicBool,
) -> Result<(), Stopped> {
    let chunks = &draw.draw.chunks;
    if chunks
        .iter()
        .all(|chunk| chunk.bins.of(place.at, place.layer).is_empty())
    {
        return Ok(());
    }
    let record = draw.draw.record.as_ref();
    let before = record.map(|_| counters.clone());
    let mut machines = draw.stage.map(FragmentStage::machines);
    let mut renderer = Renderer {
        draw,
        place,
        buffers,
        batch: &mut scratch.batch,
        full: &mut scratch.full,
        machines: machines.as_mut(),
        counters,
        cancel,
        samples_passed: 0,
        quads_masked: 0,
        work: record.map(|_| MacroTileWork::default()),
    };
    renderer
        .batch
        .begin(draw.needs, place.at, place.size, draw.optimizations);
    let level = draw.level;
    let pending = &mut *scratch.pending;
    pending.clear();
    let done = if draw.positions.len() == 1 {
        dispatch!(level, simd => renderer.run::<_, 1>(simd, pending))
    } else {
        dispatch!(level, simd => renderer.run::<_, 4>(simd, pending))
    };
    let done = done.and_then(|()| renderer.flush());
    let (passed, masked) = (renderer.samples_passed, renderer.quads_masked);
    let work = renderer.work;
    counters.add(Counter::SamplesPassed, passed);
    if draw.optimizations.has(Optimization::MaskedQuads) {
        counters.add(Counter::QuadsMasked, masked);
    }
    if let Some(machines) = machines {
        machines.give_back(counters);
    }
    if let (Some(record), Some(before), Some(work)) = (record, before, work) {
        recording::add_macro_tile(record, place.at, place.size, work, &counters.since(&before));
    }
    done
}

/// A draw in a macro-tile.
pub(super) struct Renderer<'a, 'd> {
    pub draw: &'a TileDraw<'d>,
    pub place: Place,
    pub buffers: &'a mut Buffers,
    pub batch: &'a mut Batch,
    full: &'a mut FullTile,
    pub machines: Option<&'a mut FragmentMachines<'d>>,
    pub counters: &'a mut Counters,
    pub cancel: &'a AtomicBool,
    pub samples_passed: u64,
    /// Quads that were not shaded, because nothing is left of them.
    pub quads_masked: u64,
    /// What is done in each tile, if anybody wants to know.
    pub work: Option<MacroTileWork>,
}

/// A primitive while it is rasterized.
struct Current<'p> {
    primitive: &'p Primitive,
    varyings: &'p Varyings,
    setup: &'p Setup,
    /// Its chunk among the draw's, and its place there.
    place: (usize, u32),
    /// Its record in the batch, once it has one.
    record: Option<u16>,
    /// Where it is kept, once a tile waits for it.
    kept: Option<u8>,
    range: (f32, f32),
}

impl Renderer<'_, '_> {
    /// All primitives.
    #[inline(always)]
    fn run<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        pending: &mut Pending,
    ) -> Result<(), Stopped> {
        let size = self.place.size;
        let whole = Rect {
            x: (self.place.at[0] * size) as i32,
            y: (self.place.at[1] * size) as i32,
            width: size,
            height: size,
        };
        let mut coverage = Coverage::<N>::default();
        let mut setup = Setup::default();
        let draw = self.draw;
        let needs = Needs {
            depth: draw.needs.depth || draw.tests.any(),
            ..draw.needs
        };
        let mut clip = (u8::MAX, Rect { width: 0, ..whole });
        for (number, chunk) in draw.draw.chunks.iter().enumerate() {
            for &index in chunk.bins.of(self.place.at, self.place.layer) {
                let Some(primitive) = chunk.primitives.get(index as usize) else {
                    continue;
                };
                if clip.0 != primitive.viewport {
                    let Some(pixels) = draw.draw.regions.get(usize::from(primitive.viewport))
                    else {
                        continue;
                    };
                    clip = (primitive.viewport, pixels.intersect(whole));
                }
                if !setup.prepare(simd, primitive, draw.positions, clip.1, needs) {
                    continue;
                }
                let mut current = Current {
                    primitive,
                    varyings: &chunk.varyings,
                    setup: &setup,
                    place: (number, index),
                    record: None,
                    kept: None,
                    range: self.depth_range(primitive),
                };
                let corner = [whole.x, whole.y];
                self.primitive(simd, &mut current, &mut coverage, pending, corner)?;
            }
        }
        if N == 1 && draw.defers {
            for tile in 0..(size / TILE_SIZE).pow(2) as usize {
                self.shade_pending(simd, pending, tile)?;
            }
        }
        Ok(())
    }

    /// What a primitive's depth is clamped to.
    #[inline(always)]
    fn depth_range(&self, primitive: &Primitive) -> (f32, f32) {
        let range = self.draw.ranges.get(usize::from(primitive.viewport));
        range.copied().unwrap_or((0.0, 1.0))
    }

    /// One primitive, tile by tile.
    #[inline(always)]
    fn primitive<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        current: &mut Current<'_>,
        coverage: &mut Coverage<N>,
        pending: &mut Pending,
        corner: [i32; 2],
    ) -> Result<(), Stopped> {
        let bounds = current.setup.bounds;
        let first = [
            (bounds.x - corner[0]) / SIDE as i32,
            (bounds.y - corner[1]) / SIDE as i32,
        ];
        let last = [
            (bounds.x + bounds.width as i32 - 1 - corner[0]) / SIDE as i32,
            (bounds.y + bounds.height as i32 - 1 - corner[1]) / SIDE as i32,
        ];
        let side = self.place.size / TILE_SIZE;
        for row in first[1]..=last[1] {
            for column in first[0]..=last[0] {
                let x = corner[0] + column * SIDE as i32;
                let y = corner[1] + row * SIDE as i32;
                let tile = (row as u32 * side + column as u32) as usize;
                let found = coverage.find(simd, current.setup, x, y);
                if let Some(work) = &mut self.work {
                    let blocks = if found {
                        coverage.blocks.count_ones()
                    } else {
                        0
                    };
                    work.list(tile, blocks);
                }
                if found {
                    self.tile(simd, current, coverage, pending, (tile, [x, y]))?;
                }
            }
        }
        Ok(())
    }

    /// What a primitive covers of a tile at pixel `at`, block by block.
    #[inline(always)]
    fn tile<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        current: &mut Current<'_>,
        coverage: &Coverage<N>,
        pending: &mut Pending,
        (tile, at): (usize, [i32; 2]),
    ) -> Result<(), Stopped> {
        let draw = self.draw;
        let early = match draw.timing {
            Timing::Early => Some(&draw.tests).filter(|tests| tests.any()),
            Timing::Late => draw.filter.as_ref(),
        };
        if draw.tests.any() {
            self.touch_tests(tile);
        }
        if let Some(tests) = early
            && coverage.blocks.count_ones() >= HIDDEN_BLOCKS
            && tests.stencil.is_none()
            && draw.optimizations.has(Optimization::HierarchicalDepth)
            && self.is_hidden(simd, tests, current, tile, at)
        {
            if let Some(work) = &mut self.work {
                work.hide(tile, coverage.blocks.count_ones());
            }
            return Ok(());
        }
        if N == 1 && (draw.defers || draw.takes_tiles) {
            if coverage.is_whole() {
                return self.whole_tile(simd, current, coverage, pending, (tile, at));
            }
            if pending.waits(tile) {
                self.shade_pending(simd, pending, tile)?;
                // The batch may have begun anew.
                current.record = None;
            }
        }
        let state = &draw.draw.state;
        let masked = state.sample_mask & ((1 << N) - 1) != (1 << N) - 1;
        let skips_masked = draw.optimizations.has(Optimization::MaskedQuads);
        let mut touched = false;
        for block in bits(coverage.blocks) {
            let mut lanes = coverage.lanes[block];
            if masked {
                for (sample, lanes) in lanes.iter_mut().enumerate() {
                    if state.sample_mask >> sample & 1 == 0 {
                        *lanes = 0;
                    }
                }
            }
            let x = at[0] + (block % 4 * 4) as i32;
            let y = at[1] + (block / 4 * 4) as i32;
            let setup = current.setup;
            let [b1, b2] = setup.barycentrics(x, y);
            let add = |base: f32, lanes: [f32; 16]| f32x16::simd_from(simd, lanes) + base;
            let mut values = BlockValues {
                barycentrics: [f32x16::splat(simd, 0.0); 2],
                depth: f32x16::splat(simd, 0.0),
                inverse_w: f32x16::splat(simd, 1.0),
            };
            if early.is_some() || draw.needs.depth {
                values.depth = add(setup.depth([b1, b2]), setup.lane_depth);
            }
            if let Some(tests) = early {
                let depth = values.depth;
                self.test(simd, tests, current, depth, &mut lanes, (tile, block));
            }
            if let Some(work) = &mut self.work {
                work.test(tile, &coverage.lanes[block], &lanes);
            }
            if !draw.count_late {
                for lanes in lanes {
                    self.samples_passed += u64::from(lanes.count_ones());
                }
            }
            let mut any = 0;
            for lanes in lanes {
                any |= lanes;
            }
            if draw.stage.is_none() {
                continue;
            }
            if any == 0 && (skips_masked || draw.per_sample) {
                self.quads_masked += 4;
                continue;
            }
            let setup = current.setup;
            if draw.needs.barycentrics {
                values.barycentrics = [
                    add(b1 as f32, setup.lane_barycentrics[0]),
                    add(b2 as f32, setup.lane_barycentrics[1]),
                ];
            }
            if draw.needs.inverse_w && !setup.affine {
                values.inverse_w = add(setup.inverse_w([b1, b2]), setup.lane_w);
            }
            if !touched {
                self.touch_colors(tile, coverage);
                touched = true;
            }
            let quad = Quad {
                tile: tile as u8,
                place: (block * 16) as u8,
                ..Quad::default()
            };
            if draw.per_sample {
                for sample in 0..N {
                    if lanes[sample] != 0 {
                        let mut only = [0; N];
                        only[sample] = lanes[sample];
                        let quad = Quad {
                            sample: sample as u8,
                            ..quad
                        };
                        let values = at_sample(&values, current.setup, draw.positions[sample]);
                        self.append(current, quad, &only, &values)?;
                    }
                }
            } else {
                self.append(current, quad, &lanes, &values)?;
            }
        }
        Ok(())
    }

    /// Adds the quads of a block that have samples to the batch, which is shaded when it is full. `quad` is the
    /// block's first.
    #[inline(always)]
    fn append<S: Simd, const N: usize>(
        &mut self,
        current: &mut Current<'_>,
        quad: Quad,
        lanes: &[u16; N],
        values: &BlockValues<S>,
    ) -> Result<(), Stopped> {
        if N == 1 && lanes[0] == u16::MAX && self.batch.count + 4 <= QUADS {
            let record = match current.record {
                Some(record) => record,
                None => self.record(current),
            };
            let mut quads = [Quad {
                record,
                cover: 15,
                ..quad
            }; 4];
            for (number, quad) in quads.iter_mut().enumerate() {
                quad.place += 4 * number as u8;
            }
            self.batch.add_block(quads, values);
            return Ok(());
        }
        let values = values.lanes();
        let skips_masked = self.draw.optimizations.has(Optimization::MaskedQuads);
        for number in 0..4 {
            let mut cover = 0;
            for (sample, lanes) in lanes.iter().enumerate() {
                cover |= (lanes >> (4 * number) & 15) << (4 * sample);
            }
            if cover == 0 && (skips_masked || self.draw.per_sample) {
                self.quads_masked += 1;
                continue;
            }
            if self.batch.count == QUADS {
                self.flush()?;
                current.record = None;
            }
            let record = match current.record {
                Some(record) => record,
                None => self.record(current),
            };
            let quad = Quad {
                place: quad.place + 4 * number as u8,
                record,
                cover,
                ..quad
            };
            self.batch.add(quad, number, &values);
        }
        Ok(())
    }

    fn record(&mut self, current: &mut Current<'_>) -> u16 {
        let Some(stage) = self.draw.stage else {
            return 0;
        };
        let record = self.batch.add_primitive(
            current.primitive,
            current.setup,
            &stage.interface,
            current.varyings,
        );
        current.record = Some(record);
        record
    }

    /// The early tests of a block.
    #[inline(always)]
    fn test<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        tests: &Tests,
        current: &Current<'_>,
        at_centers: f32x16<S>,
        lanes: &mut [u16; N],
        (tile, block): (usize, usize),
    ) {
        let draw = self.draw;
        for (sample, lanes) in lanes.iter_mut().enumerate() {
            if *lanes == 0 {
                continue;
            }
            let mut depth = at_centers;
            if N != 1 {
                let [x, y] = draw.positions[sample];
                let [dx, dy] = current.setup.depth_slopes;
                depth += dx * offset(x) + dy * offset(y);
            }
            let code = tests.code.encode(simd, depth, current.range);
            let first = (tile * N + sample) * AREA + 16 * block;
            let quads = Quads::block(first);
            *lanes = test(
                simd,
                tests,
                *lanes,
                current.primitive.front,
                code,
                &quads,
                self.buffers,
            );
        }
    }

    /// Whether a primitive fails the depth test in all of a tile.
    #[inline(always)]
    fn is_hidden<S: Simd>(
        &mut self,
        simd: S,
        tests: &Tests,
        current: &Current<'_>,
        tile: usize,
        at: [i32; 2],
    ) -> bool {
        if tests.depth.is_none() {
            return false;
        }
        let bounds = current.setup.depth_bounds(at[0], at[1]);
        let (low, high) = current.range;
        let code = |depth: f32| tests.code.encode_one(depth.max(low).min(high));
        let stored = self.buffers.depth.range(simd, tile);
        let hidden = tests.hides(both(bounds, code), stored);
        self.counters.add(Counter::TilesHidden, hidden.into());
        hidden
    }

    /// Shades what the batch has.
    #[inline(never)]
    pub fn flush(&mut self) -> Result<(), Stopped> {
        let programs = self.draw.stage.zip(self.machines.as_mut());
        let Some((stage, machines)) = programs.filter(|_| self.batch.count > 0) else {
            return Ok(());
        };
        let size = usize::from(4 * self.batch.count > crate::program::fragment::BATCH_LANES[0]);
        let (level, draw) = (self.draw.level, self.draw);
        let machine = machines.of_size(size);
        let batch = &mut *self.batch;
        batch.prepare();
        let samples = Samples {
            positions: draw.positions,
            each_shaded: draw.per_sample,
        };
        let affine = dispatch!(level, simd => batch.set_inputs(
            simd, &stage.interface, samples, machine
        ));
        self.counters.add(Counter::BatchesAffine, affine.into());
        let watchdog = Watchdog {
            limit: draw.limit,
            cancel: Some(self.cancel),
        };
        machine.run(
            &batch.active,
            &batch.helpers,
            &draw.bindings.resources(),
            watchdog,
        )?;
        let lanes = (4 * batch.count - batch.helpers.count()) as u64;
        self.counters.add(Counter::FragmentInvocations, lanes);
        let killed = if stage.interface.discards {
            machine.killed()
        } else {
            isa::exec::LaneMask::none()
        };
        let buffers = &mut *self.buffers;
        let passed = dispatch!(level, simd => {
            write(simd, draw, &stage.interface, batch, machine, &killed, buffers)
        });
        self.samples_passed += passed;
        self.batch.clear();
        Ok(())
    }
}

#[cfg(test)]
mod tests;

impl Renderer<'_, '_> {
    /// Makes sure that depth and stencil of a tile are there.
    fn touch_tests(&mut self, tile: usize) {
        let (targets, layer) = (self.draw.targets, self.place.layer);
        if let Some(target) = targets
            .depth
            .filter(|_| !self.buffers.depth.is_touched(tile))
        {
            let tile = self.tile_of(tile);
            self.buffers.depth.touch(target, layer, &tile);
        }
        if let Some(target) = targets
            .stencil
            .filter(|_| !self.buffers.stencil.is_touched(tile))
        {
            let tile = self.tile_of(tile);
            self.buffers.stencil.touch(target, layer, &tile);
        }
    }

    /// Makes sure that a tile of the colours written is there.
    #[inline(always)]
    fn touch_colors<const N: usize>(&mut self, tile: usize, coverage: &Coverage<N>) {
        for (index, output) in self.draw.colors.iter().enumerate() {
            let Some(output) = output else { continue };
            if self.buffers.color[index].is_touched(tile) {
                continue;
            }
            // What is overwritten as a whole need not be loaded or cleared.
            let state = &self.draw.draw.state;
            if self.draw.keeps_all
                && output.overwrites()
                && coverage.is_whole()
                && state.sample_mask & 15 == 15
                && self.draw.optimizations.has(Optimization::OverwrittenTiles)
            {
                self.buffers.color[index].touch_unread(tile);
                self.counters.add(Counter::TilesOverwritten, 1);
            } else if let Some(target) = &self.draw.targets.color[index] {
                let tile = self.tile_of(tile);
                self.buffers.color[index].touch(target, self.place.layer, &tile);
            }
        }
    }

    /// A tile of the macro-tile.
    #[cold]
    fn tile_of(&self, index: usize) -> Tile {
        let side = self.place.size / TILE_SIZE;
        let [column, row] = self.place.at;
        let at = [
            column * side + index as u32 % side,
            row * side + index as u32 / side,
        ];
        let whole = Rect {
            x: (at[0] * TILE_SIZE) as i32,
            y: (at[1] * TILE_SIZE) as i32,
            width: TILE_SIZE,
            height: TILE_SIZE,
        };
        Tile {
            index,
            at,
            pixels: whole.intersect(self.draw.area),
        }
    }

    /// Makes sure that a tile of the colours written is there, of which nothing will be left.
    fn touch_unread(&mut self, tile: usize) {
        if !self.draw.optimizations.has(Optimization::OverwrittenTiles) {
            return self.touch_read(tile);
        }
        for (index, output) in self.draw.colors.iter().enumerate() {
            if output.is_some() && !self.buffers.color[index].is_touched(tile) {
                self.buffers.color[index].touch_unread(tile);
                self.counters.add(Counter::TilesOverwritten, 1);
            }
        }
    }

    /// Makes sure that a tile of the colours written is there, with what it holds.
    fn touch_read(&mut self, tile: usize) {
        for (index, output) in self.draw.colors.iter().enumerate() {
            if output.is_some()
                && !self.buffers.color[index].is_touched(tile)
                && let Some(target) = &self.draw.targets.color[index]
            {
                let tile = self.tile_of(tile);
                self.buffers.color[index].touch(target, self.place.layer, &tile);
            }
        }
    }
}

impl Renderer<'_, '_> {
    /// A tile at pixel `at` that a primitive covers as a whole, in a draw with one sample a pixel.
    #[inline(always)]
    fn whole_tile<S: Simd, const N: usize>(
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
    fn shade_pending<S: Simd>(
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
            if lanes == 0 && self.draw.optimizations.has(Optimization::MaskedQuads) {
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

impl Renderer<'_, '_> {
    /// Shades the tile at pixel `at`, which is there, in a draw that takes tiles at once.
    #[inline(always)]
    fn shade_full_tile<S: Simd>(
        &mut self,
        simd: S,
        current: &mut Current<'_>,
        (tile, at): (usize, [i32; 2]),
    ) -> Result<(), Stopped> {
        let draw = self.draw;
        let Some(stage) = draw.stage else {
            return Ok(());
        };
        // Earlier fragments of the tile come first.
        if self.batch.has_tile(tile) {
            self.flush()?;
            current.record = None;
        }
        let interface = &stage.interface;
        let full = &mut *self.full;
        full.attributes.clear();
        let (primitive, varyings) = (current.primitive, current.varyings);
        add_attributes(primitive, interface, varyings, &mut full.attributes);
        let affine = current.setup.affine && draw.optimizations.has(Optimization::Affine);
        let divides = draw.needs.inverse_w && !affine;
        if draw.needs.barycentrics {
            let needs = Needs {
                inverse_w: divides,
                ..draw.needs
            };
            full.find_barycentrics(simd, current.setup, at, needs);
        }
        let Some(machines) = self.machines.as_mut() else {
            return Ok(());
        };
        let machine = machines.of_size(1);
        for &(slot, kind, place) in &interface.inputs {
            if let FragmentInput::Varying { interpolation, .. } = kind {
                let attribute = full.attributes[place];
                let lanes = machine.input_mut(slot);
                full.interpolate(simd, interpolation, divides, attribute, lanes);
            }
        }
        let undivided = draw.needs.inverse_w && !divides;
        self.counters.add(Counter::BatchesAffine, undivided.into());
        let watchdog = Watchdog {
            limit: draw.limit,
            cancel: Some(self.cancel),
        };
        let resources = draw.bindings.resources();
        machine.run(&full.all, &full.none, &resources, watchdog)?;
        self.counters.add(Counter::FragmentInvocations, AREA as u64);
        for (index, output) in draw.colors.iter().enumerate() {
            if let (Some(output), Some(slots)) = (output, interface.colors.get(index)) {
                let sources = both(*slots, |slots| slots.map(|slot| lanes_of(machine, slot)));
                let plane = &mut self.buffers.color[index];
                let first = plane.start(tile, 0);
                output.write_tile(simd, &sources, first, plane.words_mut());
            }
        }
        Ok(())
    }
}
