//! The front end of points, lines and triangles: fetches and shades vertices, then assembles, clips, sets up and bins
//! primitives.
//!
//! A draw is divided into segments of consecutive primitives, independent of the number of workers. A worker takes a
//! segment through all stages, each in a module: [`vertex_reuse`] (the distinct vertices), [`fetch`] (their
//! attributes), [`shade`] (the vertex program and the [`viewport`]), [`assemble`] and [`setup`] (primitives,
//! [`clip`]ped, culled, with [`depth_bias`]); [`bins`] lists the primitives of each macro-tile. Vertices on the border
//! of two segments are shaded in both.

mod assemble;
mod bins;
mod clip;
mod depth_bias;
mod draw;
mod fetch;
mod order;
pub(crate) mod points;
mod primitive;
mod setup;
mod shade;
#[cfg(test)]
mod tests;
mod vertex_reuse;
mod viewport;

pub use bins::Bins;
pub use draw::{PrimitiveDraw, PrimitiveSegment};
pub use primitive::{Primitive, PrimitiveKind, Varyings};

use crate::format::Format;
use crate::packet::Draw;
use crate::program::bindings::BoundResources;
use crate::program::interface::VertexInput;
use crate::runtime::Runtime;
use crate::state::{DrawState, PolygonMode, Rect};
use crate::stats::counters::{Counter, Counters};
use assemble::corner_count;
use bins::Grid;
use depth_bias::DepthUnit;
use devmem::host;
use fetch::Fetcher;
use isa::ir::Rate;
use isa::machine::{Stopped, Watchdog};
use isa::resources::Resources;
use setup::{Output, SegmentSetup, Setup};
use shade::{Shaded, Shader};
use std::sync::atomic::AtomicBool;
use std::time::Instant;
use vertex_reuse::{RestartRun, VertexReuse, runs};
use viewport::Transform;

/// The number of primitives in a segment.
const SEGMENT: u64 = 2048;

/// The number of segments in a part. A part is set up before any of it is rendered.
const PART_SEGMENTS: u64 = 512;

/// The target of a draw.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface {
    /// The pixels that may be touched. None is left of or above the framebuffer's corner.
    pub area: Rect,
    /// The number of layers.
    pub layers: u32,
    /// The layer to which everything is drawn, which is the view index of the vertex program. Without it, the program
    /// writes the layer.
    pub view: Option<u32>,
    /// The depth attachment's format.
    pub depth: Option<Format>,
}

/// The stages of a draw before rasterization, run part by part.
pub(crate) struct FrontEnd<'a> {
    draw: &'a Draw,
    runtime: &'a Runtime,
    surface: Surface,
    prepared: BoundResources<'a>,
    runs: Vec<RestartRun>,
    transforms: Vec<Transform>,
    regions: Vec<Rect>,
    /// The number of primitives of an instance.
    primitives: u64,
    /// True if a segment may have primitives of several instances.
    mixes_instances: bool,
    segments: u64,
    /// The first segment that was not processed yet.
    next: u64,
}

impl<'a> FrontEnd<'a> {
    /// Begins a draw: finds its runs, viewports and scissors.
    pub(crate) fn new(
        draw: &'a Draw,
        surface: Surface,
        runtime: &'a Runtime,
        counters: &mut Counters,
    ) -> Self {
        let state = &draw.state;
        let (runs, vertices) = match draw.instance_count {
            0 => (Vec::new(), 0),
            _ => runs(draw),
        };
        let instances = u64::from(draw.instance_count);
        counters.add(Counter::InputVertices, vertices.saturating_mul(instances));
        let primitives = runs
            .iter()
            .map(|run| u64::from(run.primitives))
            .sum::<u64>();
        let mixes_instances = mixes_instances(draw);
        let segments = if mixes_instances {
            primitives.saturating_mul(instances).div_ceil(SEGMENT)
        } else {
            primitives.div_ceil(SEGMENT).saturating_mul(instances)
        };
        let viewports = state.viewports.iter();
        let clip_depth = state.depth_clip.unwrap_or(!state.depth_clamp);
        let transforms = viewports
            .clone()
            .map(|viewport| Transform::new(viewport, clip_depth, state.negative_one_to_one));
        let scissors = state
            .scissors
            .iter()
            .map(|&scissor| surface.area.intersect(scissor));
        let regions = scissors
            .zip(viewports)
            .map(|(region, viewport)| region.intersect(viewport::pixels(viewport)));
        Self {
            draw,
            runtime,
            surface,
            prepared: draw.vertex_bindings.bind(runtime.level()),
            runs,
            transforms: transforms.take(state.scissors.len()).collect(),
            regions: regions.collect(),
            primitives,
            mixes_instances,
            segments,
            next: 0,
        }
    }

    /// Processes the next part up to binning; `None` if there are no more.
    pub(crate) fn next_segments(
        &mut self,
        counters: &mut Counters,
    ) -> Result<Option<PrimitiveDraw>, Stopped> {
        if self.next >= self.segments {
            return Ok(None);
        }
        let started = Instant::now();
        let range = self.next..self.segments.min(self.next + PART_SEGMENTS);
        self.next = range.end;
        let done = self.process(range, counters);
        self.draw.vertex_bindings.bump_generations();
        let part = done.map(|segments| PrimitiveDraw {
            segments,
            regions: self.regions.clone(),
            ..PrimitiveDraw::empty(self.draw)
        });
        counters.add(Counter::GeometryTime, started.elapsed().as_nanos() as u64);
        part.map(Some)
    }

    /// Processes segments on all workers. The result is in the order of segments.
    fn process(
        &self,
        range: std::ops::Range<u64>,
        counters: &mut Counters,
    ) -> Result<Vec<PrimitiveSegment>, Stopped> {
        let setup = Setup {
            state: &self.draw.state,
            outputs: &self.draw.pipeline.vertex.outputs,
            transforms: &self.transforms,
            regions: &self.regions,
            grid: self.grid(),
            layers: self.surface.layers,
            view: self.surface.view,
            depth_unit: DepthUnit::of(self.surface.depth),
        };
        let resources = self.prepared.resources();
        let cancel = AtomicBool::new(false);
        let (workers, ran) = self.runtime.share(
            range,
            1,
            &cancel,
            || Worker::new(self, &setup, &resources, &cancel),
            Worker::run_segment,
        );
        ran?;
        let mut done = Vec::new();
        for worker in workers {
            counters.add_all(&worker.counters);
            host::reserve(&mut done, worker.done.len());
            done.extend(worker.done);
        }
        done.sort_unstable_by_key(|(segment, _)| *segment);
        Ok(host::collect(done.into_iter().map(|(_, segment)| segment)))
    }

    fn grid(&self) -> Grid {
        Grid::new(self.surface.area, self.runtime.config().macro_tile_size)
    }

    /// Calls `each` with the run, instance, and first and end primitive of each piece of a segment, in order.
    fn segment_ranges(&self, segment: u64, mut each: impl FnMut(&RestartRun, u32, u32, u32)) {
        let total = self
            .primitives
            .saturating_mul(self.draw.instance_count.into());
        let (mut at, end) = if self.mixes_instances {
            (segment * SEGMENT, total.min((segment + 1) * SEGMENT))
        } else {
            let per_instance = self.primitives.div_ceil(SEGMENT);
            let start = segment / per_instance * self.primitives;
            let first = segment % per_instance * SEGMENT;
            (start + first, start + self.primitives.min(first + SEGMENT))
        };
        while at < end {
            let (instance, primitive) = (at / self.primitives, at % self.primitives);
            let before = |run: &RestartRun| u64::from(run.primitives_before) <= primitive;
            let Some(run) = self.runs[..self.runs.partition_point(before)].last() else {
                return;
            };
            let first = primitive - u64::from(run.primitives_before);
            let count = (u64::from(run.primitives) - first).min(end - at);
            each(run, instance as u32, first as u32, (first + count) as u32);
            at += count;
        }
    }
}

/// True if vertices of different instances may share a batch: no input that depends on the instance is uniform in a
/// batch.
fn mixes_instances(draw: &Draw) -> bool {
    let depends = |input: VertexInput| match input {
        VertexInput::InstanceIndex => true,
        VertexInput::Attribute { stream, .. } => {
            let stream = draw.attributes.get(stream);
            stream.is_some_and(|stream| stream.instance_divisor.is_some_and(|divisor| divisor > 0))
        }
        _ => false,
    };
    let inputs = &draw.pipeline.vertex.inputs;
    !inputs
        .iter()
        .any(|&(_, rate, input)| rate == Rate::Uniform && depends(input))
}

/// True if primitives may become points.
fn draws_points(state: &DrawState) -> bool {
    corner_count(state.topology) == 1 || state.polygon_mode == PolygonMode::Point
}

/// The state of one worker that processes segments.
struct Worker<'a> {
    front: &'a FrontEnd<'a>,
    setup: &'a Setup<'a>,
    shader: Shader<'a>,
    reuse: VertexReuse,
    shaded: Shaded,
    numbers: Vec<u32>,
    output: Output,
    counters: Counters,
    /// The segments that have primitives, with their numbers.
    done: Vec<(u64, PrimitiveSegment)>,
}

impl<'a> Worker<'a> {
    fn new(
        front: &'a FrontEnd<'a>,
        setup: &'a Setup<'a>,
        resources: &'a Resources<'a>,
        cancel: &'a AtomicBool,
    ) -> Self {
        let mut machine = front.draw.pipeline.vertex.machines.lend();
        let shader = Shader {
            fetcher: Fetcher::new(front.draw, front.surface.view.unwrap_or(0), &mut machine),
            machine,
            outputs: setup.outputs,
            takes_optional: setup.outputs.has_optional(draws_points(setup.state)),
            level: front.runtime.level(),
            transform: front.transforms.first().copied().unwrap_or(Transform::NONE),
            resources,
            watchdog: Watchdog {
                limit: front.runtime.config().shader_timeout,
                cancel: Some(cancel),
            },
        };
        Self {
            front,
            setup,
            shader,
            reuse: VertexReuse::default(),
            shaded: Shaded::default(),
            numbers: Vec::new(),
            output: Output::default(),
            counters: Counters::default(),
            done: Vec::new(),
        }
    }

    /// Processes a segment.
    fn run_segment(&mut self, segment: u64) -> Result<(), Stopped> {
        let (front, reuse) = (self.front, &mut self.reuse);
        reuse.clear();
        front.segment_ranges(segment, |run, instance, first, end| {
            reuse.push(front.draw, run, instance, first, end);
        });
        let ran = self.shader.shade(reuse, &mut self.shaded);
        let (output, counters) = (&mut self.output, &mut self.counters);
        output.clear();
        counters.add_work(&self.shader.machine.take_work());
        counters.add(Counter::VertexInvocations, reuse.vertices.len() as u64);
        ran?;
        if front.draw.state.rasterizer_discard || self.setup.transforms.is_empty() {
            output.assembled = reuse.primitives();
        } else {
            SegmentSetup::new(self.setup, &self.shaded, &mut self.numbers, output).run(reuse);
        }
        counters.add(Counter::InputPrimitives, output.assembled);
        counters.add(Counter::ClippingInvocations, output.assembled);
        counters.add(Counter::ClippingPrimitives, output.clipped);
        counters.add(Counter::PrimitivesDrawn, output.primitives.len() as u64);
        if !output.primitives.is_empty() {
            let kept = self.keep();
            host::push(&mut self.done, (segment, kept));
        }
        Ok(())
    }

    /// The result of the last segment, copied to memory of its size, with lists by macro-tile.
    fn keep(&mut self) -> PrimitiveSegment {
        let (output, setup) = (&self.output, self.setup);
        let started = Instant::now();
        let mut bins = Bins::new(&setup.grid, setup.layers, &output.pairs);
        let per_vertex = setup.outputs.varyings.len();
        let (primitives, values) = order::in_order(output, per_vertex, &mut bins, order::FEW);
        self.counters.add(Counter::BinnedPairs, bins.pairs());
        let elapsed = started.elapsed().as_nanos() as u64;
        self.counters.add(Counter::BinningTime, elapsed);
        PrimitiveSegment {
            primitives,
            varyings: Varyings { values, per_vertex },
            bins,
        }
    }
}
