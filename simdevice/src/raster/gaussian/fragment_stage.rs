//! The resolve shader: a fragment program that makes the colours of a Gaussian draw's fragments from what was
//! accumulated. It runs once for all samples of a pixel that accumulated alike, or for each sample if it asks for that.
//!
//! Blocks of 4x4 pixels are quads in the order of lanes, so a tile is one batch of a lane each. Lanes that are not
//! covered help with derivatives: they hold what their own pixels accumulated.

use super::accumulator::Accumulator;
use super::compositor::GaussianTile;
use super::grid::{BLOCK_PIXELS, BLOCK_X, BLOCK_Y, BLOCKS, LANE_X, LANE_Y, PixelMask};
use super::samples::{SAMPLES, Samples};
use crate::gaussian::BinnedDraw;
use crate::limits::TILE_SIZE;
use crate::packet::GaussianFragmentStage;
use crate::program::bindings::BoundResources;
use crate::program::fragment::{FragmentMachines, FragmentStage};
use crate::program::interface::{FragmentInput, resolve};
use crate::raster::color::{ColorOutput, load};
use crate::raster::output::{Buffers, Sources, Targets, color_outputs, covered_by_alpha, lanes_of};
use crate::raster::tile::{CENTER, SAMPLES_4, Tile};
use crate::raster::tile_buffer::QuadAddresses;
use crate::runtime::Runtime;
use crate::state::gaussian::CameraModel;
use crate::stats::counters::{Counter, Counters};
use devmem::dispatch;
use fearless_simd::{Level, Simd, f32x16, prelude::*};
use isa::Vector;
use isa::machine::{LaneMask, Machine, Stopped, Watchdog};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// A resolve shader made ready for tiles, which all workers share.
pub(crate) struct FragmentStageDraw<'a> {
    draw: &'a BinnedDraw,
    gaussian_stage: &'a GaussianFragmentStage,
    stage: &'a FragmentStage,
    bound_resources: BoundResources<'a>,
    targets: Targets<'a>,
    colors: Vec<Option<ColorOutput>>,
    samples: usize,
    /// Every sample is shaded for itself.
    per_sample: bool,
    level: Level,
    limit: Duration,
}

/// The tools with which a worker shades a tile.
pub(crate) struct Tools<'a> {
    pub(crate) buffers: &'a mut Buffers,
    pub(crate) gaussian_tile: &'a GaussianTile,
    pub(crate) counters: &'a mut Counters,
    pub(crate) cancel: &'a AtomicBool,
}

/// Fragments of a tile that are shaded together: of samples that accumulated as sample `leader` did.
struct SampleGroup {
    leader: usize,
    /// The blocks that have some, of which each is a chunk of lanes.
    blocks: Vec<usize>,
}

/// A block of a tile, and its place in a batch.
#[derive(Clone, Copy)]
struct Chunk {
    /// The number of its chunk of lanes in the batch.
    number: usize,
    block: usize,
}

/// The lanes of a block of which a sample is covered.
#[derive(Clone, Copy)]
struct CoveredLanes {
    sample: usize,
    /// A bit for each.
    lanes: u16,
}

impl<'a> FragmentStageDraw<'a> {
    pub(crate) fn new(
        draw: &'a BinnedDraw,
        gaussian_stage: &'a GaussianFragmentStage,
        targets: Targets<'a>,
        samples: usize,
        runtime: &Runtime,
    ) -> Self {
        let stage = &gaussian_stage.program.stage;
        let state = &*draw.state;
        let (logic, constants) = (state.logic_op, state.blend_constants);
        let blend = &state.blend;
        Self {
            draw,
            gaussian_stage,
            stage,
            bound_resources: gaussian_stage.bindings.bind(runtime.level()),
            targets,
            colors: color_outputs(Some(stage), targets.color, blend, logic, constants),
            samples,
            per_sample: gaussian_stage.sample_shading || stage.interface.per_sample,
            level: runtime.level(),
            limit: runtime.config().shader_timeout,
        }
    }

    /// True if the program reads depths.
    pub(crate) fn reads_depth(&self) -> bool {
        self.gaussian_stage.program.reads_depth
    }

    /// True if the program reads indices of Gaussians, or depth variables.
    pub(crate) fn is_tracking(&self) -> bool {
        self.gaussian_stage.program.is_tracking
    }

    /// True if samples that it discards were tested and counted already.
    pub(crate) fn tests_early(&self) -> bool {
        self.stage.interface.early_tests
    }

    /// Marks what the program may have written to as changed.
    pub(crate) fn finish(&self) {
        self.gaussian_stage.bindings.bump_generations();
    }

    /// Shades the covered samples of a tile and writes what comes of them. What is discarded is covered no longer.
    ///
    /// # Errors
    /// [`Stopped`] if the program ran for too long, or was cancelled.
    pub(crate) fn run(
        &self,
        tile: &Tile,
        samples: &Samples,
        covered: &mut [PixelMask; SAMPLES],
        tools: &mut Tools<'_>,
    ) -> Result<(), Stopped> {
        for (index, output) in self.colors.iter().enumerate() {
            if let (Some(_), Some(target)) = (output, &self.targets.color[index]) {
                tools.buffers.color[index].load_or_clear(target, self.draw.layer, tile);
            }
        }
        let groups: Vec<SampleGroup> = (0..self.samples)
            .map(|leader| self.group(leader, samples, covered))
            .filter(|group| !group.blocks.is_empty())
            .collect();
        let mut machines = self.stage.machines();
        let done = groups.iter().try_for_each(|group| self.shade(tile, group, samples, covered, tools, &mut machines));
        machines.give_back(tools.counters);
        for (index, output) in self.colors.iter().enumerate() {
            if output.is_some() {
                tools.buffers.color[index].changed(tile.index);
            }
        }
        done
    }

    /// The sample whose invocations are a sample's, too.
    fn leader(&self, samples: &Samples, sample: usize, block: usize) -> usize {
        if self.per_sample { sample } else { samples.accumulators[sample][block] }
    }

    /// The samples of a leader's group in a block.
    fn members(&self, samples: &Samples, leader: usize, block: usize) -> impl Iterator<Item = usize> {
        (leader..self.samples).filter(move |&sample| self.leader(samples, sample, block) == leader)
    }

    fn group(&self, leader: usize, samples: &Samples, covered: &[PixelMask; SAMPLES]) -> SampleGroup {
        let is_covered = |&block: &usize| {
            let mut members = self.members(samples, leader, block);
            members.any(|sample| covered[sample][block] != 0)
        };
        SampleGroup { leader, blocks: (0..BLOCKS).filter(is_covered).collect() }
    }

    fn shade(
        &self,
        tile: &Tile,
        group: &SampleGroup,
        samples: &Samples,
        covered: &mut [PixelMask; SAMPLES],
        tools: &mut Tools<'_>,
        machines: &mut FragmentMachines<'_>,
    ) -> Result<(), Stopped> {
        let lanes = BLOCK_PIXELS * group.blocks.len();
        let size = usize::from(lanes > crate::program::fragment::BATCH_LANES[0]);
        let machine = machines.of_size(size);
        let mut helpers = LaneMask::none();
        for (number, &block) in group.blocks.iter().enumerate() {
            let mut any = 0;
            for sample in self.members(samples, group.leader, block) {
                any |= covered[sample][block];
            }
            for lane in (0..BLOCK_PIXELS).filter(|lane| any >> lane & 1 == 0) {
                helpers.set(BLOCK_PIXELS * number + lane, true);
            }
            self.set_inputs(tile, group, Chunk { number, block }, samples, covered, tools, machine);
        }
        let watchdog = Watchdog { limit: self.limit, cancel: Some(tools.cancel) };
        let resources = self.bound_resources.resources();
        machine.run(&LaneMask::first(lanes), &helpers, &resources, watchdog)?;
        let shaded = (lanes - helpers.count()) as u64;
        tools.counters.add(Counter::FragmentInvocations, shaded);
        let killed = if self.stage.interface.discards { machine.killed() } else { LaneMask::none() };
        dispatch!(self.level, simd =>
            self.write(simd, tile, group, samples, covered, &killed, machine, tools.buffers));
        Ok(())
    }

    /// Sets a program's inputs of one block, which has a chunk of the batch.
    #[expect(clippy::too_many_arguments, reason = "what a block's inputs come from")]
    fn set_inputs(
        &self,
        tile: &Tile,
        group: &SampleGroup,
        chunk: Chunk,
        samples: &Samples,
        covered: &[PixelMask; SAMPLES],
        tools: &Tools<'_>,
        machine: &mut Machine,
    ) {
        let Chunk { number, block } = chunk;
        let accumulator = &tools.gaussian_tile.accumulators[samples.accumulators[group.leader][block]];
        let depths =
            if self.reads_depth() { accumulator.depths(block, self.draw.depth_unit) } else { [[0.0; BLOCK_PIXELS]; 2] };
        let accumulated: [[f32; BLOCK_PIXELS]; 4] = dispatch!(self.level, simd => {
            let [r, g, b, a] = accumulator.fragments(simd, block);
            [r.into(), g.into(), b.into(), a.into()]
        });
        let within = match (self.per_sample, self.samples) {
            (true, 2..) => SAMPLES_4[group.leader],
            _ => CENTER[0],
        };
        let bits = |lanes: [f32; BLOCK_PIXELS]| lanes.map(f32::to_bits);
        for &(slot, input, _) in &self.stage.interface.inputs {
            let value = match input {
                FragmentInput::Varying { index, .. } => match index {
                    0..4 => bits(accumulated[index as usize]),
                    resolve::EXPECTED_DEPTH => bits(depths[0]),
                    resolve::MEDIAN_DEPTH => bits(depths[1]),
                    resolve::EXPECTED_LINEAR_DEPTH..resolve::CAMERA => self.tracked_input(accumulator, block, index),
                    _ => [self.camera_input(index).to_bits(); BLOCK_PIXELS],
                },
                FragmentInput::FragCoord(axis @ (0 | 1)) => {
                    let (middle, lanes) = if axis == 0 { (BLOCK_X[block], LANE_X) } else { (BLOCK_Y[block], LANE_Y) };
                    let offset = (within[axis] - 128) as f32 / 256.0;
                    let middle = (tile.at[axis] * TILE_SIZE) as f32 + middle as f32;
                    bits(lanes.map(|lane| middle + lane + offset))
                }
                FragmentInput::FragCoord(2) => bits(depths[1]),
                FragmentInput::FragCoord(_) => [1f32.to_bits(); BLOCK_PIXELS],
                FragmentInput::FrontFacing => [u32::MAX; BLOCK_PIXELS],
                FragmentInput::SampleId => [group.leader as u32; BLOCK_PIXELS],
                FragmentInput::SamplePosition(axis) => [(within[axis.min(1)] as f32 / 256.0).to_bits(); BLOCK_PIXELS],
                FragmentInput::SampleMask => {
                    let mut masks = [0; BLOCK_PIXELS];
                    for sample in self.members(samples, group.leader, block) {
                        for (lane, mask) in masks.iter_mut().enumerate() {
                            *mask |= (covered[sample][block] >> lane & 1) << sample;
                        }
                    }
                    masks
                }
                FragmentInput::PointCoord(_) | FragmentInput::PrimitiveId | FragmentInput::ViewportIndex => {
                    [0; BLOCK_PIXELS]
                }
                FragmentInput::Layer => [self.draw.layer; BLOCK_PIXELS],
            };
            // An input that is the same for all lanes has one chunk.
            if let Some(chunk) = machine.input_mut(slot).get_mut(number) {
                *chunk = Vector(value);
            }
        }
    }

    /// The inputs that a block's lanes read of the Gaussians that they show; zeros where nothing is covered.
    fn tracked_input(&self, accumulator: &Accumulator, block: usize, index: u32) -> [u32; BLOCK_PIXELS] {
        let (tracked, covered) = (&accumulator.tracked, accumulator.covered[block]);
        let mean_z = accumulator.mean_z(block);
        let located = |sequences: &[u32; BLOCK_PIXELS], lane: usize, part: u32| {
            let origins = self.draw.origins.as_ref();
            let place = origins.map_or([0; 2], |origins| origins.locate(sequences[lane]));
            place[usize::from(part != 0)]
        };
        let value = |lane: usize| match index {
            resolve::EXPECTED_LINEAR_DEPTH => mean_z[lane].to_bits(),
            resolve::MEDIAN_LINEAR_DEPTH => tracked.median_z[block][lane].to_bits(),
            resolve::MEDIAN_GAUSSIAN..resolve::NEAREST_GAUSSIAN => {
                let part = index - resolve::MEDIAN_GAUSSIAN;
                located(&tracked.median[block], lane, part)
            }
            _ => {
                let part = index - resolve::NEAREST_GAUSSIAN;
                located(&tracked.nearest[block], lane, part)
            }
        };
        std::array::from_fn(|lane| if covered >> lane & 1 == 1 { value(lane) } else { 0 })
    }

    /// A number of those that the camera is.
    fn camera_input(&self, index: u32) -> f32 {
        let number = index.wrapping_sub(resolve::CAMERA) as usize;
        let camera = &self.draw.camera;
        let row = |row: usize| &camera.rotation[3 * row..][..3];
        let [fx, fy] = camera.focal_length;
        let [cx, cy] = camera.principal_point;
        let [c0, c1] = camera.depth_coefficients;
        let part = number % 4;
        match number / 4 {
            at @ 0..3 if part < 3 => row(at)[part],
            at @ 0..3 => {
                let products = row(at).iter().zip(camera.eye);
                let sum: f64 = products.map(|(&r, eye)| f64::from(r) * eye).sum();
                -sum as f32
            }
            3 => [fx, fy, cx, cy][part],
            4 => [c0, c1, camera.near_plane, camera.far_plane][part],
            5 if part < 3 => camera.eye[part] as f32,
            5 => match camera.model {
                CameraModel::Pinhole => 0.0,
                CameraModel::Orthographic => 1.0,
                CameraModel::Fisheye => 2.0,
                CameraModel::Equirectangular => 3.0,
            },
            _ => 0.0,
        }
    }

    /// Takes away what is discarded, and writes the rest to the attachments.
    #[expect(clippy::too_many_arguments, reason = "what fragments are and where they go")]
    #[inline(always)]
    fn write<S: Simd>(
        &self,
        simd: S,
        tile: &Tile,
        group: &SampleGroup,
        samples: &Samples,
        covered: &mut [PixelMask; SAMPLES],
        killed: &LaneMask,
        machine: &Machine,
        buffers: &mut Buffers,
    ) {
        let interface = &self.stage.interface;
        let sources: Vec<Sources<'_>> =
            interface.colors.iter().map(|slots| slots.map(|slots| slots.map(|slot| lanes_of(machine, slot)))).collect();
        let masks = lanes_of(machine, interface.sample_mask);
        let alpha = lanes_of(machine, interface.coverage_alpha.filter(|_| self.gaussian_stage.alpha_to_coverage));
        for (number, &block) in group.blocks.iter().enumerate() {
            let killed = killed.words().get(number / 4).copied().unwrap_or(0) >> (16 * (number % 4));
            let by_alpha = match alpha.get(number) {
                Some(alpha) => covered_by_alpha(simd, alpha, self.samples),
                None => [u16::MAX; 4],
            };
            for sample in self.members(samples, group.leader, block) {
                let mut lanes = covered[sample][block] as u16 & !(killed as u16);
                lanes &= by_alpha[sample];
                if let Some(masks) = masks.get(number) {
                    for (lane, mask) in masks.0.iter().enumerate() {
                        if mask >> sample & 1 == 0 {
                            lanes &= !(1 << lane);
                        }
                    }
                }
                covered[sample][block] = lanes.into();
                if lanes != 0 {
                    let covered = CoveredLanes { sample, lanes };
                    self.write_colors(simd, tile, &sources, Chunk { number, block }, covered, buffers);
                }
            }
        }
    }

    #[inline(always)]
    fn write_colors<S: Simd>(
        &self,
        simd: S,
        tile: &Tile,
        sources: &[Sources<'_>],
        chunk: Chunk,
        covered: CoveredLanes,
        buffers: &mut Buffers,
    ) {
        let (Chunk { number, block }, CoveredLanes { sample, lanes }) = (chunk, covered);
        for (index, output) in self.colors.iter().enumerate() {
            let (Some(output), Some(sources)) = (output, sources.get(index)) else {
                continue;
            };
            let mut source = load(simd, &sources[0], number);
            let mut second =
                if output.is_dual_source() { load(simd, &sources[1], number) } else { [f32x16::splat(simd, 0.0); 4] };
            if self.gaussian_stage.alpha_to_one {
                source[3] = f32x16::splat(simd, 1.0);
                second[3] = f32x16::splat(simd, 1.0);
            }
            let plane = &mut buffers.color[index];
            let first = plane.start(tile.index, sample) + block * BLOCK_PIXELS;
            let quads = QuadAddresses::block(first);
            output.write_shared(simd, &source, &second, lanes, &quads, plane.words_mut());
        }
    }
}
