//! Triangle mode of the tile engine: coverage, early tests and shading of the primitives of a draw, in order.

use super::batch::{Batch, BlockValues, QUADS, Quad, add_attributes, at_sample, offset};
use super::coverage::{Coverage, bits};
use super::draw::{Path, TriangleTileDraw};
use super::recording::{self, MacroTileWork};
use super::setup::{Needs, TriangleSetup};
use super::whole_tile::{DeferredTiles, FullTile};
use super::write::{test, write};
use crate::geometry::{Primitive, PrimitiveKind, StyledLine, Varyings};
use crate::limits::TILE_SIZE;
use crate::program::fragment::{FragmentMachines, FragmentStage};
use crate::program::interface::FragmentInput;
use crate::raster::depth_stencil::Tests;
use crate::raster::output::{Buffers, lanes_of};
use crate::raster::tile::{AREA, BLOCKS, SIDE, Tile, block_corner};
use crate::raster::tile_buffer::QuadAddresses;
use crate::simd::both;
use crate::state::Rect;
use crate::stats::counters::{Counter, Counters};
use crate::stats::optimizations::Optimization;
use devmem::dispatch;
use fearless_simd::{Simd, f32x16};
use isa::machine::{Stopped, Watchdog};
use std::sync::atomic::AtomicBool;

/// The memory that a worker reuses from one macro-tile to the next.
#[derive(Debug, Default)]
pub struct Scratch {
    batch: Box<Batch>,
    full: Box<FullTile>,
    deferred: Box<DeferredTiles>,
}

/// The least number of covered blocks of a tile for which a test of the whole tile against stored depths pays.
const HIDDEN_BLOCKS: u32 = 6;

/// The macro-tile that a worker renders.
#[derive(Clone, Copy, Debug)]
pub struct MacroTile {
    pub layer: u32,
    /// The column and row of the macro-tile.
    pub at: [u32; 2],
    /// The side of the macro-tile in pixels.
    pub size: u32,
}

/// Renders a draw in a macro-tile.
pub fn render(
    draw: &TriangleTileDraw<'_>,
    macro_tile: MacroTile,
    buffers: &mut Buffers,
    scratch: &mut Scratch,
    counters: &mut Counters,
    cancel: &AtomicBool,
) -> Result<(), Stopped> {
    let segments = &draw.draw.segments;
    if segments.iter().all(|segment| segment.bins.primitives_of(macro_tile.at, macro_tile.layer).is_empty()) {
        return Ok(());
    }
    let record = draw.draw.record.as_ref();
    let before = record.map(|_| counters.clone());
    let mut machines = draw.stage.map(FragmentStage::machines);
    let mut renderer = Renderer {
        draw,
        macro_tile,
        buffers,
        batch: &mut scratch.batch,
        full: &mut scratch.full,
        machines: machines.as_mut(),
        counters,
        cancel,
        samples_passed: 0,
        quads_masked: 0,
        before_tests: draw.reads_samples_before_tests().then_some([0; 4]),
        work: record.map(|_| MacroTileWork::default()),
    };
    renderer.batch.begin(draw.needs, macro_tile.at, macro_tile.size);
    let level = draw.level;
    let deferred = &mut *scratch.deferred;
    deferred.clear();
    let done = if draw.samples.positions.len() == 1 {
        dispatch!(level, simd => renderer.run::<_, 1>(simd, deferred))
    } else {
        dispatch!(level, simd => renderer.run::<_, 4>(simd, deferred))
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
        recording::add_macro_tile(record, macro_tile.at, macro_tile.size, work, &counters.since(&before));
    }
    done
}

/// The state of rendering a draw in a macro-tile.
pub(super) struct Renderer<'a, 'd> {
    pub draw: &'a TriangleTileDraw<'d>,
    pub macro_tile: MacroTile,
    pub buffers: &'a mut Buffers,
    pub batch: &'a mut Batch,
    full: &'a mut FullTile,
    pub machines: Option<&'a mut FragmentMachines<'d>>,
    pub counters: &'a mut Counters,
    pub cancel: &'a AtomicBool,
    pub samples_passed: u64,
    /// The number of quads that were not shaded, because they have no sample left.
    pub quads_masked: u64,
    /// The lanes of each sample of the current block before early tests, if fragments read them.
    before_tests: Option<[u16; 4]>,
    /// The work in each tile, if there is a recorder.
    pub work: Option<MacroTileWork>,
}

/// A tile of the macro-tile.
#[derive(Clone, Copy)]
struct PlacedTile {
    /// The index in the macro-tile, row by row.
    index: usize,
    /// The framebuffer coordinates of the first pixel.
    corner: [i32; 2],
}

/// A block of a tile of the macro-tile.
#[derive(Clone, Copy)]
struct PlacedBlock {
    /// The index of the tile in the macro-tile.
    tile: usize,
    /// The index of the block in the tile.
    block: usize,
}

/// A primitive during rasterization.
struct RasterPrimitive<'p> {
    primitive: &'p Primitive,
    varyings: &'p Varyings,
    setup: &'p TriangleSetup,
    /// The number of the primitive's segment in the draw, and the primitive's number in the segment.
    place: (usize, u32),
    /// The line that decides its pixels.
    line: Option<&'p StyledLine>,
    /// The primitive's record in the batch, if it has one.
    record: Option<u16>,
    /// The primitive's slot among deferred primitives, if a tile is deferred for it.
    slot: Option<u8>,
    range: (f32, f32),
}

/// The samples of quad `number` of a block, as [`Quad::cover`] has them, of the lanes of each sample of the block.
#[inline(always)]
fn quad_samples(lanes: &[u16], number: usize) -> u16 {
    let samples = lanes.iter().enumerate();
    samples.fold(0, |all, (sample, lanes)| all | (lanes >> (4 * number) & 15) << (4 * sample))
}

impl Renderer<'_, '_> {
    /// Rasterizes all primitives of the macro-tile, then shades deferred tiles.
    #[inline(always)]
    fn run<S: Simd, const N: usize>(&mut self, simd: S, deferred: &mut DeferredTiles) -> Result<(), Stopped> {
        let size = self.macro_tile.size;
        let whole = Rect {
            x: (self.macro_tile.at[0] * size) as i32,
            y: (self.macro_tile.at[1] * size) as i32,
            width: size,
            height: size,
        };
        let mut coverage = Coverage::<N>::default();
        let mut setup = TriangleSetup::default();
        let draw = self.draw;
        let needs = Needs { depth: draw.needs.depth || draw.tests.any(), ..draw.needs };
        let mut clip = (u8::MAX, Rect { width: 0, ..whole });
        for (number, segment) in draw.draw.segments.iter().enumerate() {
            for &index in segment.bins.primitives_of(self.macro_tile.at, self.macro_tile.layer) {
                let Some(primitive) = segment.primitives.get(index as usize) else {
                    continue;
                };
                if clip.0 != primitive.viewport {
                    let Some(pixels) = draw.draw.regions.get(usize::from(primitive.viewport)) else {
                        continue;
                    };
                    clip = (primitive.viewport, pixels.intersect(whole));
                }
                let positions = draw.samples.positions;
                let mut line = None;
                let is_prepared = if primitive.kind == PrimitiveKind::StyledLine {
                    let Some(styled) = segment.line(index).and_then(|place| segment.lines.get(place)) else {
                        continue;
                    };
                    line = Some(styled);
                    setup.prepare_line(simd, primitive, styled, positions, clip.1, needs)
                } else {
                    setup.prepare(simd, primitive, positions, clip.1, needs)
                };
                if !is_prepared {
                    continue;
                }
                let mut raster = RasterPrimitive {
                    primitive,
                    varyings: &segment.varyings,
                    setup: &setup,
                    place: (number, index),
                    line,
                    record: None,
                    slot: None,
                    range: self.depth_range(primitive),
                };
                let corner = [whole.x, whole.y];
                if draw.draw.state.reads_attachments {
                    self.write_through(setup.bounds);
                }
                self.primitive(simd, &mut raster, &mut coverage, deferred, corner)?;
                if draw.draw.state.reads_attachments {
                    self.flush()?;
                }
            }
        }
        if N == 1 && matches!(draw.path, Path::Deferred { .. }) {
            for tile in 0..(size / TILE_SIZE).pow(2) as usize {
                self.shade_deferred(simd, deferred, tile)?;
            }
        }
        Ok(())
    }

    /// Writes the tiles within `bounds` to the attachments' memory, where fragments read them.
    fn write_through(&mut self, bounds: Rect) {
        let MacroTile { layer, at, size } = self.macro_tile;
        for tile in Tile::of_macro_tile(size, at, self.draw.area) {
            if !tile.pixels.intersect(bounds).is_empty() {
                self.buffers.write_through(self.draw.targets, layer, &tile);
            }
        }
    }

    /// The range to which a primitive's depth is clamped.
    #[inline(always)]
    fn depth_range(&self, primitive: &Primitive) -> (f32, f32) {
        let range = self.draw.ranges.get(usize::from(primitive.viewport));
        range.copied().unwrap_or((0.0, 1.0))
    }

    /// Rasterizes one primitive, tile by tile.
    #[inline(always)]
    fn primitive<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        raster: &mut RasterPrimitive<'_>,
        coverage: &mut Coverage<N>,
        deferred: &mut DeferredTiles,
        corner: [i32; 2],
    ) -> Result<(), Stopped> {
        let bounds = raster.setup.bounds;
        let first = [(bounds.x - corner[0]) / SIDE as i32, (bounds.y - corner[1]) / SIDE as i32];
        let last = [
            (bounds.x + bounds.width as i32 - 1 - corner[0]) / SIDE as i32,
            (bounds.y + bounds.height as i32 - 1 - corner[1]) / SIDE as i32,
        ];
        let side = self.macro_tile.size / TILE_SIZE;
        for row in first[1]..=last[1] {
            for column in first[0]..=last[0] {
                let x = corner[0] + column * SIDE as i32;
                let y = corner[1] + row * SIDE as i32;
                let tile = (row as u32 * side + column as u32) as usize;
                let mut found = coverage.find(simd, raster.setup, x, y);
                if let Some(line) = raster.line.filter(|_| found) {
                    let positions = self.draw.samples.positions;
                    coverage.restrict([x, y], |pixel, sample| line.covers(pixel, positions[sample]));
                    found = coverage.blocks != 0;
                }
                if let Some(work) = &mut self.work {
                    let blocks = if found { coverage.blocks.count_ones() } else { 0 };
                    work.list(tile, blocks);
                }
                if found {
                    let tile = PlacedTile { index: tile, corner: [x, y] };
                    self.tile(simd, raster, coverage, deferred, tile)?;
                }
            }
        }
        Ok(())
    }

    /// Processes a tile of which a primitive covers some samples.
    #[inline(always)]
    fn tile<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        raster: &mut RasterPrimitive<'_>,
        coverage: &Coverage<N>,
        deferred: &mut DeferredTiles,
        tile: PlacedTile,
    ) -> Result<(), Stopped> {
        let draw = self.draw;
        if draw.tests.any() {
            self.load_tests(tile.index);
        }
        if let Some(tests) = &draw.early
            && coverage.blocks.count_ones() >= HIDDEN_BLOCKS
            && self.is_hidden(simd, tests, raster, tile)
        {
            if let Some(work) = &mut self.work {
                work.hide(tile.index, coverage.blocks.count_ones());
            }
            return Ok(());
        }
        match draw.path {
            Path::Deferred { .. } | Path::WholeTiles if N == 1 && coverage.is_whole() => {
                return self.whole_tile(simd, raster, coverage, deferred, tile);
            }
            Path::Deferred { .. } if N == 1 && deferred.is_deferred(tile.index) => {
                self.shade_deferred(simd, deferred, tile.index)?;
                // The batch may have been emptied.
                raster.record = None;
            }
            _ => {}
        }
        self.blocks(simd, raster, coverage, tile)
    }

    /// Processes a primitive's covered blocks of a tile as [`Renderer::blocks`] does, in draws where they go to the batch as
    /// they are.
    #[inline(always)]
    fn untested_blocks<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        raster: &mut RasterPrimitive<'_>,
        coverage: &Coverage<N>,
        tile: PlacedTile,
    ) -> Result<(), Stopped> {
        let needs = self.draw.needs;
        let (mut samples, mut loaded) = (0, false);
        for block in bits(coverage.blocks) {
            let lanes = coverage.lanes[block][0];
            if lanes == 0 {
                self.quads_masked += 4;
                continue;
            }
            samples += lanes.count_ones();
            let values = BlockValues::new(simd, raster.setup, block_corner(tile.corner, block), needs);
            if !loaded {
                self.load_colors(tile.index, coverage);
                loaded = true;
            }
            let quad = Quad { tile: tile.index as u8, place: (block * 16) as u8, ..Quad::default() };
            self.append(raster, quad, &[lanes], &values)?;
        }
        if !self.draw.counts_late {
            self.samples_passed += u64::from(samples);
        }
        Ok(())
    }

    /// Processes a primitive's covered blocks of a tile: early tests, then the batch.
    #[inline(always)]
    fn blocks<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        raster: &mut RasterPrimitive<'_>,
        coverage: &Coverage<N>,
        tile: PlacedTile,
    ) -> Result<(), Stopped> {
        let draw = self.draw;
        if N == 1 && draw.appends_untested() {
            return self.untested_blocks(simd, raster, coverage, tile);
        }
        let sample_mask = draw.draw.state.sample_mask;
        let masked = sample_mask & ((1 << N) - 1) != (1 << N) - 1;
        let skips_masked = draw.optimizations.has(Optimization::MaskedQuads);
        let mut loaded = false;
        for block in bits(coverage.blocks) {
            let mut lanes = coverage.lanes[block];
            if masked {
                for (sample, lanes) in lanes.iter_mut().enumerate() {
                    if sample_mask >> sample & 1 == 0 {
                        *lanes = 0;
                    }
                }
            }
            if let Some(before) = &mut self.before_tests {
                before[..N].copy_from_slice(&lanes);
            }
            let setup = raster.setup;
            let [x, y] = block_corner(tile.corner, block);
            let bases = setup.barycentrics(x, y);
            let needs_depth = draw.early.is_some() || draw.needs.depth;
            let mut values = BlockValues::of_depth(simd, setup, bases, needs_depth);
            if let Some(tests) = &draw.early {
                let depth = values.depth;
                self.test(simd, tests, raster, depth, &mut lanes, PlacedBlock { tile: tile.index, block });
            }
            if let Some(work) = &mut self.work {
                work.test(tile.index, &coverage.lanes[block], &lanes);
            }
            if !draw.counts_late {
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
            if any == 0 && (skips_masked || draw.samples.each_shaded) {
                self.quads_masked += 4;
                continue;
            }
            values.find_rest(simd, setup, bases, draw.needs);
            if !loaded {
                self.load_colors(tile.index, coverage);
                loaded = true;
            }
            let quad = Quad { tile: tile.index as u8, place: (block * 16) as u8, ..Quad::default() };
            if draw.samples.each_shaded {
                self.append_samples(raster, quad, &lanes, &values)?;
            } else {
                self.append(raster, quad, &lanes, &values)?;
            }
        }
        Ok(())
    }

    /// Adds the quads of a block as [`Renderer::append`] does, once for each sample with its own values.
    #[inline(always)]
    fn append_samples<S: Simd, const N: usize>(
        &mut self,
        raster: &mut RasterPrimitive<'_>,
        quad: Quad,
        lanes: &[u16; N],
        values: &BlockValues<S>,
    ) -> Result<(), Stopped> {
        for (sample, &covered) in lanes.iter().enumerate() {
            if covered != 0 {
                let mut only = [0; N];
                only[sample] = covered;
                let quad = Quad { sample: sample as u8, ..quad };
                let position = self.draw.samples.positions[sample];
                let values = at_sample(values, raster.setup, position);
                self.append(raster, quad, &only, &values)?;
            }
        }
        Ok(())
    }

    /// Adds the quads of a block that have samples to the batch, which is shaded when it is full. `quad` is the block's
    /// first quad.
    #[inline(always)]
    fn append<S: Simd, const N: usize>(
        &mut self,
        raster: &mut RasterPrimitive<'_>,
        quad: Quad,
        lanes: &[u16; N],
        values: &BlockValues<S>,
    ) -> Result<(), Stopped> {
        let skips_masked = self.draw.optimizations.has(Optimization::MaskedQuads);
        if N == 1 && (skips_masked || lanes[0] == u16::MAX) && self.batch.count + 4 <= QUADS {
            let record = match raster.record {
                Some(record) => record,
                None => self.record(raster),
            };
            if lanes[0] == u16::MAX {
                let mut quads = [Quad { record, cover: 15, ..quad }; 4];
                for (number, quad) in quads.iter_mut().enumerate() {
                    quad.place += 4 * number as u8;
                }
                self.batch.add_block(quads, values);
            } else {
                let left_out = self.batch.add_part(Quad { record, ..quad }, lanes[0], values);
                self.quads_masked += left_out as u64;
            }
            return Ok(());
        }
        self.append_quads(raster, quad, lanes, &values.lanes())
    }

    /// Adds the quads of a block as [`Renderer::append`] does, one by one.
    #[inline(never)]
    fn append_quads<const N: usize>(
        &mut self,
        raster: &mut RasterPrimitive<'_>,
        quad: Quad,
        lanes: &[u16; N],
        values: &[[f32; 16]; 4],
    ) -> Result<(), Stopped> {
        let skips_masked = self.draw.optimizations.has(Optimization::MaskedQuads);
        for number in 0..4 {
            let cover = quad_samples(lanes, number);
            if cover == 0 && (skips_masked || self.draw.samples.each_shaded) {
                self.quads_masked += 1;
                continue;
            }
            if self.batch.count == QUADS {
                self.flush()?;
                raster.record = None;
            }
            let record = match raster.record {
                Some(record) => record,
                None => self.record(raster),
            };
            let quad = Quad { place: quad.place + 4 * number as u8, record, cover, ..quad };
            self.batch.read_masks[self.batch.count] = match &self.before_tests {
                Some(before) => quad_samples(before, number),
                None => cover,
            };
            self.batch.add(quad, number, values);
        }
        Ok(())
    }

    fn record(&mut self, raster: &mut RasterPrimitive<'_>) -> u16 {
        let Some(stage) = self.draw.stage else {
            return 0;
        };
        let record = self.batch.add_primitive(raster.primitive, raster.setup, &stage.interface, raster.varyings);
        if raster.line.is_some() {
            self.batch.records[usize::from(record)].line = Some(raster.place);
        }
        raster.record = Some(record);
        record
    }

    /// Runs the early tests of a block.
    #[inline(always)]
    fn test<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        tests: &Tests,
        raster: &RasterPrimitive<'_>,
        at_centers: f32x16<S>,
        lanes: &mut [u16; N],
        place: PlacedBlock,
    ) {
        let draw = self.draw;
        let PlacedBlock { tile, block } = place;
        for (sample, lanes) in lanes.iter_mut().enumerate() {
            if *lanes == 0 {
                continue;
            }
            let mut depth = at_centers;
            if N != 1 {
                let [x, y] = draw.samples.positions[sample];
                let [dx, dy] = raster.setup.depth_slopes;
                depth += dx * offset(x) + dy * offset(y);
            }
            let code = tests.code.encode(simd, depth, raster.range);
            let first = (tile * N + sample) * AREA + 16 * block;
            let quads = QuadAddresses::block(first);
            *lanes = test(simd, tests, *lanes, raster.primitive.front, code, &quads, self.buffers);
        }
    }

    /// True if a primitive fails the depth test in all of a tile. False if the mode or the optimizations do not allow
    /// this test.
    #[inline(always)]
    fn is_hidden<S: Simd>(&mut self, simd: S, tests: &Tests, raster: &RasterPrimitive<'_>, tile: PlacedTile) -> bool {
        let looks = tests.stencil.is_none()
            && self.draw.optimizations.has(Optimization::HierarchicalDepth)
            && tests.depth.is_some();
        if !looks {
            return false;
        }
        let [x, y] = tile.corner;
        let bounds = raster.setup.depth_bounds(x, y);
        let (low, high) = raster.range;
        let code = |depth: f32| tests.code.encode_one(depth.max(low).min(high));
        let stored = self.buffers.depth.range(simd, tile.index);
        let hidden = tests.hides(both(bounds, code), stored);
        self.counters.add(Counter::TilesHidden, hidden.into());
        hidden
    }

    /// Shades the quads of the batch and empties it.
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
        let affine = dispatch!(level, simd => batch.set_inputs(
            simd, &stage.interface, draw.samples, machine
        ));
        self.counters.add(Counter::BatchesAffine, affine.into());
        let watchdog = Watchdog { limit: draw.limit, cancel: Some(self.cancel) };
        machine.run(&batch.active, &batch.helpers, &draw.bound.resources(), watchdog)?;
        let lanes = (4 * batch.count - batch.helpers.count()) as u64;
        self.counters.add(Counter::FragmentInvocations, lanes);
        let killed = if stage.interface.discards { machine.killed_words() } else { &[] };
        let buffers = &mut *self.buffers;
        let passed = dispatch!(level, simd => {
            write(simd, draw, &stage.interface, batch, machine, killed, buffers)
        });
        self.samples_passed += passed;
        self.batch.clear();
        Ok(())
    }

    /// Loads or clears depth and stencil of a tile if it was not touched yet.
    fn load_tests(&mut self, tile: usize) {
        let (targets, layer) = (self.draw.targets, self.macro_tile.layer);
        if let Some(target) = targets.depth.filter(|_| !self.buffers.depth.is_touched(tile)) {
            let tile = self.tile_of(tile);
            self.buffers.depth.load_or_clear(target, layer, &tile);
        }
        if let Some(target) = targets.stencil.filter(|_| !self.buffers.stencil.is_touched(tile)) {
            let tile = self.tile_of(tile);
            self.buffers.stencil.load_or_clear(target, layer, &tile);
        }
    }

    /// Loads or clears the colours of a tile that the draw writes, if it was not touched yet.
    #[inline(always)]
    fn load_colors<const N: usize>(&mut self, tile: usize, coverage: &Coverage<N>) {
        for (index, output) in self.draw.colors.iter().enumerate() {
            let Some(output) = output else { continue };
            if self.buffers.color[index].is_touched(tile) {
                continue;
            }
            // Texels that are all overwritten need not be loaded or cleared.
            let state = &self.draw.draw.state;
            if self.draw.writes_all()
                && output.overwrites()
                && coverage.is_whole()
                && state.sample_mask & 15 == 15
                && self.draw.optimizations.has(Optimization::OverwrittenTiles)
            {
                self.buffers.color[index].mark_overwritten(tile);
                self.counters.add(Counter::TilesOverwritten, 1);
            } else if let Some(target) = &self.draw.targets.color[index] {
                let tile = self.tile_of(tile);
                self.buffers.color[index].load_or_clear(target, self.macro_tile.layer, &tile);
            }
        }
    }

    /// The tile with an index in the macro-tile.
    #[cold]
    fn tile_of(&self, index: usize) -> Tile {
        let side = self.macro_tile.size / TILE_SIZE;
        let [column, row] = self.macro_tile.at;
        let at = [column * side + index as u32 % side, row * side + index as u32 / side];
        let whole =
            Rect { x: (at[0] * TILE_SIZE) as i32, y: (at[1] * TILE_SIZE) as i32, width: TILE_SIZE, height: TILE_SIZE };
        Tile { index, at, pixels: whole.intersect(self.draw.area) }
    }

    /// Marks the colours of a tile as overwritten, or loads them if that optimization is disabled.
    fn mark_colors_overwritten(&mut self, tile: usize) {
        if !self.draw.optimizations.has(Optimization::OverwrittenTiles) {
            return self.load_colors_written(tile);
        }
        for (index, output) in self.draw.colors.iter().enumerate() {
            if output.is_some() && !self.buffers.color[index].is_touched(tile) {
                self.buffers.color[index].mark_overwritten(tile);
                self.counters.add(Counter::TilesOverwritten, 1);
            }
        }
    }

    /// Loads or clears the colours of a tile that the draw writes, if it was not touched yet, even if they will be
    /// overwritten.
    fn load_colors_written(&mut self, tile: usize) {
        for (index, output) in self.draw.colors.iter().enumerate() {
            if output.is_some()
                && !self.buffers.color[index].is_touched(tile)
                && let Some(target) = &self.draw.targets.color[index]
            {
                let tile = self.tile_of(tile);
                self.buffers.color[index].load_or_clear(target, self.macro_tile.layer, &tile);
            }
        }
    }

    /// Processes a tile that a primitive covers completely, in a draw with one sample per pixel.
    #[inline(always)]
    fn whole_tile<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        raster: &mut RasterPrimitive<'_>,
        coverage: &Coverage<N>,
        deferred: &mut DeferredTiles,
        tile: PlacedTile,
    ) -> Result<(), Stopped> {
        let draw = self.draw;
        let (mut lanes, mut passed) = ([u16::MAX; BLOCKS], AREA as u64);
        if draw.tests.any() {
            passed = 0;
            for (block, lanes) in lanes.iter_mut().enumerate() {
                let [x, y] = block_corner(tile.corner, block);
                let bases = raster.setup.barycentrics(x, y);
                let depth = BlockValues::of_depth(simd, raster.setup, bases, true).depth;
                let mut only = [*lanes];
                let place = PlacedBlock { tile: tile.index, block };
                self.test(simd, &draw.tests, raster, depth, &mut only, place);
                *lanes = only[0];
                passed += u64::from(lanes.count_ones());
            }
        }
        self.samples_passed += passed;
        if passed == AREA as u64 {
            if matches!(draw.path, Path::Deferred { .. }) {
                self.defer(raster, deferred, tile.index);
                return Ok(());
            }
            self.load_colors(tile.index, coverage);
        }
        if deferred.is_deferred(tile.index) {
            self.shade_deferred(simd, deferred, tile.index)?;
            // The batch may have been emptied.
            raster.record = None;
        }
        self.shade_tile(simd, raster, tile, &lanes)
    }

    /// Defers a tile of a primitive whose samples all pass.
    #[inline(always)]
    fn defer(&mut self, raster: &mut RasterPrimitive<'_>, deferred: &mut DeferredTiles, tile: usize) {
        self.mark_colors_overwritten(tile);
        let slot = match raster.slot {
            Some(slot) => slot,
            None => {
                let (segment, primitive) = raster.place;
                *raster.slot.insert(deferred.add(raster.setup, segment, primitive))
            }
        };
        if deferred.defer(tile, slot) {
            self.counters.add(Counter::QuadsOverwritten, AREA as u64 / 4);
        }
    }

    /// Shades a tile if it is deferred.
    fn shade_deferred<S: Simd>(&mut self, simd: S, deferred: &mut DeferredTiles, tile: usize) -> Result<(), Stopped> {
        let Some(waiting) = deferred.take(tile) else {
            return Ok(());
        };
        let draw = self.draw;
        let segment = &draw.draw.segments[waiting.segment];
        let primitive = &segment.primitives[waiting.primitive as usize];
        let mut raster = RasterPrimitive {
            primitive,
            varyings: &segment.varyings,
            setup: &waiting.setup,
            place: (waiting.segment, waiting.primitive),
            // Its pixels are known, and it is not smooth.
            line: None,
            record: None,
            slot: None,
            range: self.depth_range(primitive),
        };
        let side = (self.macro_tile.size / TILE_SIZE) as usize;
        let place = [tile % side, tile / side];
        let corner =
            [0, 1].map(|axis| (self.macro_tile.at[axis] * self.macro_tile.size) as i32 + (place[axis] * SIDE) as i32);
        let tile = PlacedTile { index: tile, corner };
        simd.vectorize(
            #[inline(always)]
            || self.shade_tile(simd, &mut raster, tile, &[u16::MAX; BLOCKS]),
        )
    }

    /// Shades the given lanes of a tile's blocks, which have passed all tests, in a draw with one sample per pixel.
    #[inline(always)]
    fn shade_tile<S: Simd>(
        &mut self,
        simd: S,
        raster: &mut RasterPrimitive<'_>,
        tile: PlacedTile,
        lanes: &[u16; BLOCKS],
    ) -> Result<(), Stopped> {
        if self.draw.path.batches_tiles() && *lanes == [u16::MAX; BLOCKS] {
            self.load_colors_written(tile.index);
            return self.shade_full_tile(simd, raster, tile);
        }
        let needs = self.draw.needs;
        let mut loaded = false;
        for (block, &lanes) in lanes.iter().enumerate() {
            if lanes == 0 && self.draw.optimizations.has(Optimization::MaskedQuads) {
                self.quads_masked += 4;
                continue;
            }
            let corner = block_corner(tile.corner, block);
            let values = BlockValues::new(simd, raster.setup, corner, needs);
            if !loaded {
                self.load_colors_written(tile.index);
                loaded = true;
            }
            let quad = Quad { tile: tile.index as u8, place: (block * 16) as u8, ..Quad::default() };
            self.append(raster, quad, &[lanes], &values)?;
        }
        Ok(())
    }

    /// Shades a completely covered tile as a batch of its own. Its colours must be loaded.
    #[inline(always)]
    fn shade_full_tile<S: Simd>(
        &mut self,
        simd: S,
        raster: &mut RasterPrimitive<'_>,
        tile: PlacedTile,
    ) -> Result<(), Stopped> {
        let draw = self.draw;
        let Some(stage) = draw.stage else {
            return Ok(());
        };
        // Earlier fragments of the tile are shaded first.
        if self.batch.has_tile(tile.index) {
            self.flush()?;
            raster.record = None;
        }
        let interface = &stage.interface;
        let full = &mut *self.full;
        full.attributes.clear();
        let (primitive, varyings) = (raster.primitive, raster.varyings);
        add_attributes(primitive, interface, varyings, &mut full.attributes);
        let divides = draw.needs.inverse_w && !raster.setup.affine;
        if draw.needs.barycentrics {
            let needs = Needs { inverse_w: divides, ..draw.needs };
            full.find_barycentrics(simd, raster.setup, tile.corner, needs);
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
        let watchdog = Watchdog { limit: draw.limit, cancel: Some(self.cancel) };
        let resources = draw.bound.resources();
        machine.run(&full.all, &full.none, &resources, watchdog)?;
        self.counters.add(Counter::FragmentInvocations, AREA as u64);
        for (index, output) in draw.colors.iter().enumerate() {
            if let (Some(output), Some(slots)) = (output, interface.colors.get(index)) {
                let sources = both(*slots, |slots| slots.map(|slot| lanes_of(machine, slot)));
                let buffer = &mut self.buffers.color[index];
                let first = buffer.start(tile.index, 0);
                output.write_tile(simd, &sources, first, buffer.words_mut());
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
