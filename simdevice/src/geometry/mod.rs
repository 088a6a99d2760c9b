//! The front end of points, lines and triangles: fetches and shades vertices, then assembles, clips, sets up and bins
//! primitives.
//!
//! A draw is divided into segments of consecutive primitives, independent of the number of workers. A worker takes a
//! segment through all stages, each in a module: [`vertex_reuse`] (the distinct vertices), [`fetch`] (their
//! attributes), [`shade`] (the vertex program and the [`viewport`]), [`assemble`] and [`setup`] (primitives,
//! [`clip`]ped, culled, with [`depth_bias`]); [`bins`] lists the primitives of each macro-tile. Vertices on the border
//! of two segments are shaded in both.
//!
//! Tessellation and geometry programs ([`tessellation_shader`], [`geometry_shader`]) take the assembled primitives and
//! leave others ([`primitive_list`]), which are set up in pieces. Transform feedback [`capture`]s what is set up.

mod assemble;
mod bins;
mod capture;
mod clip;
mod depth_bias;
mod draw;
mod fetch;
mod geometry_shader;
mod line;
mod order;
mod pieces;
pub(crate) mod points;
mod primitive;
mod primitive_list;
mod primitive_stages;
mod setup;
mod shade;
mod stage_runner;
mod tessellation_shader;
#[cfg(test)]
mod tests;
mod vertex_reuse;
mod viewport;

pub use bins::Bins;
pub use draw::{PrimitiveDraw, PrimitiveSegment};
pub use line::StyledLine;
pub use primitive::{Primitive, PrimitiveKind, Varyings};

use crate::format::Format;
use crate::packet::Draw;
use crate::program::bindings::BoundResources;
use crate::program::interface::VertexInput;
use crate::program::outputs::VertexOutputs;
use crate::runtime::Runtime;
use crate::state::{PolygonMode, Rect, Topology};
use crate::stats::counters::{Counter, Counters};
use assemble::corner_count;
use bins::Grid;
use capture::Capture;
use depth_bias::DepthUnit;
use devmem::host;
use fetch::Fetcher;
use isa::ir::Rate;
use isa::machine::{Stopped, Watchdog};
use isa::resources::Resources;
use pieces::{PieceNumber, Pieces};
use primitive_list::{ListedPrimitive, list_corners};
use primitive_stages::{BoundStages, PrimitiveStages, StageResources};
use setup::Setup;
use shade::{OutputReader, Shaded, Shader};
use stage_runner::Environment;
use std::sync::atomic::{AtomicBool, AtomicU32};
use std::time::Instant;
use vertex_reuse::{RestartRun, VertexReuse, runs};
use viewport::Transform;

/// The number of primitives in a segment.
const SEGMENT: u64 = 2048;

/// The number of segments in a part. A part is set up before any of it is rendered.
const PART_SEGMENTS: u64 = 512;

/// The number of patches in a segment.
const SEGMENT_OF_PATCHES: u64 = 16;

/// The least number of primitives in a segment of which a geometry program makes others.
const SEGMENT_OF_GEOMETRY: u64 = 256;

/// The most vertices that a geometry program may give for a segment of more primitives than that.
const GEOMETRY_VERTICES: u64 = 8192;

/// The number of such segments that are processed before the memory of the part is looked at.
const STEP_SEGMENTS: u64 = 16;

/// The captured bytes of a vertex up to which so many segments are processed at a time.
const CAPTURED_BYTES: u64 = 64;

/// The bytes of host memory after which a part of such segments ends.
const PART_BYTES: u64 = 64 << 20;

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
    bound: BoundResources<'a>,
    bound_stages: BoundStages<'a>,
    runs: Vec<RestartRun>,
    transforms: Vec<Transform>,
    regions: Vec<Rect>,
    /// The number of primitives of an instance.
    primitives: u64,
    /// The number of primitives in a segment.
    segment: u64,
    /// True if a segment may have primitives of several instances.
    mixes_instances: bool,
    segments: u64,
    /// The first segment that was not processed yet.
    next: u64,
    /// The number of primitives that tessellation has made of the instance, if their numbers are read.
    presented: Option<AtomicU32>,
    /// The capture by transform feedback, if it is active.
    capture: Option<Capture<'a>>,
    /// The stipple counter at the end of the last line.
    stipple_counter: f64,
}

impl<'a> FrontEnd<'a> {
    /// Begins a draw: finds its runs, viewports and scissors.
    pub(crate) fn new(draw: &'a Draw, surface: Surface, runtime: &'a Runtime, counters: &mut Counters) -> Self {
        let state = &draw.state;
        let (runs, vertices) = match draw.instance_count {
            0 => (Vec::new(), 0),
            _ => runs(draw),
        };
        let instances = u64::from(draw.instance_count);
        counters.add(Counter::InputVertices, vertices.saturating_mul(instances));
        let primitives = runs.iter().map(|run| u64::from(run.primitives)).sum::<u64>();
        let mixes_instances = mixes_instances(draw);
        let segment = match (&draw.pipeline.tessellation, &draw.pipeline.geometry) {
            (Some(_), _) => SEGMENT_OF_PATCHES,
            // Large ones lie in memory as macro-tiles read them.
            (None, Some(stage)) => (GEOMETRY_VERTICES / stage.most_vertices()).clamp(SEGMENT_OF_GEOMETRY, SEGMENT),
            (None, None) => SEGMENT,
        };
        let segments = if mixes_instances {
            primitives.saturating_mul(instances).div_ceil(segment)
        } else {
            primitives.div_ceil(segment).saturating_mul(instances)
        };
        let viewports = state.viewports.iter();
        let clip_depth = state.depth_clip.unwrap_or(!state.depth_clamp);
        let transforms =
            viewports.clone().map(|viewport| Transform::new(viewport, clip_depth, state.negative_one_to_one));
        let scissors = state.scissors.iter().map(|&scissor| surface.area.intersect(scissor));
        let regions = scissors.zip(viewports).map(|(region, viewport)| region.intersect(viewport::pixels(viewport)));
        Self {
            draw,
            runtime,
            surface,
            bound: draw.vertex_bindings.bind(runtime.level()),
            bound_stages: BoundStages::new(draw, runtime.level()),
            runs,
            transforms: transforms.take(state.scissors.len()).collect(),
            regions: regions.collect(),
            primitives,
            segment,
            mixes_instances,
            segments,
            next: 0,
            presented: draw.pipeline.numbers_primitives().then(AtomicU32::default),
            capture: Capture::new(draw, corners_drawn(draw)),
            stipple_counter: 0.0,
        }
    }

    /// Processes the next part up to binning; `None` if there are no more.
    pub(crate) fn next_segments(&mut self, counters: &mut Counters) -> Result<Option<PrimitiveDraw>, Stopped> {
        if self.next >= self.segments {
            return Ok(None);
        }
        let started = Instant::now();
        let pipeline = &self.draw.pipeline;
        let makes_primitives = pipeline.tessellation.is_some() || pipeline.geometry.is_some();
        let done = if !makes_primitives && self.capture.is_none() {
            let range = self.next..self.segments.min(self.next + PART_SEGMENTS);
            self.next = range.end;
            self.process(range, counters)
        } else {
            self.process_steps(counters)
        };
        self.draw.vertex_bindings.bump_generations();
        self.bound_stages.bump_generations();
        let part = done.map(|mut segments| {
            self.count_stipples(&mut segments);
            PrimitiveDraw { segments, regions: self.regions.clone(), ..PrimitiveDraw::empty(self.draw) }
        });
        counters.add(Counter::GeometryTime, started.elapsed().as_nanos() as u64);
        part.map(Some)
    }

    /// Sets the stipple counters of all lines, which go on from one to the next of a strip, in order.
    fn count_stipples(&mut self, segments: &mut [PrimitiveSegment]) {
        for line in segments.iter_mut().flat_map(|segment| &mut segment.lines) {
            self.stipple_counter = line.count(self.stipple_counter);
        }
    }

    /// Processes segments until they hold enough memory, since nothing tells before how many primitives they become.
    fn process_steps(&mut self, counters: &mut Counters) -> Result<Vec<PrimitiveSegment>, Stopped> {
        let mut done: Vec<PrimitiveSegment> = Vec::new();
        let mut bytes = 0;
        while self.next < self.segments && bytes < PART_BYTES {
            // Segments whose primitives are numbered depend on those before. Large vertices are captured of fewer
            // segments at a time.
            let count = match (&self.presented, &self.capture) {
                (Some(_), _) => 1,
                (None, Some(capture)) => {
                    let bytes = capture.vertex_bytes().max(CAPTURED_BYTES);
                    (STEP_SEGMENTS * CAPTURED_BYTES / bytes).max(1)
                }
                (None, None) => STEP_SEGMENTS,
            };
            let range = self.next..self.segments.min(self.next + count);
            self.next = range.end;
            let step = self.process(range, counters)?;
            bytes += step.iter().map(PrimitiveSegment::memory_bytes).sum::<u64>();
            host::reserve(&mut done, step.len());
            done.extend(step);
        }
        Ok(done)
    }

    /// Processes segments on all workers. The result is in the order of segments.
    fn process(&self, range: std::ops::Range<u64>, counters: &mut Counters) -> Result<Vec<PrimitiveSegment>, Stopped> {
        let setup = Setup {
            state: &self.draw.state,
            outputs: self.draw.pipeline.last_outputs(),
            corners: corners_drawn(self.draw),
            transforms: &self.transforms,
            regions: &self.regions,
            grid: self.grid(),
            layers: self.surface.layers,
            view: self.surface.view,
            depth_unit: DepthUnit::of(self.surface.depth),
            has_strips: has_strips(self.draw),
        };
        let resources = self.bound.resources();
        let stage_resources = self.bound_stages.resources();
        let cancel = AtomicBool::new(false);
        let (workers, ran) = self.runtime.share(
            range,
            1,
            &cancel,
            || Worker::new(self, &setup, &resources, &stage_resources, &cancel),
            Worker::run_segment,
        );
        ran?;
        let (mut done, mut captured) = (Vec::new(), Vec::new());
        for worker in workers {
            let finished = worker.finished;
            counters.add_all(&finished.counters);
            host::reserve(&mut done, finished.segments.len());
            done.extend(finished.segments);
            host::reserve(&mut captured, finished.captured.len());
            captured.extend(finished.captured);
        }
        done.sort_unstable_by_key(|(number, _)| *number);
        if let Some(capture) = &self.capture {
            captured.sort_unstable_by_key(|(number, _)| *number);
            for (_, primitives) in &captured {
                capture.write(primitives, counters);
            }
        }
        Ok(host::collect(done.into_iter().map(|(_, segment)| segment)))
    }

    fn grid(&self) -> Grid {
        Grid::new(self.surface.area, self.runtime.config().macro_tile_size)
    }

    /// Calls `each` with the run, instance, and first and end primitive of each piece of a segment, in order.
    fn segment_ranges(&self, segment: u64, mut each: impl FnMut(&RestartRun, u32, u32, u32)) {
        let total = self.primitives.saturating_mul(self.draw.instance_count.into());
        let (mut at, end) = if self.mixes_instances {
            (segment * self.segment, total.min((segment + 1) * self.segment))
        } else {
            let per_instance = self.primitives.div_ceil(self.segment);
            let start = segment / per_instance * self.primitives;
            let first = segment % per_instance * self.segment;
            (start + first, start + self.primitives.min(first + self.segment))
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
    !inputs.iter().any(|&(_, rate, input)| rate == Rate::Uniform && depends(input))
}

/// True if a line may go on where the one before it ends.
fn has_strips(draw: &Draw) -> bool {
    let is_strip = matches!(draw.state.topology, Topology::LineStrip | Topology::LineStripWithAdjacency);
    is_strip || draw.pipeline.geometry.is_some() || draw.pipeline.tessellation.is_some()
}

/// The number of corners of the primitives that are drawn: 1 for points, 2 for lines, 3 for triangles.
fn corners_drawn(draw: &Draw) -> usize {
    match (&draw.pipeline.geometry, &draw.pipeline.tessellation) {
        (Some(geometry), _) => geometry.corners,
        (None, Some(stage)) => stage.tessellation.corners(),
        (None, None) => corner_count(draw.state.topology),
    }
}

/// The state of one worker that processes segments.
struct Worker<'a> {
    front: &'a FrontEnd<'a>,
    shader: Shader<'a>,
    reuse: VertexReuse,
    shaded: Shaded,
    /// The programs that make other primitives.
    stages: Option<PrimitiveStages<'a>>,
    finished: Pieces<'a>,
    /// The primitives of a segment, if they are captured.
    listed: Vec<ListedPrimitive>,
}

impl<'a> Worker<'a> {
    fn new(
        front: &'a FrontEnd<'a>,
        setup: &'a Setup<'a>,
        resources: &'a Resources<'a>,
        stage_resources: &'a StageResources<'a>,
        cancel: &'a AtomicBool,
    ) -> Self {
        let pipeline = &front.draw.pipeline;
        let mut machine = pipeline.vertex.machines.lend();
        let view = front.surface.view.unwrap_or(0);
        let watchdog = Watchdog { limit: front.runtime.config().shader_timeout, cancel: Some(cancel) };
        let draws_points = setup.corners == 1 || setup.state.polygon_mode == PolygonMode::Point;
        let level = front.runtime.level();
        let transform = front.transforms.first().copied().unwrap_or(Transform::NONE);
        // Only the last program's outputs but varyings are needed.
        let reader = |outputs: &'a VertexOutputs| OutputReader {
            outputs,
            takes_optional: std::ptr::eq(outputs, setup.outputs) && outputs.has_optional(draws_points),
            level,
            transform,
        };
        let environment = Environment { watchdog, view, presented: front.presented.as_ref() };
        Self {
            front,
            shader: Shader {
                fetcher: Fetcher::new(front.draw, view, &mut machine),
                machine,
                reader: reader(&pipeline.vertex.outputs),
                resources,
                watchdog,
            },
            reuse: VertexReuse::default(),
            shaded: Shaded::default(),
            stages: PrimitiveStages::new(front.draw, &reader, stage_resources, environment),
            finished: Pieces::new(setup, front.capture),
            listed: Vec::new(),
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
        let finished = &mut self.finished;
        let counters = &mut finished.counters;
        counters.add_work(&self.shader.machine.take_work());
        counters.add(Counter::VertexInvocations, reuse.vertices.len() as u64);
        counters.add(Counter::InputPrimitives, reuse.primitives());
        ran?;
        if let Some(stages) = &mut self.stages {
            return stages.run(reuse, &self.shaded, segment, finished);
        }
        if front.capture.is_some() {
            let state = &front.draw.state;
            list_corners(state.topology, state.provoking_last, reuse, &mut self.listed);
            finished.set_up(&self.shaded, &self.listed, PieceNumber { segment, piece: 0 });
            return Ok(());
        }
        counters.add(Counter::PrimitivesOfStream0, reuse.primitives());
        if finished.discards {
            counters.add(Counter::ClippingInvocations, reuse.primitives());
            return Ok(());
        }
        finished.begin(&self.shaded).run(reuse);
        finished.keep(PieceNumber { segment, piece: 0 });
        Ok(())
    }
}
