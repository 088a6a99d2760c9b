//! Gaussians that a vertex program projects: it writes centre, covariance, opacity, colour and perhaps the depth key of
//! each, and what follows is as with fixed-function projection.

use super::GaussianSet;
use super::depth::CenterDepth;
use super::fetch::BATCH;
use super::footprint::Visible;
use super::lanes::{Lanes, NO_LANES};
use super::project::Projection;
use super::scratch::Scratch;
use super::sort::ordered_bits;
use super::splat::{Projected, Splat};
use crate::geometry::points::PointShader;
use crate::packet::Draw;
use crate::program::interface::gaussian;
use crate::runtime::Runtime;
use crate::state::Viewport;
use crate::state::gaussian::{Camera, GaussianOrder};
use crate::stats::counters::Counter;
use devmem::dispatch;
use devmem::host;
use fearless_simd::{Level, Simd, prelude::*};
use isa::exec::Stopped;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Batches that a worker takes at a time, so that its shader is made rarely.
const BATCHES_PER_TASK: usize = 16;

/// How what the program writes becomes a Gaussian on the screen.
struct Shading {
    /// What is the same for Gaussians of any origin.
    projection: Projection,
    /// Half the viewport's extent and its middle, in framebuffer pixels.
    half: [f64; 2],
    middle: [f64; 2],
    order: GaussianOrder,
    /// Where the depth key is among the varyings, if it is there.
    writes_key: bool,
    depth: Option<CenterDepth>,
}

/// Gaussians of a batch that were kept, densely: what the program wrote of each.
struct Outputs {
    /// In clip space.
    position: [Lanes; 4],
    covariance: [Lanes; 3],
    opacity: Lanes,
    color: [[f32; 3]; BATCH],
    key: [f32; BATCH],
}

/// A batch to shade: of which instance, and the place of its first Gaussian in that and in the set.
#[derive(Clone, Copy)]
struct Job {
    instance: u32,
    first: u32,
    sequence: u32,
}

/// What a worker keeps from one batch to the next.
struct Worker<'a> {
    shader: PointShader<'a>,
    shading: Shading,
    outputs: Box<Outputs>,
    scratch: Scratch,
}

/// How many batches a draw takes.
pub(super) fn batches(draw: &Draw) -> u64 {
    let per_instance = draw.count.div_ceil(BATCH as u32);
    u64::from(per_instance) * u64::from(draw.instance_count)
}

/// Bytes that a draw's vertices take as they are read, and as the Gaussians that the program writes.
pub(super) fn vertex_bytes(draw: &Draw) -> u64 {
    let attributes = draw.attributes.iter();
    let read: usize = attributes.map(|stream| stream.format.texel_size()).sum();
    let index = draw
        .indices
        .as_ref()
        .map_or(0, |indices| indices.index_size);
    let written = 4 * (4 + u64::from(gaussian::VARYINGS));
    let vertices = u64::from(draw.count) * u64::from(draw.instance_count);
    vertices * (read as u64 + u64::from(index) + written)
}

/// Shades and projects a draw whose first Gaussian is number `sequence` of the set.
///
/// # Errors
/// [`Stopped`] if the program ran for too long.
pub(super) fn project(
    set: &GaussianSet,
    draw: &Draw,
    sequence: u32,
    runtime: &Runtime,
) -> Result<Vec<Projected>, Stopped> {
    let Some(viewport) = draw.state.viewports.first() else {
        return Ok(Vec::new());
    };
    let jobs = (0..draw.instance_count).flat_map(|instance| {
        let start = sequence.wrapping_add(instance.wrapping_mul(draw.count));
        (0..draw.count).step_by(BATCH).map(move |first| Job {
            instance,
            first,
            sequence: start.wrapping_add(first),
        })
    });
    let jobs = host::collect(jobs);
    let prepared = draw.vertex_bindings.bind(runtime.level());
    let (resources, cancel) = (prepared.resources(), AtomicBool::new(false));
    let worker = || {
        let shader = PointShader::new(draw, runtime, &resources, &cancel);
        Worker {
            shading: Shading::new(set, viewport, &shader, runtime),
            shader,
            outputs: Box::default(),
            scratch: Scratch::new(),
        }
    };
    let one = |worker: &mut Worker<'_>, job: &Job| {
        if cancel.load(Relaxed) {
            return Err(Stopped::Cancelled);
        }
        let end = draw.count.min(job.first.saturating_add(BATCH as u32));
        let done = worker.run(job, end, runtime.level());
        if done.is_err() {
            cancel.store(true, Relaxed);
        }
        done
    };
    let mut done = host::with_capacity(jobs.len());
    runtime.install(|| {
        jobs.par_iter()
            .with_min_len(BATCHES_PER_TASK)
            .map_init(worker, one)
            .collect_into_vec(&mut done);
    });
    draw.vertex_bindings.bump_generations();
    // That others were cancelled tells nothing.
    let failures = done.iter().filter_map(|done| done.as_ref().err());
    match failures.min_by_key(|stopped| **stopped == Stopped::Cancelled) {
        Some(stopped) => Err(*stopped),
        None => Ok(host::collect(done.into_iter().flatten())),
    }
}

impl Worker<'_> {
    /// Shades and projects the Gaussians of a batch up to `end`.
    fn run(&mut self, job: &Job, end: u32, level: Level) -> Result<Projected, Stopped> {
        let mut out = Projected::default();
        let (shading, outputs, scratch) = (&self.shading, &mut *self.outputs, &mut self.scratch);
        self.shader
            .shade(job.instance, job.first, end, &mut out.counters)?;
        shading.keep(&self.shader, outputs, scratch, &mut out);
        dispatch!(level, simd => shading.flatten(simd, outputs, scratch));
        shading.emit(level, outputs, scratch, job.sequence, &mut out);
        Ok(out)
    }
}

impl Default for Outputs {
    fn default() -> Self {
        Self {
            position: [NO_LANES; 4],
            covariance: [NO_LANES; 3],
            opacity: NO_LANES,
            color: [[0.0; 3]; BATCH],
            key: [0.0; BATCH],
        }
    }
}

impl Shading {
    fn new(
        set: &GaussianSet,
        viewport: &Viewport,
        shader: &PointShader<'_>,
        runtime: &Runtime,
    ) -> Self {
        let state = &set.begin.state;
        let visible = Visible::from(set.bounds);
        let skips = runtime.config().skips;
        // The clip volume takes the place of the camera's planes.
        let camera = Camera {
            near_plane: f32::NEG_INFINITY,
            ..Camera::default()
        };
        let half = [viewport.width, viewport.height].map(|size| 0.5 * f64::from(size));
        Self {
            projection: Projection::new(state, &camera, viewport, visible, None, skips),
            half,
            middle: [
                half[0] + f64::from(viewport.x),
                half[1] + f64::from(viewport.y),
            ],
            order: state.order,
            writes_key: shader.writes(gaussian::DEPTH_KEY),
            depth: set.depth,
        }
    }

    /// Packs the Gaussians that nothing is known against yet, and counts the first reason to skip the others.
    fn keep(
        &self,
        shader: &PointShader<'_>,
        kept: &mut Outputs,
        scratch: &mut Scratch,
        out: &mut Projected,
    ) {
        scratch.lanes.clear();
        let counters = &mut out.counters;
        for (lane, (position, varyings)) in shader.points().enumerate() {
            counters.add(Counter::GaussiansRead, 1);
            let value = |number: u32| {
                let bits = varyings.get(number as usize).copied().unwrap_or(0);
                f32::from_bits(bits)
            };
            let three = |first: u32| [0, 1, 2].map(|part| value(first + part));
            let (covariance, color) = (three(gaussian::COVARIANCE), three(gaussian::COLOR));
            let opacity = value(gaussian::OPACITY);
            let [_, _, z, w] = position;
            let key = if self.writes_key {
                value(gaussian::DEPTH_KEY)
            } else {
                w
            };
            let finite = |values: &[f32]| values.iter().all(|value| value.is_finite());
            let all_finite = finite(&position)
                && finite(&covariance)
                && finite(&color)
                && finite(&[opacity, key]);
            let skipped = if !all_finite {
                Some(Counter::SkippedNonFinite)
            } else if f64::from(opacity) < self.projection.alpha_floor {
                Some(Counter::SkippedFaint)
            } else if w <= 0.0 || z < 0.0 {
                Some(Counter::SkippedNear)
            } else if z > w {
                Some(Counter::SkippedFar)
            } else {
                None
            };
            if let Some(reason) = skipped {
                counters.add(reason, 1);
                continue;
            }
            let at = scratch.lanes.len() % BATCH;
            for (lanes, value) in kept.position.iter_mut().zip(position) {
                lanes[at] = value.into();
            }
            for (lanes, value) in kept.covariance.iter_mut().zip(covariance) {
                lanes[at] = value.into();
            }
            kept.opacity[at] = opacity.into();
            kept.color[at] = color;
            // Zero has no sign where depths are compared.
            kept.key[at] = key + 0.0;
            scratch.lanes.push(lane);
        }
    }

    /// Finds mean, covariance and opacity on the screen of the kept Gaussians.
    #[inline(always)]
    fn flatten<S: Simd>(&self, simd: S, kept: &Outputs, scratch: &mut Scratch) {
        let count = scratch.lanes.len();
        let (flat, depth) = (&mut *scratch.flat, &mut scratch.depth);
        let zero = S::f64s::splat(simd, 0.0);
        for at in (0..count).step_by(S::f64s::LEN) {
            let load = |lanes: &Lanes| S::f64s::from_slice(simd, &lanes[at..at + S::f64s::LEN]);
            let store = |value: S::f64s, lanes: &mut Lanes| {
                value.store_slice(&mut lanes[at..at + S::f64s::LEN]);
            };
            let w = load(&kept.position[3]);
            for axis in 0..2 {
                let place = load(&kept.position[axis]) / w;
                store(
                    place * self.half[axis] + self.middle[axis],
                    &mut flat.mean[axis],
                );
            }
            let [xx, xy, yy] = &kept.covariance;
            let (xx, xy, yy) = (load(xx), load(xy), load(yy));
            // Products of binary32 numbers are exact in binary64. Rounding in the program may have left less than
            // nothing, of which there is no root, and a logarithm of what is no number is that of zero.
            let area2 = xx * yy - xy * xy;
            let projection = &self.projection;
            projection.shape(simd, at, [xx, xy, yy], area2, load(&kept.opacity), flat);
            let determinant = load(&flat.determinant);
            // Both diagonal elements are positive, or neither is, where the determinant is positive.
            let definite = (xx + projection.low_pass).simd_gt(zero);
            store(definite.select(determinant, zero), &mut flat.determinant);
            // In front of no plane that is left.
            store(zero, depth);
        }
    }

    /// Finds the tiles of the kept Gaussians and appends what reaches some to `out`.
    fn emit(
        &self,
        level: Level,
        kept: &Outputs,
        scratch: &mut Scratch,
        sequence: u32,
        out: &mut Projected,
    ) {
        out.reserve(scratch.lanes.len());
        let projection = &self.projection;
        dispatch!(level, simd => projection.find_tiles(simd, scratch, out));
        for &at in &scratch.reached {
            let at = at % BATCH;
            let sequence = sequence.wrapping_add(scratch.lanes[at] as u32);
            let key = match self.order {
                GaussianOrder::ViewDepth | GaussianOrder::RadialDistance => {
                    ordered_bits(kept.key[at])
                }
                GaussianOrder::Primitive | GaussianOrder::PerPixel => sequence,
            };
            let [_, _, z, w] = &kept.position;
            let depth = self.depth.map_or(0, |depth| depth.encode(z[at] / w[at]));
            out.keys.push([key, sequence]);
            let splat = Splat::new(&scratch.flat, at, kept.color[at], depth);
            out.splats.push(splat);
            out.reaches.push(scratch.reaches.get(at));
        }
        let drawn = out.splats.len() as u64;
        out.counters.add(Counter::GaussiansDrawn, drawn);
    }
}
