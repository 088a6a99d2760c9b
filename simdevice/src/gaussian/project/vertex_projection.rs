//! Gaussians that a vertex program projects. It writes centre, covariance, opacity, colour and perhaps the depth key of
//! each; the stages after that are those of fixed-function projection.

use super::scratch::Scratch;
use super::screen::shape;
use super::tiles::find_tiles;
use crate::gaussian::lanes::{Bits, GROUP, GroupF64, NO_GROUP_F64};
use crate::gaussian::set::GaussianSet;
use crate::gaussian::sort::radix::ordered_bits;
use crate::gaussian::splats::group::ProjectedGroup;
use crate::gaussian::splats::identity::Identity;
use crate::gaussian::view::center_depth::CenterDepth;
use crate::gaussian::view::constants::ViewConstants;
use crate::gaussian::view::visible::Visible;
use crate::geometry::points::PointShader;
use crate::packet::Draw;
use crate::program::interface::gaussian;
use crate::runtime::Runtime;
use crate::state::Viewport;
use crate::state::gaussian::{Camera, GaussianOrder};
use crate::stats::counters::Counter;
use devmem::{dispatch, host};
use fearless_simd::{Level, Simd, prelude::*};
use isa::machine::Stopped;
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

/// The least number of groups per task, so that few shaders are created.
const GROUPS_PER_TASK: usize = 16;

/// The conversion of a program's outputs to Gaussians in the picture.
struct Shading {
    /// The constants that the stages after projection need.
    constants: ViewConstants,
    /// Half the viewport's extent, in framebuffer pixels; `middle` is its middle.
    half: [f64; 2],
    middle: [f64; 2],
    /// The normalized device coordinate of the near plane, 0 or -1.
    near: f32,
    order: GaussianOrder,
    /// True if the program writes the depth key.
    writes_key: bool,
    depth: Option<CenterDepth>,
}

/// The program's outputs for the kept Gaussians of a group, densely packed.
struct Outputs {
    /// The position in clip space.
    position: [GroupF64; 4],
    covariance: [GroupF64; 3],
    opacity: GroupF64,
    color: [[f32; 3]; GROUP],
    key: [f32; GROUP],
}

/// A group to shade: its instance, and the number of its first Gaussian in the instance and in the set.
#[derive(Clone, Copy)]
struct ShaderTask {
    instance: u32,
    first: u32,
    sequence: u32,
}

/// The state that a worker reuses from one group to the next.
struct Worker<'a> {
    shader: PointShader<'a>,
    shading: Shading,
    outputs: Box<Outputs>,
    scratch: Scratch,
}

/// The bytes of a draw's vertex attributes and indices, and of the Gaussians that the program writes.
pub(crate) fn vertex_bytes(draw: &Draw) -> u64 {
    let attributes = draw.attributes.iter();
    let read: usize = attributes.map(|stream| stream.format.texel_size()).sum();
    let index = draw.indices.as_ref().map_or(0, |indices| indices.index_size);
    let written = 4 * (4 + u64::from(gaussian::VARYINGS));
    let vertices = u64::from(draw.count) * u64::from(draw.instance_count);
    vertices * (read as u64 + u64::from(index) + written)
}

/// Shades and projects the Gaussians of a set that vertex programs project.
pub(crate) fn project_all(set: &GaussianSet, runtime: &Runtime) -> Result<Vec<ProjectedGroup>, Stopped> {
    let mut sequence = 0u32;
    for append in &set.appends {
        let gaussians = append.count.wrapping_mul(append.instance_count);
        sequence = sequence.wrapping_add(gaussians);
    }
    let mut groups = Vec::new();
    for draw in &set.draws {
        let shaded = project(set, draw, sequence, runtime)?;
        host::reserve(&mut groups, shaded.len());
        groups.extend(shaded);
        let gaussians = draw.count.wrapping_mul(draw.instance_count);
        sequence = sequence.wrapping_add(gaussians);
    }
    Ok(groups)
}

/// Shades and projects a draw whose first Gaussian is number `sequence` of the set.
///
/// # Errors
/// [`Stopped`] if the program ran for too long.
fn project(set: &GaussianSet, draw: &Draw, sequence: u32, runtime: &Runtime) -> Result<Vec<ProjectedGroup>, Stopped> {
    let Some(viewport) = draw.state.viewports.first() else {
        return Ok(Vec::new());
    };
    let tasks = (0..draw.instance_count).flat_map(|instance| {
        let start = sequence.wrapping_add(instance.wrapping_mul(draw.count));
        (0..draw.count).step_by(GROUP).map(move |first| ShaderTask {
            instance,
            first,
            sequence: start.wrapping_add(first),
        })
    });
    let tasks = host::collect(tasks);
    let prepared = draw.vertex_bindings.bind(runtime.level());
    let (resources, cancel) = (prepared.resources(), AtomicBool::new(false));
    let worker = || {
        let shader = PointShader::new(draw, set.layer, runtime, &resources, &cancel);
        Worker {
            shading: Shading::new(set, viewport, &shader, runtime),
            shader,
            outputs: Box::default(),
            scratch: Scratch::new(),
        }
    };
    let one = |worker: &mut Worker<'_>, task: &ShaderTask| {
        if cancel.load(Relaxed) {
            return Err(Stopped::Cancelled);
        }
        let end = draw.count.min(task.first.saturating_add(GROUP as u32));
        let done = worker.run(task, end, runtime.level());
        if done.is_err() {
            cancel.store(true, Relaxed);
        }
        done
    };
    let mut done = host::with_capacity(tasks.len());
    runtime.install(|| {
        tasks.par_iter().with_min_len(GROUPS_PER_TASK).map_init(worker, one).collect_into_vec(&mut done);
    });
    draw.vertex_bindings.bump_generations();
    // The error of the program that failed is reported, not the cancellation of others.
    let failures = done.iter().filter_map(|done| done.as_ref().err());
    match failures.min_by_key(|stopped| **stopped == Stopped::Cancelled) {
        Some(stopped) => Err(*stopped),
        None => Ok(host::collect(done.into_iter().flatten())),
    }
}

impl Worker<'_> {
    /// Shades and projects the Gaussians of a group up to `end`.
    fn run(&mut self, task: &ShaderTask, end: u32, level: Level) -> Result<ProjectedGroup, Stopped> {
        let mut projected = ProjectedGroup::default();
        let (shading, outputs, scratch) = (&self.shading, &mut *self.outputs, &mut self.scratch);
        self.shader.shade(task.instance, task.first, end, &mut projected.counters)?;
        shading.keep(&self.shader, outputs, scratch, &mut projected);
        dispatch!(level, simd => shading.to_screen(simd, outputs, scratch));
        shading.emit(level, outputs, scratch, task.sequence, &mut projected);
        Ok(projected)
    }
}

impl Default for Outputs {
    fn default() -> Self {
        Self {
            position: [NO_GROUP_F64; 4],
            covariance: [NO_GROUP_F64; 3],
            opacity: NO_GROUP_F64,
            color: [[0.0; 3]; GROUP],
            key: [0.0; GROUP],
        }
    }
}

impl Shading {
    fn new(set: &GaussianSet, viewport: &Viewport, shader: &PointShader<'_>, runtime: &Runtime) -> Self {
        let state = &set.begin.state;
        let visible = Visible::from(set.bounds);
        let optimizations = runtime.config().optimizations;
        // The clip volume replaces the camera's planes.
        let camera = Camera { near_plane: f32::NEG_INFINITY, ..Camera::default() };
        let half = [viewport.width, viewport.height].map(|size| 0.5 * f64::from(size));
        Self {
            constants: ViewConstants {
                is_tracked: set.is_tracked(),
                ..ViewConstants::new(state, &camera, viewport, visible, None, optimizations)
            },
            half,
            middle: [half[0] + f64::from(viewport.x), half[1] + f64::from(viewport.y)],
            near: if state.negative_one_to_one { -1.0 } else { 0.0 },
            order: state.order,
            writes_key: shader.writes(gaussian::DEPTH_KEY),
            depth: set.depth,
        }
    }

    /// Packs the Gaussians that no test culls, and counts the others by the first reason to skip them.
    fn keep(
        &self,
        shader: &PointShader<'_>,
        kept: &mut Outputs,
        scratch: &mut Scratch,
        projected: &mut ProjectedGroup,
    ) {
        scratch.lanes.clear();
        let counters = &mut projected.counters;
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
            let key = if self.writes_key { value(gaussian::DEPTH_KEY) } else { w };
            let finite = |values: &[f32]| values.iter().all(|value| value.is_finite());
            let all_finite = finite(&position) && finite(&covariance) && finite(&color) && finite(&[opacity, key]);
            let skipped = if !all_finite {
                Some(Counter::SkippedNonFinite)
            } else if f64::from(opacity) < self.constants.alpha_floor {
                Some(Counter::SkippedFaint)
            } else if w <= 0.0 || z < self.near * w {
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
            let at = scratch.lanes.len() % GROUP;
            for (lanes, value) in kept.position.iter_mut().zip(position) {
                lanes[at] = value.into();
            }
            for (lanes, value) in kept.covariance.iter_mut().zip(covariance) {
                lanes[at] = value.into();
            }
            kept.opacity[at] = opacity.into();
            kept.color[at] = color;
            // Negative zero becomes zero, so that both compare as equal.
            kept.key[at] = key + 0.0;
            scratch.lanes.push(lane);
        }
        scratch.kept = Bits::first(scratch.lanes.len());
    }

    /// Computes mean, covariance and opacity in the picture for the kept Gaussians.
    #[inline(always)]
    fn to_screen<S: Simd>(&self, simd: S, kept: &Outputs, scratch: &mut Scratch) {
        let count = scratch.lanes.len();
        let (screen, depth) = (&mut *scratch.screen, &mut scratch.depth);
        let zero = S::f64s::splat(simd, 0.0);
        for at in (0..count).step_by(S::f64s::LEN) {
            let load = |lanes: &GroupF64| S::f64s::from_slice(simd, &lanes[at..at + S::f64s::LEN]);
            let store = |value: S::f64s, lanes: &mut GroupF64| {
                value.store_slice(&mut lanes[at..at + S::f64s::LEN]);
            };
            let w = load(&kept.position[3]);
            for axis in 0..2 {
                let place = load(&kept.position[axis]) / w;
                store(place * self.half[axis] + self.middle[axis], &mut screen.mean[axis]);
            }
            let [xx, xy, yy] = &kept.covariance;
            let (xx, xy, yy) = (load(xx), load(xy), load(yy));
            // Products of binary32 numbers are exact in binary64. Rounding in the program may have made the difference
            // negative. Its square root is then NaN, and `log2` gives negative infinity.
            let area2 = xx * yy - xy * xy;
            let constants = &self.constants;
            shape(constants, simd, at, [xx, xy, yy], area2, load(&kept.opacity), screen);
            let determinant = load(&screen.determinant);
            // If the determinant is positive, the diagonal elements have the same sign.
            let definite = (xx + constants.low_pass).simd_gt(zero);
            store(definite.select(determinant, zero), &mut screen.determinant);
            // The planes that remain are at infinity.
            store(zero, depth);
        }
    }

    /// Finds the tiles of the kept Gaussians and appends those that reach some to `projected`.
    fn emit(&self, level: Level, kept: &Outputs, scratch: &mut Scratch, sequence: u32, projected: &mut ProjectedGroup) {
        projected.reserve(scratch.lanes.len());
        let constants = &self.constants;
        dispatch!(level, simd => find_tiles(constants, simd, scratch, projected));
        for &at in &scratch.reached {
            let at = at % GROUP;
            let sequence = sequence.wrapping_add(scratch.lanes[at] as u32);
            let key = match self.order {
                GaussianOrder::ViewDepth | GaussianOrder::RadialDistance => ordered_bits(kept.key[at]),
                GaussianOrder::Primitive | GaussianOrder::PerPixel => sequence,
            };
            let [_, _, z, w] = &kept.position;
            let depth = self.depth.map_or(0, |depth| depth.encode(z[at] / w[at]));
            projected.keys.push([key, sequence]);
            let splat = scratch.screen.splat(at, kept.color[at], depth);
            projected.splats.push(splat);
            projected.reaches.push(scratch.reaches.get(at));
            if constants.is_tracked {
                projected.identities.push(Identity::new(w[at], sequence));
            }
        }
        let drawn = projected.splats.len() as u64;
        projected.counters.add(Counter::GaussiansDrawn, drawn);
    }
}
