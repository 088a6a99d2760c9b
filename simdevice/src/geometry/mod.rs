//! The front end of points, lines and triangles: vertices are fetched and shaded, and primitives assembled, clipped,
//! set up and binned.
//!
//! A draw is cut into chunks of consecutive primitives, whatever the number of workers. Each worker takes a chunk
//! through all stages, each stage in a module: [`elements`] (which distinct vertices it names), [`fetch`] (their
//! attributes), [`shade`] (the vertex program and the [`viewport`]), [`assemble`] and [`setup`] (primitives, [`clip`]ped,
//! culled, with [`depth_bias`]); [`bins`] sorts what all chunks made by macro-tile. Vertices on the border of two chunks
//! are shaded in both.

mod assemble;
mod bins;
mod clip;
mod depth_bias;
mod elements;
mod emit;
mod fetch;
mod pipeline;
mod primitive;
mod setup;
mod shade;
#[cfg(test)]
mod tests;
mod viewport;

pub use bins::Bins;
pub use emit::{MAX_LINE_WIDTH, MAX_POINT_SIZE};
pub use pipeline::DrawPipeline;
pub use primitive::{Primitive, PrimitiveDraw, PrimitiveKind, Varyings};

use crate::bindings::Prepared;
use crate::counters::{Counter, Counters};
use crate::device::Device;
use crate::format::Format;
use crate::packet::Rect;
use crate::packet::draw::{Draw, VertexInput};
use bins::Grid;
use depth_bias::DepthUnit;
use elements::{Elements, Run, runs};
use fetch::Fetcher;
use isa::exec::{Stopped, Watchdog, Work};
use isa::ir::Rate;
use isa::resources::Resources;
use rayon::prelude::*;
use setup::{Job, Output, Setup};
use shade::{Shaded, Shader};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::Instant;
use viewport::Transform;

/// Primitives of a chunk.
const CHUNK: u64 = 2048;

/// Chunks of a part: what is set up before any of it is rendered.
const PART: u64 = 512;

/// What is drawn to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface {
    /// The pixels that may be touched, none left of or above the framebuffer's corner.
    pub area: Rect,
    /// How many layers there are.
    pub layers: u32,
    /// The depth attachment's format.
    pub depth: Option<Format>,
}

/// A draw on its way to the rasterizer, part by part.
pub(crate) struct FrontEnd<'a> {
    draw: &'a Draw,
    device: &'a Device,
    surface: Surface,
    prepared: Prepared<'a>,
    runs: Vec<Run>,
    transforms: Vec<Transform>,
    regions: Vec<Rect>,
    /// Primitives of an instance.
    primitives: u64,
    /// Whether a chunk may have primitives of several instances.
    mixes_instances: bool,
    chunks: u64,
    /// The first chunk that was not taken.
    next: u64,
}

impl<'a> FrontEnd<'a> {
    /// Begins a draw.
    pub(crate) fn new(
        draw: &'a Draw,
        surface: Surface,
        device: &'a Device,
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
        let chunks = if mixes_instances {
            primitives.saturating_mul(instances).div_ceil(CHUNK)
        } else {
            primitives.div_ceil(CHUNK).saturating_mul(instances)
        };
        let viewports = state.viewports.iter();
        let transforms = viewports
            .clone()
            .map(|viewport| Transform::new(viewport, state.depth_clamp));
        let scissors = state
            .scissors
            .iter()
            .map(|&scissor| surface.area.intersect(scissor));
        let regions = scissors
            .zip(viewports)
            .map(|(region, viewport)| region.intersect(viewport::pixels(viewport)));
        Self {
            draw,
            device,
            surface,
            prepared: draw.vertex_bindings.prepare(device.level()),
            runs,
            transforms: transforms.take(state.scissors.len()).collect(),
            regions: regions.collect(),
            primitives,
            mixes_instances,
            chunks,
            next: 0,
        }
    }

    /// Does all of the next part that comes before tiles; `None` when there are no more.
    ///
    /// # Errors
    /// [`Stopped`] if the vertex program ran for too long.
    pub(crate) fn next_part(
        &mut self,
        counters: &mut Counters,
    ) -> Result<Option<PrimitiveDraw>, Stopped> {
        if self.next >= self.chunks {
            return Ok(None);
        }
        let started = Instant::now();
        let range = self.next..self.chunks.min(self.next + PART);
        self.next = range.end;
        let done = self.process(range);
        self.draw.vertex_bindings.bump_generations();
        let part = done.map(|chunks| self.join(chunks, counters));
        counters.add(Counter::GeometryTime, started.elapsed().as_nanos() as u64);
        part.map(Some)
    }

    /// Takes chunks through all stages, in parallel.
    fn process(&self, range: std::ops::Range<u64>) -> Result<Vec<(Output, Work, u64)>, Stopped> {
        let setup = Setup {
            state: &self.draw.state,
            outputs: &self.draw.pipeline.vertex.outputs,
            transforms: &self.transforms,
            regions: &self.regions,
            grid: self.grid(),
            layers: self.surface.layers,
            depth_unit: DepthUnit::of(self.surface.depth),
        };
        let resources = self.prepared.resources();
        let cancel = AtomicBool::new(false);
        let worker = || Worker::new(self, &setup, &resources, &cancel);
        if range.end - range.start == 1 || self.device.threads() == 1 {
            let mut worker = worker();
            return range.map(|chunk| worker.run(chunk)).collect();
        }
        let results: Vec<_> = self.device.install(|| {
            let chunks = (range.start as usize..range.end as usize).into_par_iter();
            chunks
                .map_init(worker, |worker, chunk| worker.run(chunk as u64))
                .collect()
        });
        // That others were cancelled tells nothing.
        let mut done = Vec::with_capacity(results.len());
        let mut stopped = None;
        for result in results {
            match result {
                Ok(result) => done.push(result),
                Err(Stopped::Cancelled) => stopped = stopped.or(Some(Stopped::Cancelled)),
                Err(reason) => stopped = Some(reason),
            }
        }
        stopped.map_or(Ok(done), Err)
    }

    fn grid(&self) -> Grid {
        Grid::new(self.surface.area, self.device.config().macro_tile_size)
    }

    /// Puts chunks together in order.
    fn join(&self, chunks: Vec<(Output, Work, u64)>, counters: &mut Counters) -> PrimitiveDraw {
        let started = Instant::now();
        for (output, work, invocations) in &chunks {
            counters.add_work(work);
            counters.add(Counter::VertexInvocations, *invocations);
            counters.add(Counter::InputPrimitives, output.assembled);
            counters.add(Counter::ClippingInvocations, output.assembled);
            counters.add(Counter::ClippingPrimitives, output.clipped);
            counters.add(Counter::PrimitivesDrawn, output.primitives.len() as u64);
        }
        let outputs = chunks.into_iter().map(|chunk| chunk.0).collect();
        let mut draw = PrimitiveDraw::empty(self.draw);
        draw.regions = self.regions.clone();
        draw.varyings.per_vertex = self.draw.pipeline.vertex.outputs.varyings.len();
        join_outputs(&mut draw, outputs, self.grid(), self.surface.layers);
        counters.add(Counter::BinnedPairs, draw.bins.pairs());
        counters.add(Counter::BinningTime, started.elapsed().as_nanos() as u64);
        draw
    }

    /// Calls `each` with the runs, instances and primitives (first and end) of a chunk, in order.
    fn pieces(&self, chunk: u64, mut each: impl FnMut(&Run, u32, u32, u32)) {
        let total = self
            .primitives
            .saturating_mul(self.draw.instance_count.into());
        let (mut at, end) = if self.mixes_instances {
            (chunk * CHUNK, total.min((chunk + 1) * CHUNK))
        } else {
            let per_instance = self.primitives.div_ceil(CHUNK);
            let start = chunk / per_instance * self.primitives;
            let first = chunk % per_instance * CHUNK;
            (start + first, start + self.primitives.min(first + CHUNK))
        };
        while at < end {
            let (instance, primitive) = (at / self.primitives, at % self.primitives);
            let before = |run: &Run| u64::from(run.primitives_before) <= primitive;
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

/// Whether vertices of different instances may share a batch: no input that depends on the instance is the same for
/// all of a batch.
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

/// What one worker takes chunks through.
struct Worker<'a> {
    front: &'a FrontEnd<'a>,
    setup: &'a Setup<'a>,
    shader: Shader<'a>,
    cancel: &'a AtomicBool,
    elements: Elements,
    shaded: Shaded,
    numbers: Vec<u32>,
}

impl<'a> Worker<'a> {
    fn new(
        front: &'a FrontEnd<'a>,
        setup: &'a Setup<'a>,
        resources: &'a Resources<'a>,
        cancel: &'a AtomicBool,
    ) -> Self {
        let mut machine = front.draw.pipeline.vertex.lease();
        let shader = Shader {
            fetcher: Fetcher::new(front.draw, &mut machine),
            machine,
            outputs: setup.outputs,
            transform: front.transforms.first().copied().unwrap_or(Transform::NONE),
            resources,
            watchdog: Watchdog {
                limit: front.device.config().shader_timeout,
                cancel: Some(cancel),
            },
        };
        Self {
            front,
            setup,
            shader,
            cancel,
            elements: Elements::default(),
            shaded: Shaded::default(),
            numbers: Vec::new(),
        }
    }

    /// Takes a chunk through all stages. Returns what it became, the shader cores' work and the vertices shaded.
    fn run(&mut self, chunk: u64) -> Result<(Output, Work, u64), Stopped> {
        if self.cancel.load(Relaxed) {
            return Err(Stopped::Cancelled);
        }
        let (front, elements) = (self.front, &mut self.elements);
        elements.clear();
        front.pieces(chunk, |run, instance, first, end| {
            elements.push(front.draw, run, instance, first, end);
        });
        let shaded = self.shader.shade(elements, &mut self.shaded);
        let work = self.shader.machine.take_work();
        shaded.inspect_err(|_| self.cancel.store(true, Relaxed))?;
        let mut output = Output::default();
        if self.front.draw.state.rasterizer_discard || self.setup.transforms.is_empty() {
            output.assembled = self.elements.primitives();
        } else {
            output = Job::new(self.setup, &self.shaded, &mut self.numbers).run(&self.elements);
        }
        Ok((output, work, self.elements.vertices.len() as u64))
    }
}

/// Joins chunks' outputs in order, with vertices and primitives numbered through.
fn join_outputs(draw: &mut PrimitiveDraw, mut outputs: Vec<Output>, grid: Grid, layers: u32) {
    let mut bases = Vec::with_capacity(outputs.len());
    let (mut vertices, mut primitives) = (0u32, 0u32);
    for output in &outputs {
        bases.push((vertices, primitives));
        vertices += output.vertices;
        primitives += output.primitives.len() as u32;
    }
    let pieces = outputs.iter().zip(&bases);
    let pieces = pieces.map(|(output, &(_, base))| (base, output.pairs.as_slice()));
    draw.bins = Bins::new(grid, layers, pieces);
    if let [output] = &mut outputs[..] {
        draw.primitives = std::mem::take(&mut output.primitives);
        draw.varyings.values = std::mem::take(&mut output.varyings);
        return;
    }
    draw.primitives.reserve_exact(primitives as usize);
    let words = outputs.iter().map(|output| output.varyings.len()).sum();
    draw.varyings.values.reserve_exact(words);
    for (mut output, (base, _)) in outputs.into_iter().zip(bases) {
        for primitive in &mut output.primitives {
            primitive.vertices = primitive.vertices.map(|vertex| vertex + base);
            primitive.provoking += base;
        }
        draw.primitives.append(&mut output.primitives);
        draw.varyings.values.append(&mut output.varyings);
    }
}
