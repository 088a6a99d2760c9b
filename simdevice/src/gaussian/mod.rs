//! Gaussian draws: from vertex attributes to a binned, depth-sorted set that the tile engine renders.
//!
//! Stages, each in a module: [`fetch`] (attributes to lanes), [`project`] (3D to the rasterizer's nine numbers, with
//! [`linearize`] for cameras that are no pinholes),
//! [`footprint`] (which tiles), [`spherical_harmonics`] (colour), [`sort`] (depth order); then
//! [`binning`](crate::binning) places them in tile lists.

mod fetch;
pub(crate) mod footprint;
mod lanes;
mod linearize;
pub(crate) mod project;
mod scratch;
mod sort;
pub mod spherical_harmonics;

pub use footprint::TILE_SIZE;

use crate::binning::TileLists;
use crate::counters::{Counter, Counters};
use crate::device::Device;
use crate::packet::{GaussianAppend, GaussianBegin, GaussianState, Rect, Viewport};
use crate::trace::{self, DrawRecord};
use fearless_simd::dispatch;
use fetch::{BATCH, Batch};
use footprint::Visible;
use project::{Projected, Projection, Splat};
use rayon::prelude::*;
use scratch::Scratch;
use std::sync::Arc;
use std::time::Instant;

/// The most batches of a set: a survivor is named by its batch and its place there, in 32 bits.
const MAX_BATCHES: u64 = (1 << 32) / BATCH as u64;

/// Batches that a worker takes at a time, so that its scratch is made rarely.
const BATCHES_PER_TASK: usize = 16;

/// A set of Gaussians that are sorted and drawn together.
#[derive(Debug)]
pub struct GaussianSet {
    begin: GaussianBegin,
    bounds: Rect,
    appends: Vec<GaussianAppend>,
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

/// A resolved set: sorted, binned, immutable.
#[derive(Debug)]
pub struct GaussianDraw {
    /// What the pipeline fixes.
    pub state: Arc<GaussianState>,
    /// The pixels that it may touch.
    pub bounds: Rect,
    /// By batch; [`locate`] finds a primitive's.
    pub(crate) splats: Vec<Vec<Splat>>,
    pub(crate) tiles: TileLists,
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
    /// Starts a set that may touch the pixels of `area` which lie in its scissor and its viewport.
    pub fn begin(begin: &GaussianBegin, area: Rect) -> Self {
        let visible = area
            .intersect(begin.scissor)
            .intersect(viewport_pixels(&begin.viewport));
        Self {
            begin: begin.clone(),
            bounds: visible,
            appends: Vec::new(),
        }
    }

    /// Adds Gaussians.
    pub fn append(&mut self, append: &GaussianAppend) {
        if append.count > 0 && append.instance_count > 0 {
            self.appends.push(append.clone());
        }
    }

    /// Projects, sorts and bins the set.
    ///
    /// # Errors
    /// [`TooManyGaussians`] if the set exceeds what 32 bits can name.
    pub fn resolve(
        self,
        device: &Device,
        counters: &mut Counters,
    ) -> Result<GaussianDraw, TooManyGaussians> {
        let started = Instant::now();
        let batches = self.project(device)?;
        let mut work = Counters::default();
        for batch in &batches {
            work.add_all(&batch.counters);
        }
        counters.add_all(&work);
        let projected = Instant::now();
        let order = sorted(&batches);
        let sorted = Instant::now();
        let tiles =
            device.install(|| TileLists::build(&batches, &order, self.bounds, device.threads()));
        counters.add(Counter::TilePairs, tiles.pairs());
        let nanoseconds = |from: Instant, to: Instant| (to - from).as_nanos() as u64;
        counters.add(Counter::PreprocessTime, nanoseconds(started, projected));
        counters.add(Counter::SortTime, nanoseconds(projected, sorted));
        counters.add(Counter::BinningTime, nanoseconds(sorted, Instant::now()));
        let splats: Vec<_> = batches.into_iter().map(|batch| batch.splats).collect();
        let record = device.recorder().map(|recorder| {
            let degree = self.begin.state.sh_degree;
            let (pairs, bounds) = (tiles.pairs(), self.bounds);
            let draw = trace::gaussian_draw(&work, &splats, pairs, degree, bounds);
            recorder.begin_draw(draw)
        });
        Ok(GaussianDraw {
            state: self.begin.state,
            bounds: self.bounds,
            splats,
            tiles,
            record,
        })
    }

    /// Projects every batch, in the order of draw, instance and position in the draw.
    fn project(&self, device: &Device) -> Result<Vec<Projected>, TooManyGaussians> {
        let per_instance = |append: &GaussianAppend| append.count.div_ceil(BATCH as u32);
        let starts: Vec<u64> = self
            .appends
            .iter()
            .scan(0u64, |next, append| {
                let start = *next;
                let batches = u64::from(per_instance(append)) * u64::from(append.instance_count);
                *next = next.saturating_add(batches);
                Some(start)
            })
            .collect();
        let batches = self
            .appends
            .last()
            .zip(starts.last())
            .map_or(0, |(append, &start)| {
                start + u64::from(per_instance(append)) * u64::from(append.instance_count)
            });
        if batches > MAX_BATCHES {
            return Err(TooManyGaussians { batches });
        }
        let begin = &self.begin;
        let projection = Projection::new(
            &begin.state,
            &begin.camera,
            &begin.viewport,
            Visible::from(self.bounds),
        );
        let level = device.level();
        let one = |scratch: &mut Scratch, number: usize| {
            let number = number as u64;
            let which = starts.partition_point(|&start| start <= number) - 1;
            let append = &self.appends[which];
            let within = number - starts[which];
            let instance = (within / u64::from(per_instance(append))) as u32;
            let start = (within % u64::from(per_instance(append))) as u32 * BATCH as u32;
            let len = (append.count - start).min(BATCH as u32) as usize;
            let instance = append.first_instance.saturating_add(instance);
            let batch = Batch::new(append, instance, start, len);
            let mut out = Projected::default();
            dispatch!(level, simd => projection.run(simd, &append.attributes, &batch, scratch, &mut out));
            out
        };
        Ok(device.install(|| {
            (0..batches as usize)
                .into_par_iter()
                .with_min_len(BATCHES_PER_TASK)
                .map_init(Scratch::new, one)
                .collect()
        }))
    }
}

/// The survivors in depth order, as batch number times `BATCH` plus place in the batch.
fn sorted(batches: &[Projected]) -> Vec<(u32, u32)> {
    let count = batches.iter().map(|batch| batch.keys.len()).sum();
    let mut order = Vec::with_capacity(count);
    for (number, batch) in batches.iter().enumerate() {
        let base = (number * BATCH) as u32;
        order.extend(
            batch
                .keys
                .iter()
                .zip(base..)
                .map(|(&key, name)| (key, name)),
        );
    }
    sort::sort_by_key(&mut order);
    order
}

/// The batch of a survivor's name, and its place there.
#[inline(always)]
pub(crate) fn locate(name: u32) -> (usize, usize) {
    (name as usize / BATCH, name as usize % BATCH)
}

impl GaussianDraw {
    /// Bytes of host memory that it holds while it waits to be rendered.
    pub fn memory_bytes(&self) -> u64 {
        let splats = self.splats.iter().map(|batch| size_of_val(&**batch) as u64);
        splats.sum::<u64>() + self.tiles.memory_bytes()
    }

    /// Whether it may touch a pixel of `rect`.
    pub fn touches(&self, rect: Rect) -> bool {
        let shared = self.bounds.intersect(rect);
        !shared.is_empty() && self.tiles.any_in(shared)
    }
}
