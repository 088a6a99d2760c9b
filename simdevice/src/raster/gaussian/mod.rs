//! A Gaussian draw in a tile: depth bounds and stencil first, then the kernel with its depth test, then the blended
//! colour, the median depth and the stencil, each once.
//!
//! Alpha is that of the pixel's centre, so samples of a pixel differ only in what their tests let pass. The kernel runs
//! once for all samples that agree in all of a block, and again only in the blocks of a tile where some differ.

mod accumulator;
mod approximation;
mod by_block;
mod compositor;
mod cut_off;
mod depth_ranges;
mod exponent;
mod fast;
mod fragment_stage;
mod grid;
mod inputs;
mod kernel;
mod masks;
mod mode;
mod pixels;
mod reached_blocks;
mod samples;

pub use compositor::GaussianTile;

use crate::gaussian::BinnedDraw;
use crate::limits::TILE_SIZE;
use crate::raster::color::ColorOutput;
use crate::raster::depth_stencil::{Tests, apply};
use crate::raster::output::{Buffers, Targets};
use crate::raster::tile::{AREA, Tile};
use crate::raster::tile_buffer::{QuadAddresses, Target};
use crate::runtime::Runtime;
use crate::state::{BlendState, StencilFace, StencilOp};
use crate::stats::counters::{Counter, Counters};
use depth_ranges::DepthRanges;
use devmem::dispatch;
use fearless_simd::{Level, Simd, f32x16, prelude::*};
use fragment_stage::{FragmentStageDraw, Tools};
use grid::{BLOCK_PIXELS, BLOCKS, PixelMask, count, lanes_within};
use isa::machine::Stopped;
use mode::{Composite, FindMean, FindMedian, Mode, TestDepth, Track};
use samples::{SAMPLES, Samples};
use std::sync::atomic::AtomicBool;

/// A Gaussian draw made ready for tiles, which all workers share.
pub struct GaussianTileDraw<'a> {
    draw: &'a BinnedDraw,
    targets: Targets<'a>,
    /// The first colour attachment, unless the draw leaves it as it is.
    color: Option<ColorOutput>,
    /// The resolve shader that makes colours in its place.
    resolve: Option<FragmentStageDraw<'a>>,
    tests: Tests,
    /// Samples of a pixel.
    samples: usize,
    level: Level,
}

impl<'a> GaussianTileDraw<'a> {
    /// Makes a draw ready. `samples` are the attachments' samples, if there are attachments.
    pub fn new(draw: &'a BinnedDraw, targets: Targets<'a>, samples: Option<u32>, runtime: &Runtime) -> Self {
        const REPLACE: BlendState = BlendState { equations: None, write_mask: 0xF };
        let state = &*draw.state;
        let format = targets.color.first().and_then(Option::as_ref);
        let color = format
            .map(Target::format)
            // A draw's floating-point colours mean nothing to an integer attachment.
            .filter(|format| !format.is_integer())
            .and_then(|format| {
                let blend = state.blend.first().unwrap_or(&REPLACE);
                ColorOutput::new(blend, state.logic_op, state.blend_constants, format)
            });
        let depth = targets.depth.map(Target::format);
        let samples = samples.map_or(1, |samples| samples as usize).min(SAMPLES);
        let fragment_stage = draw.fragment_stage.as_ref();
        Self {
            draw,
            targets,
            color,
            resolve: fragment_stage.map(|stage| FragmentStageDraw::new(draw, stage, targets, samples, runtime)),
            tests: Tests::new(&state.depth_stencil, depth, targets.stencil.is_some()),
            samples,
            level: runtime.level(),
        }
    }

    /// The layer that it is drawn to.
    pub fn layer(&self) -> u32 {
        self.draw.layer
    }

    /// Renders what it covers of a tile of its layer.
    ///
    /// # Errors
    /// [`Stopped`] if its resolve shader ran for too long, or `cancel` was set.
    pub fn render(
        &self,
        tile: &Tile,
        buffers: &mut Buffers,
        gaussian_tile: &mut GaussianTile,
        counters: &mut Counters,
        cancel: &AtomicBool,
    ) -> Result<(), Stopped> {
        if !self.draw.touches(tile.pixels) {
            return Ok(());
        }
        if let Some(target) = self.targets.depth.filter(|_| self.tests.reads_depth()) {
            buffers.depth.load_or_clear(target, self.draw.layer, tile);
        }
        if let Some(target) = self.targets.stencil.filter(|_| self.tests.stencil.is_some()) {
            buffers.stencil.load_or_clear(target, self.draw.layer, tile);
        }
        let mut samples = self.test_first(tile, buffers);
        let resolve = self.resolve.as_ref();
        match self.tests.depth {
            _ if resolve.is_some_and(FragmentStageDraw::is_tracking) => {
                self.composite::<Track>(tile, &mut samples, buffers, gaussian_tile, counters);
            }
            _ if resolve.is_some_and(FragmentStageDraw::reads_depth) => {
                self.composite::<FindMean>(tile, &mut samples, buffers, gaussian_tile, counters);
            }
            None => self.composite::<Composite>(tile, &mut samples, buffers, gaussian_tile, counters),
            Some((_, false)) => {
                self.composite::<TestDepth>(tile, &mut samples, buffers, gaussian_tile, counters);
            }
            Some((_, true)) => {
                self.composite::<FindMedian>(tile, &mut samples, buffers, gaussian_tile, counters);
            }
        }
        let mut covered: [PixelMask; SAMPLES] = std::array::from_fn(|sample| {
            std::array::from_fn(|block| {
                let accumulator = &gaussian_tile.accumulators[samples.accumulators[sample][block]];
                accumulator.covered[block] & samples.tested[sample][block]
            })
        });
        let mut shaded = covered;
        if let Some(resolve) = &self.resolve
            && covered != [[0; BLOCKS]; SAMPLES]
        {
            let mut done = Counters::default();
            let mut tools = Tools { buffers, gaussian_tile, counters: &mut done, cancel };
            let ran = resolve.run(tile, &samples, &mut shaded, &mut tools);
            counters.add_all(&done);
            if let Some(record) = &self.draw.record {
                record.add_shading(&done);
            }
            ran?;
            if !resolve.tests_early() {
                samples.leave(&covered, &shaded);
                covered = shaded;
            }
        }
        let passed: u32 = covered.iter().take(self.samples).map(count).sum();
        counters.add(Counter::SamplesPassed, passed.into());
        if passed > 0 {
            if self.resolve.is_none() {
                self.write_color(tile, &samples, &covered, buffers, gaussian_tile);
            }
            if self.tests.depth.is_some_and(|(_, write)| write) {
                self.write_depth(tile, &samples, &covered, buffers, gaussian_tile);
            }
        }
        if let Some([face, _]) = &self.tests.stencil {
            self.write_stencil(face, tile, &samples, &covered, buffers, gaussian_tile);
        }
        Ok(())
    }

    /// Marks what a resolve shader may have written to as changed.
    pub fn finish(&self) {
        if let Some(resolve) = &self.resolve {
            resolve.finish();
        }
    }

    /// Finds the samples that depth bounds and stencil let pass.
    fn test_first(&self, tile: &Tile, buffers: &mut Buffers) -> Samples {
        let corner = tile.at.map(|at| at * TILE_SIZE);
        let touched = lanes_within(self.draw.bounds.intersect(tile.pixels), corner);
        let mut samples = Samples::default();
        for sample in 0..self.samples {
            if self.draw.state.sample_mask >> sample & 1 == 0 {
                continue;
            }
            let mut lanes = touched;
            if let Some([least, greatest]) = self.tests.bounds {
                let start = buffers.depth.start(tile.index, sample);
                let stored = &buffers.depth.words_mut()[start..][..AREA];
                keep(&mut lanes, stored, |depth| (least..=greatest).contains(&depth));
            }
            samples.candidates[sample] = lanes;
            if let Some([face, _]) = &self.tests.stencil {
                let start = buffers.stencil.start(tile.index, sample);
                let stored = &buffers.stencil.bytes_mut()[start..][..AREA];
                let reference = face.reference & face.compare_mask;
                keep(&mut lanes, stored, |stencil| face.compare.holds(reference, stencil & face.compare_mask));
            }
            samples.tested[sample] = lanes;
        }
        samples
    }

    /// Runs the kernel for every sample, in the blocks where no earlier one had the same tests.
    fn composite<M: Mode>(
        &self,
        tile: &Tile,
        samples: &mut Samples,
        buffers: &mut Buffers,
        gaussian_tile: &mut GaussianTile,
        counters: &mut Counters,
    ) {
        for sample in 0..self.samples {
            let mut lanes = samples.tested[sample];
            for (block, lanes) in lanes.iter_mut().enumerate() {
                let same = |earlier: &usize| {
                    let tested = &samples.tested;
                    tested[*earlier][block] == tested[sample][block]
                        && (self.tests.depth.is_none()
                            || self.have_equal_depths(tile, buffers, [*earlier, sample], block, *lanes))
                };
                let accumulator = (0..sample).find(same).unwrap_or(sample);
                samples.accumulators[sample][block] = samples.accumulators[accumulator][block];
                if accumulator == sample {
                    samples.accumulators[sample][block] = sample;
                } else {
                    *lanes = 0;
                }
            }
            if lanes == [0; BLOCKS] && sample > 0 {
                continue;
            }
            if let Some((op, _)) = self.tests.depth {
                let start = buffers.depth.start(tile.index, sample);
                let stored = &buffers.depth.words_mut()[start..][..AREA];
                gaussian_tile.ranges.set(op, stored, &lanes);
            } else if M::DEPTH.tests() {
                gaussian_tile.ranges = DepthRanges::default();
            }
            gaussian_tile.run::<M>(self.draw, self.level, tile.at, sample, &lanes, counters);
        }
    }

    /// True if two samples have the same stored depths at `lanes` of a block. Elsewhere the buffer holds what was there before.
    fn have_equal_depths(&self, tile: &Tile, buffers: &Buffers, samples: [usize; 2], block: usize, lanes: u32) -> bool {
        let [a, b] = samples.map(|sample| self.depths(tile, buffers, sample, block));
        let mut pairs = a.into_iter().zip(b).enumerate();
        pairs.all(|(lane, (a, b))| a == b || lanes >> lane & 1 == 0)
    }

    /// A sample's stored depths in a block.
    fn depths(&self, tile: &Tile, buffers: &Buffers, sample: usize, block: usize) -> [u32; BLOCK_PIXELS] {
        let start = buffers.depth.start(tile.index, sample) + block * BLOCK_PIXELS;
        let mut depths = [0; BLOCK_PIXELS];
        depths.copy_from_slice(&buffers.depth.words()[start..][..BLOCK_PIXELS]);
        depths
    }

    /// Blends the covered samples' colours.
    fn write_color(
        &self,
        tile: &Tile,
        samples: &Samples,
        covered: &[PixelMask; SAMPLES],
        buffers: &mut Buffers,
        gaussian_tile: &GaussianTile,
    ) {
        let target = self.targets.color.first().and_then(Option::as_ref);
        let (Some(output), Some(target), Some(plane)) = (&self.color, target, buffers.color.first_mut()) else {
            return;
        };
        plane.load_or_clear(target, self.draw.layer, tile);
        for (sample, lanes) in covered.iter().enumerate().take(self.samples) {
            let start = plane.start(tile.index, sample);
            let accumulators = &samples.accumulators[sample];
            let words = plane.words_mut();
            dispatch!(self.level, simd =>
                blend(simd, output, gaussian_tile, accumulators, lanes, start, words));
        }
        plane.changed(tile.index);
    }

    /// Stores the covered samples' median depths.
    fn write_depth(
        &self,
        tile: &Tile,
        samples: &Samples,
        covered: &[PixelMask; SAMPLES],
        buffers: &mut Buffers,
        gaussian_tile: &GaussianTile,
    ) {
        for (sample, covered) in covered.iter().enumerate().take(self.samples) {
            let start = buffers.depth.start(tile.index, sample);
            let stored = &mut buffers.depth.words_mut()[start..][..AREA];
            for (block, stored) in stored.as_chunks_mut::<BLOCK_PIXELS>().0.iter_mut().enumerate() {
                let accumulator = &gaussian_tile.accumulators[samples.accumulators[sample][block]];
                for (lane, stored) in stored.iter_mut().enumerate() {
                    if covered[block] >> lane & 1 == 1 {
                        *stored = accumulator.median[block][lane];
                    }
                }
            }
        }
        buffers.depth.changed(tile.index);
    }

    /// Does what the tests' results ask for.
    fn write_stencil(
        &self,
        face: &StencilFace,
        tile: &Tile,
        samples: &Samples,
        covered: &[PixelMask; SAMPLES],
        buffers: &mut Buffers,
        gaussian_tile: &mut GaussianTile,
    ) {
        if face.write_mask == 0 {
            return;
        }
        // A sample that fails has a fragment where some Gaussian reaches it.
        let mut reached = [0; BLOCKS];
        if [face.fail, face.depth_fail] != [StencilOp::Keep; 2] {
            for (block, reached) in reached.iter_mut().enumerate() {
                for (candidates, covered) in samples.candidates.iter().zip(covered) {
                    *reached |= candidates[block] & !covered[block];
                }
            }
            reached = gaussian_tile.reached(self.draw, self.level, tile.at, &reached);
        }
        for (sample, covered) in covered.iter().enumerate().take(self.samples) {
            let start = buffers.stencil.start(tile.index, sample);
            let stored = &mut buffers.stencil.bytes_mut()[start..][..AREA];
            for (at, stored) in stored.iter_mut().enumerate() {
                let (block, lane) = (at / BLOCK_PIXELS, at % BLOCK_PIXELS);
                let is = |lanes: u32| lanes >> lane & 1 == 1;
                let op = if is(covered[block]) {
                    face.pass
                } else if !is(samples.candidates[sample][block] & reached[block]) {
                    continue;
                } else if is(samples.tested[sample][block]) {
                    face.depth_fail
                } else {
                    face.fail
                };
                let value = apply(op, *stored, face.reference);
                *stored = *stored & !face.write_mask | value & face.write_mask;
            }
        }
    }
}

/// Takes away the lanes whose stored value, in the order of blocks, does not pass.
fn keep<T: Copy>(lanes: &mut PixelMask, stored: &[T], passes: impl Fn(T) -> bool) {
    for (lanes, stored) in lanes.iter_mut().zip(stored.as_chunks::<BLOCK_PIXELS>().0) {
        for (lane, &stored) in stored.iter().enumerate() {
            if !passes(stored) {
                *lanes &= !(1 << lane);
            }
        }
    }
}

/// Blends one sample of a tile, whose first texel is `start`.
#[inline(always)]
fn blend<S: Simd>(
    simd: S,
    output: &ColorOutput,
    gaussian_tile: &GaussianTile,
    accumulators: &[usize; BLOCKS],
    covered: &PixelMask,
    start: usize,
    words: &mut [u32],
) {
    let no_second = [f32x16::splat(simd, 0.0); 4];
    for (block, &lanes) in covered.iter().enumerate() {
        if lanes == 0 {
            continue;
        }
        let source = gaussian_tile.accumulators[accumulators[block]].fragments(simd, block);
        let first = start + block * BLOCK_PIXELS;
        let quads = QuadAddresses::block(first);
        output.write_shared(simd, &source, &no_second, lanes as u16, &quads, words);
    }
}

#[cfg(test)]
mod tests;
