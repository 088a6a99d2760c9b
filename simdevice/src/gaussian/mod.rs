//! Gaussian draws: from vertex attributes to a binned, depth-sorted set that the tile engine renders.
//!
//! Stages, each in a module: [`fetch`] (attributes to lanes), [`project`] (3D to the rasterizer's nine numbers, with
//! [`linearize`] for cameras that are no pinholes, [`unscented`] for those who ask for it, [`instances`] for what matrices
//! place in the world, and [`panorama`] for pictures that repeat; [`shaded`] where a vertex program does it instead),
//! [`depth`] (what the depth test compares), [`tiles`] and [`footprint`] (which tiles), [`spherical_harmonics`] (colour), [`sort`] (depth order); then
//! [`binning`](crate::binning) places them in tile lists.

pub(crate) mod cache;
pub mod caches;
mod chunks;
pub(crate) mod depth;
mod emit;
mod fetch;
pub(crate) mod footprint;
mod frustum;
mod hidden;
mod instances;
mod jobs;
mod lanes;
mod linearize;
mod order;
mod panorama;
pub(crate) mod project;
pub(crate) mod rays;
mod recording;
mod scratch;
mod shaded;
#[doc(hidden)] // For the benchmarks.
pub mod sort;
pub mod spherical_harmonics;
pub(crate) mod splat;
pub(crate) mod surfel;
mod tiles;
pub(crate) mod unchanged;
mod unscented;

use crate::binning::TileLists;
use crate::format::Format;
use crate::format::depth::DepthEncoding;
use crate::gaussian::caches::Caches;
use crate::packet::{Draw, GaussianAppend, GaussianBegin, ResolveShader};
use crate::runtime::Runtime;
use crate::state::gaussian::{GaussianGeometry, GaussianOrder, GaussianState};
use crate::state::{Rect, Viewport};
use crate::stats::counters::{Counter, Counters};
use crate::stats::optimizations::{Skip, Skips};
use crate::stats::recorder::DrawRecord;
use chunks::Chunks;
use depth::{CenterDepth, Trend};
use devmem::dispatch;
use devmem::host;
use fetch::{BATCH, Fetcher};
use footprint::Visible;
use frustum::Frustum;
use instances::Matrices;
use isa::exec::Stopped;
use jobs::{Job, Part};
use order::Order;
use project::{Projection, Source};
use rayon::prelude::*;
use rays::{PixelRays, RayDepth, RayDepths};
use scratch::{Attributes, Scratch};
use splat::{Projected, Splat};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;
use surfel::Surfel;
use unchanged::{Key, LastSet};

/// The most batches of a set: a survivor is named by its batch and its place there, in 32 bits.
const MAX_BATCHES: u64 = (1 << 32) / BATCH as u64;

/// The most batches that a worker takes at a time: the last ones are waited for.
const BATCHES_PER_TASK: usize = 4;

/// The least batches that a worker takes where little is done for each.
const LEAST_BATCHES: usize = 64;

/// A set of Gaussians that are sorted and drawn together.
#[derive(Debug)]
pub struct GaussianSet {
    begin: GaussianBegin,
    bounds: Rect,
    depth: Option<CenterDepth>,
    /// What depths are rounded to.
    depth_format: Format,
    resolve: Option<ResolveShader>,
    appends: Vec<GaussianAppend>,
    /// Those that a vertex program projects, which come after the others.
    draws: Vec<Draw>,
}

/// The set has more Gaussians than one draw can sort.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "a sorted set of {batches} batches of Gaussians exceeds the {MAX_BATCHES} that a draw can hold"
)]
pub struct TooManyGaussians {
    /// How many batches it would take.
    pub batches: u64,
}

/// Why a set could not be resolved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unresolved {
    /// It is too large.
    #[error(transparent)]
    TooManyGaussians(#[from] TooManyGaussians),
    /// A vertex program ran for too long.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// What projection, sort and binning make of a set. Rasterization changes nothing of it.
#[derive(Debug)]
pub(crate) struct Sorted {
    /// By batch; [`locate`] finds a primitive's.
    pub(crate) splats: Vec<Vec<Splat>>,
    pub(crate) tiles: TileLists,
    /// By batch, as the splats, if they are 2D Gaussians.
    surfels: Option<Vec<Vec<Surfel>>>,
    /// By batch, as the splats, if each pixel sorts for itself.
    ray_depths: Option<Vec<Vec<RayDepth>>>,
    /// The order, if a next picture's may be nearly the same.
    order: Option<Arc<Order>>,
    /// What became of the set's Gaussians.
    counters: Counters,
}

/// A resolved set: sorted, binned, immutable.
#[derive(Debug)]
pub struct GaussianDraw {
    /// What the pipeline fixes.
    pub state: Arc<GaussianState>,
    /// The pixels that it may touch.
    pub bounds: Rect,
    pub(crate) sorted: Arc<Sorted>,
    /// What is left out in its tiles.
    pub(crate) skips: Skips,
    /// What makes the colours of its fragments.
    pub(crate) resolve: Option<ResolveShader>,
    /// How its depths are numbers.
    pub(crate) depth_unit: DepthEncoding,
    /// How the depths of a tile's list follow one another.
    pub(crate) depth_trend: Trend,
    /// Half the pixels after which the picture repeats, or infinity.
    pub(crate) half_period: f64,
    /// The pixels' rays.
    rays: PixelRays,
    /// Where the work of its tiles goes, if anybody wants to know.
    pub(crate) record: Option<Arc<DrawRecord>>,
}

/// The pixels whose centres lie in the viewport.
fn viewport_pixels(viewport: &Viewport) -> Rect {
    let span = |start: f32, size: f32| {
        let (start, end) = (f64::from(start), f64::from(start) + f64::from(size));
        let first = (start - 0.5).ceil();
        let last = (end - 0.5).ceil();
        (first as i32, (last - first).max(0.0) as u32)
    };
    let (x, width) = span(viewport.x, viewport.width);
    let (y, height) = span(viewport.y, viewport.height);
    Rect {
        x,
        y,
        width,
        height,
    }
}

impl GaussianSet {
    /// Starts a set that may touch the pixels of `area` which lie in its scissor and its viewport. `depth` is the
    /// depth attachment's format, if there is one.
    pub fn begin(begin: &GaussianBegin, area: Rect, depth: Option<Format>) -> Self {
        let visible = area
            .intersect(begin.scissor)
            .intersect(viewport_pixels(&begin.viewport));
        Self {
            begin: begin.clone(),
            bounds: visible,
            depth: depth
                .filter(|_| begin.state.depth_stencil.depth.is_some())
                .map(|format| CenterDepth::new(&begin.camera, &begin.viewport, format)),
            depth_format: depth.unwrap_or(Format::D32Sfloat),
            resolve: None,
            appends: Vec::new(),
            draws: Vec::new(),
        }
    }

    /// Adds Gaussians.
    pub fn append(&mut self, append: &GaussianAppend) {
        if append.count > 0 && append.instance_count > 0 {
            host::push(&mut self.appends, append.clone());
        }
    }

    /// Has a fragment program make the colours of the set's fragments.
    pub fn shade_fragments(&mut self, shader: &ResolveShader) {
        if shader.program.reads_depth() {
            let begin = &self.begin;
            self.depth = Some(CenterDepth::new(
                &begin.camera,
                &begin.viewport,
                self.depth_format,
            ));
        }
        self.resolve = Some(shader.clone());
    }

    /// Adds Gaussians that a vertex program projects.
    pub fn append_draw(&mut self, draw: &Draw) {
        if draw.count > 0 && draw.instance_count > 0 {
            self.draws.push(draw.clone());
        }
    }

    /// Projects, sorts and bins the set.
    ///
    /// # Errors
    /// [`Unresolved`] if the set exceeds what 32 bits can name, or a vertex program runs for too long.
    pub fn resolve(
        self,
        runtime: &Runtime,
        caches: &Caches,
        counters: &mut Counters,
    ) -> Result<GaussianDraw, Unresolved> {
        let chunks = self.find_chunks(runtime, caches, counters);
        let config = runtime.config();
        let skips = [Skip::Unchanged, Skip::LastOrder].map(|skip| config.skips.has(skip));
        let is_kept = skips.contains(&true) && runtime.recorder().is_none();
        let key = Key::new(&self, &chunks).filter(|_| is_kept);
        let mut last = None;
        if let Some(key) = &key {
            match caches.last_sets.find(key, skips[0]) {
                LastSet::Same(sorted) => {
                    counters.add_all(&sorted.counters);
                    counters.add(Counter::SetsUnchanged, 1);
                    return Ok(self.drawn(sorted, None, runtime));
                }
                LastSet::Other(order) => last = order,
            }
        }
        let keeps_order = key.is_some() && skips[1];
        // All of it by workers: for each way from this thread to them and back, threads fall asleep and are woken.
        let (sorted, record) =
            runtime.install(|| self.sort(&chunks, (last, keeps_order), runtime, counters))?;
        let sorted = Arc::new(sorted);
        if let Some(key) = key {
            let bytes = sorted.memory_bytes();
            let sets = &caches.last_sets;
            sets.keep(key, &sorted, bytes, config.chunk_budget_bytes);
        }
        Ok(self.drawn(sorted, record, runtime))
    }

    /// The set as it is drawn.
    fn drawn(
        self,
        sorted: Arc<Sorted>,
        record: Option<Arc<DrawRecord>>,
        runtime: &Runtime,
    ) -> GaussianDraw {
        let begin = self.begin;
        GaussianDraw {
            depth_trend: match (self.depth, begin.state.order) {
                // What a program sorts by need not follow its depths.
                (Some(depth), GaussianOrder::ViewDepth) if self.draws.is_empty() => depth.trend(),
                _ => Trend::None,
            },
            depth_unit: self
                .depth
                .map_or(DepthEncoding::Float, |depth| depth.unit()),
            resolve: self.resolve,
            half_period: panorama::period(&begin.camera).map_or(f64::INFINITY, |p| 0.5 * p),
            rays: PixelRays::new(&begin.camera, &begin.viewport),
            state: begin.state,
            bounds: self.bounds,
            sorted,
            skips: runtime.config().skips,
            record,
        }
    }

    /// Projects, sorts and bins, with the help of the last picture's order, if it is kept; and begins an account of it, if
    /// anybody wants to know.
    fn sort(
        &self,
        chunks: &[Option<Arc<Chunks>>],
        (last, keeps_order): (Option<Arc<Order>>, bool),
        runtime: &Runtime,
        counters: &mut Counters,
    ) -> Result<(Sorted, Option<Arc<DrawRecord>>), Unresolved> {
        let started = Instant::now();
        let mut work = Counters::default();
        let (mut batches, numbers) = self.project(runtime, chunks, &mut work)?;
        let fixed = batches.len();
        self.shade(runtime, &mut batches)?;
        work.add_all(&counted(&batches[..fixed]));
        let by_programs = counted(&batches[fixed..]);
        let projected = Instant::now();
        let threads = runtime.threads();
        let (order, is_repaired) = order::find(&batches, &numbers, last.as_deref(), threads);
        counters.add(Counter::OrdersRepaired, is_repaired.into());
        drop(last);
        let sorted = Instant::now();
        // Twelve bytes a pair while lists are made: four times the budget of all lists of a pass.
        let most_pairs = runtime.config().bin_budget_bytes / 3;
        let tiles = TileLists::build(&mut batches, &order, self.bounds, threads, most_pairs);
        let kept = keeps_order.then(|| Order::keep(numbers, &mut batches, order));
        let binned = Instant::now();
        let mut splats = host::with_capacity(batches.len());
        let mut others = host::with_capacity(batches.len());
        // What else there is of batches goes here; with many, that takes a while.
        batches
            .into_par_iter()
            .with_min_len(LEAST_BATCHES)
            .map(|batch| (batch.splats, (batch.surfels, batch.ray_depths)))
            .unzip_into_vecs(&mut splats, &mut others);
        let is_per_pixel = self.begin.state.order == GaussianOrder::PerPixel;
        let surfels = others
            .iter_mut()
            .map(|others| std::mem::take(&mut others.0));
        let surfels = self.is_flat().then(|| host::collect(surfels));
        let depths = others.into_iter().map(|others| others.1);
        let ray_depths = is_per_pixel.then(|| host::collect(depths));
        let record = runtime.recorder().map(|_| {
            let degree = self.begin.state.sh_degree;
            let (pairs, bounds) = (tiles.pairs(), self.bounds);
            let (by_device, by_program) = splats.split_at(fixed);
            let fixed = recording::Projected {
                counters: &work,
                splats: by_device,
            };
            let by_program = recording::Projected {
                counters: &by_programs,
                splats: by_program,
            };
            let bytes = self.draws.iter().map(shaded::vertex_bytes).sum();
            let draw = recording::gaussian_draw(&fixed, &by_program, bytes, pairs, degree, bounds);
            DrawRecord::new(draw)
        });
        work.add_all(&by_programs);
        work.add(Counter::TilePairs, tiles.pairs());
        counters.add_all(&work);
        let nanoseconds = |from: Instant, to: Instant| (to - from).as_nanos() as u64;
        counters.add(Counter::PreprocessTime, nanoseconds(started, projected));
        counters.add(Counter::SortTime, nanoseconds(projected, sorted));
        counters.add(Counter::BinningTime, nanoseconds(sorted, binned));
        let sorted = Sorted {
            splats,
            tiles,
            surfels,
            ray_depths,
            order: kept.flatten().map(Arc::new),
            counters: work,
        };
        Ok((sorted, record))
    }

    /// Whether it is of 2D Gaussians.
    fn is_flat(&self) -> bool {
        self.begin.state.geometry == GaussianGeometry::Surfel
    }

    /// The chunks of each append that has some.
    fn find_chunks(
        &self,
        runtime: &Runtime,
        caches: &Caches,
        counters: &mut Counters,
    ) -> Vec<Option<Arc<Chunks>>> {
        let config = runtime.config();
        let mut found = vec![None; self.appends.len()];
        if !config.skips.has(Skip::Chunks) {
            return found;
        }
        let is_flat = self.is_flat();
        for (append, found) in self.appends.iter().zip(&mut found) {
            let build = |with_harmonics| {
                let started = Instant::now();
                let chunks = runtime.install(|| Chunks::build(append, is_flat, with_harmonics));
                counters.add(Counter::ChunksBuilt, chunks.chunks.len() as u64);
                counters.add(Counter::ChunkTime, started.elapsed().as_nanos() as u64);
                chunks
            };
            let cache = &caches.chunks;
            *found = cache.get(append, is_flat, config.chunk_budget_bytes, build);
        }
        found
    }

    /// Shades and projects what vertex programs project.
    fn shade(&self, runtime: &Runtime, batches: &mut Vec<Projected>) -> Result<(), Stopped> {
        let mut sequence = 0u32;
        for append in &self.appends {
            let gaussians = append.count.wrapping_mul(append.instance_count);
            sequence = sequence.wrapping_add(gaussians);
        }
        for draw in &self.draws {
            let shaded = shaded::project(self, draw, sequence, runtime)?;
            host::reserve(batches, shaded.len());
            batches.extend(shaded);
            let gaussians = draw.count.wrapping_mul(draw.instance_count);
            sequence = sequence.wrapping_add(gaussians);
        }
        Ok(())
    }

    /// Projects what has attributes; gives the numbers of batches, too, of all that the set has. What is left out with its
    /// chunk is counted in `counters`.
    fn project(
        &self,
        runtime: &Runtime,
        chunks: &[Option<Arc<Chunks>>],
        counters: &mut Counters,
    ) -> Result<(Vec<Projected>, Vec<u32>), TooManyGaussians> {
        let begin = &self.begin;
        let skips = runtime.config().skips;
        let projection = Projection::new(
            &begin.state,
            &begin.camera,
            &begin.viewport,
            Visible::from(self.bounds),
            self.depth,
            skips,
        );
        let workers = Workers {
            runtime,
            projection: &projection,
            is_flat: self.is_flat(),
        };
        let hidden = self.find_hidden(&workers, chunks);
        let jobs = self.jobs(chunks, &projection, hidden.as_ref(), counters)?;
        if skips.has(Skip::Harmonics) {
            let unread =
                counters.get(Counter::OutsideByChunks) + counters.get(Counter::HiddenByOthers);
            counters.add(Counter::HarmonicsUnread, unread);
        }
        let mut batches = workers.run(&jobs);
        panorama::append_copies(&mut batches);
        let numbers = host::collect(jobs.iter().map(|job| job.number));
        Ok((batches, numbers))
    }
}

/// What all batches counted.
fn counted(batches: &[Projected]) -> Counters {
    let add = |mut sum: Counters, more: &Counters| {
        sum.add_all(more);
        sum
    };
    batches
        .par_iter()
        .with_min_len(LEAST_BATCHES)
        .fold(Counters::default, |sum, batch| add(sum, &batch.counters))
        .reduce(Counters::default, |sum, more| add(sum, &more))
}

/// What projects jobs.
struct Workers<'a> {
    runtime: &'a Runtime,
    projection: &'a Projection,
    is_flat: bool,
}

impl Workers<'_> {
    /// Does all jobs.
    fn run(&self, jobs: &[Job<'_>]) -> Vec<Projected> {
        // Each thread makes its scratch once. Nobody else asks for its lock, and no job waits for others, so that none is
        // begun within another.
        let workers = (0..rayon::current_num_threads()).map(|_| Mutex::new(None));
        let workers: Vec<Mutex<Option<Worker>>> = workers.collect();
        let one = |job| {
            let own = rayon::current_thread_index().unwrap_or(0) % workers.len();
            let mut worker = workers[own].lock().unwrap_or_else(PoisonError::into_inner);
            self.job(worker.get_or_insert_with(Worker::new), job)
        };
        let mut batches = host::with_capacity(jobs.len());
        jobs.par_iter()
            .with_max_len(BATCHES_PER_TASK)
            .map(one)
            .collect_into_vec(&mut batches);
        batches
    }

    /// Does a job.
    fn job(&self, worker: &mut Worker, job: &Job<'_>) -> Projected {
        let Worker {
            fetcher,
            attributes,
            matrices,
            scratch,
        } = worker;
        let mut out = Projected::default();
        let projection = self.projection;
        let source = job.read(fetcher, attributes, matrices, self.is_flat);
        // A frustum is for opacities that it was told of.
        let wider;
        let mut frustum = &*job.frustum;
        if let Part::From(_) = job.part {
            let opacities = &source.attributes.opacity[..source.batch.len];
            let opacity = opacities.iter().copied().fold(1.0, f32::max);
            if opacity > 1.0 {
                wider = Frustum::new(projection, opacity);
                frustum = &wider;
            }
        }
        let placed;
        let mut bounds = projection.skips.has(Skip::Bounds).then_some(frustum);
        if let Some(matrices) = source.matrices {
            // What is yet to be placed in the world by the same matrix sees the planes where they are for it.
            let uniform = bounds.and(matrices.uniform());
            placed = uniform.and_then(|matrix| frustum.within(matrix));
            bounds = placed.as_ref();
        }
        let source = Source {
            frustum: bounds,
            ..source
        };
        let sequence = |lane: usize| match &job.part {
            Part::From(start) => job.sequence + start + lane as u32,
            Part::Chunk(chunk) => job.sequence + chunk.numbers[lane],
        };
        dispatch!(self.runtime.level(), simd => projection.run(simd, &source, scratch, sequence, &mut out));
        out
    }
}

/// What a worker keeps from one batch to the next.
struct Worker {
    fetcher: Fetcher,
    attributes: Box<Attributes>,
    /// Made when they are needed.
    matrices: Option<Box<Matrices>>,
    scratch: Scratch,
}

/// The batch of a survivor's name, and its place there.
#[inline(always)]
pub(crate) fn locate(name: u32) -> (usize, usize) {
    (name as usize / BATCH, name as usize % BATCH)
}

impl Sorted {
    /// Bytes of host memory that it holds.
    fn memory_bytes(&self) -> u64 {
        let splats = self.splats.iter().map(|batch| size_of_val(&**batch) as u64);
        let depths = self.ray_depths.iter().flatten();
        let depths = depths.map(|batch| size_of_val(&**batch) as u64);
        let surfels = self.surfels.iter().flatten();
        let surfels = surfels.map(|batch| size_of_val(&**batch) as u64);
        let order = self.order.as_ref().map_or(0, |order| order.memory_bytes());
        let lists = self.tiles.memory_bytes() + order;
        splats.sum::<u64>() + depths.sum::<u64>() + surfels.sum::<u64>() + lists
    }
}

impl GaussianDraw {
    /// Bytes of host memory that it holds while it waits to be rendered.
    pub fn memory_bytes(&self) -> u64 {
        self.sorted.memory_bytes()
    }

    /// What the splats are, if they are 2D Gaussians.
    pub(crate) fn surfels(&self) -> Option<&[Vec<Surfel>]> {
        self.sorted.surfels.as_deref()
    }

    /// What pixels sort by, if each does so for itself.
    pub(crate) fn ray_depths(&self) -> Option<RayDepths<'_>> {
        let of = self.sorted.ray_depths.as_ref()?;
        Some(RayDepths {
            of,
            rays: self.rays,
        })
    }

    /// Whether it may touch a pixel of `rect`.
    pub fn touches(&self, rect: Rect) -> bool {
        let shared = self.bounds.intersect(rect);
        !shared.is_empty() && self.sorted.tiles.any_in(shared)
    }
}

impl Worker {
    fn new() -> Self {
        Self {
            fetcher: Fetcher::default(),
            attributes: Box::default(),
            matrices: None,
            scratch: Scratch::new(),
        }
    }
}
