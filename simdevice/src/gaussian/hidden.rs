//! Gaussians behind others that leave no light for them. Large opaque ones, screens, are projected first, and followed front
//! to back: each takes of a tile's light at least what it takes of the pixel that it covers least. Where a tile's pixels are
//! all finished by then, nothing farther away contributes to it, whatever else is drawn; what reaches only such tiles is
//! hidden. The answer is conservative, and the picture the same.

use super::chunks::{Bounds, Chunk, Chunks};
use super::fetch::BATCH;
use super::footprint::Visible;
use super::frustum::Frustum;
use super::jobs::{Job, Part};
use super::project::Projection;
use super::scratch::Attributes;
use super::splat::{Projected, Splat};
use super::{GaussianSet, Workers};
use crate::limits::TILE_SIZE;
use crate::state::gaussian::{
    CameraModel, GaussianGeometry, GaussianOrder, GaussianPrecision, GaussianState,
};
use crate::state::{DepthStencil, Rect};
use crate::stats::counters::{Counter, Counters};
use crate::stats::optimizations::Skip;
use devmem::host;
use std::sync::Arc;

/// Regions of a picture along each axis: what is hidden is known of each.
const REGIONS: usize = 8;

/// Screens are at least as wide in the picture, in pixels: smaller ones cover no tile.
const LEAST_DEVIATION: f64 = 10.0;

/// What takes less of a tile is not followed.
const LEAST_ALPHA: f64 = 0.2;

/// What following screens may cost for each tile, in units of what it costs to see that a tile is finished.
const COST_PER_TILE: usize = 512;

/// What it costs to find what a screen takes of a tile, in the same units.
const TAKING: usize = 8;

/// What rounding may do to an alpha and to a product of many, relative to it.
const MARGIN: f64 = 1e-3;

/// What is hidden.
pub(super) struct Hidden {
    /// The whole picture, as far as anything is seen.
    whole: Frustum,
    /// Its parts, each as far as anything is seen there.
    regions: Vec<Frustum>,
}

impl Hidden {
    /// Whether nothing of a chunk is seen that is not placed by a model; its Gaussians are counted then.
    pub(super) fn leaves_out(&self, chunk: &Chunk, counters: &mut Counters) -> bool {
        if !self.hides(&chunk.bounds) {
            return false;
        }
        for counter in [Counter::GaussiansRead, Counter::HiddenByOthers] {
            counters.add(counter, chunk.numbers.len() as u64);
        }
        true
    }

    fn hides(&self, bounds: &Bounds) -> bool {
        let excludes = |part: &Frustum| part.excludes(bounds).is_some();
        excludes(&self.whole) || self.regions.iter().all(excludes)
    }
}

impl GaussianSet {
    /// What screens hide; `None` if that is nothing, or not to be known.
    pub(super) fn find_hidden(
        &self,
        workers: &Workers<'_>,
        chunks: &[Option<Arc<Chunks>>],
    ) -> Option<Hidden> {
        let projection = workers.projection;
        if !self.may_hide(workers) {
            return None;
        }
        let mut found = Vec::new();
        for (append, chunks) in self.appends.iter().zip(chunks) {
            if let Some(chunks) = chunks
                && !append.attributes.model.is_some()
            {
                let frustum = Arc::new(Frustum::new(projection, chunks.opacity));
                let screens = large_screens(projection, &frustum, chunks);
                found.push((append, frustum, screens));
            }
        }
        let mut jobs = Vec::new();
        for (append, frustum, screens) in &found {
            jobs.extend(screens.iter().map(|chunk| Job {
                append,
                instance: append.first_instance,
                sequence: 0,
                number: 0,
                has_harmonics: false,
                part: Part::Chunk(chunk),
                frustum: Arc::clone(frustum),
            }));
        }
        if jobs.is_empty() {
            return None;
        }
        let mut light = Light::new(self.bounds, &self.begin.state);
        light.pass(&workers.run(&jobs));
        light.hidden(projection, chunks)
    }

    /// Whether a finished pixel is all that it takes for what is farther away not to be seen.
    fn may_hide(&self, workers: &Workers<'_>) -> bool {
        let state = &self.begin.state;
        let is_along_axis = matches!(
            workers.projection.model,
            CameraModel::Pinhole | CameraModel::Orthographic
        );
        workers.projection.skips.has(Skip::HiddenChunks)
            // What was recorded is what hardware without this does.
            && workers.runtime.recorder().is_none()
            && is_along_axis
            && state.order == GaussianOrder::ViewDepth
            && state.geometry == GaussianGeometry::Volume
            && state.precision == GaussianPrecision::Float32
            && least_light(state) > 0.0
            // What is tested may not take the light that it could.
            && state.depth_stencil == DepthStencil::default()
            && self.resolve.is_none()
            && !self.bounds.is_empty()
    }
}

/// What is behind less light than this is not drawn.
fn least_light(state: &GaussianState) -> f32 {
    let budget = state.approximation.contribution_budget;
    state.transmittance_floor.max(budget)
}

/// The screens of chunks that may be wide enough in the picture, packed.
fn large_screens(projection: &Projection, frustum: &Frustum, chunks: &Chunks) -> Vec<Chunk> {
    let mut packed: Vec<Chunk> = Vec::new();
    for chunk in &chunks.screens {
        if frustum.excludes(&chunk.bounds).is_some() {
            continue;
        }
        for lane in 0..chunk.numbers.len() {
            if is_large(projection, &chunk.attributes, lane) {
                match packed.last_mut() {
                    Some(last) if last.numbers.len() < BATCH => last.push(chunk, lane),
                    _ => packed.push(Chunk::of_one(chunk, lane)),
                }
            }
        }
    }
    packed
}

/// Whether a Gaussian is about as wide as screens are.
fn is_large(projection: &Projection, attributes: &Attributes, lane: usize) -> bool {
    let mut per_unit = projection.focal[0].abs().max(projection.focal[1].abs());
    if projection.model == CameraModel::Pinhole {
        let forward = &projection.rotation[6..9];
        let depth: f64 = (0..3)
            .map(|axis| {
                let position = f64::from(attributes.position[axis][lane]);
                forward[axis] * (position - projection.eye[axis])
            })
            .sum();
        if depth <= f64::from(projection.near) {
            return false;
        }
        per_unit /= depth;
    }
    f64::from(attributes.second_scale(lane)) * per_unit >= LEAST_DEVIATION
}

/// What light is left of each tile of a picture.
struct Light {
    bounds: Rect,
    /// The first column and row of tiles, and how many.
    first: [u32; 2],
    count: [u32; 2],
    /// No pixel of the tile has more.
    left: Vec<f64>,
    /// The depth of what finished the tile, or infinity.
    depth: Vec<f32>,
    /// Pixels with less light are finished.
    floor: f64,
    /// The greatest alpha, and what is taken for the least.
    alphas: [f64; 2],
}

impl Light {
    fn new(bounds: Rect, state: &GaussianState) -> Self {
        let [x, y] = [bounds.x.max(0) as u32, bounds.y.max(0) as u32];
        let first = [x / TILE_SIZE, y / TILE_SIZE];
        let count = [
            (x + bounds.width).div_ceil(TILE_SIZE) - first[0],
            (y + bounds.height).div_ceil(TILE_SIZE) - first[1],
        ];
        let tiles = count[0] as usize * count[1] as usize;
        Self {
            bounds,
            first,
            count,
            left: host::filled(1.0, tiles),
            depth: host::filled(f32::INFINITY, tiles),
            floor: f64::from(least_light(state)) * (1.0 - MARGIN),
            alphas: [
                f64::from(state.alpha_ceiling),
                LEAST_ALPHA.max(f64::from(state.alpha_floor) * (1.0 + MARGIN)),
            ],
        }
    }

    /// Lets screens take light, front to back.
    fn pass(&mut self, batches: &[Projected]) {
        let mut order = Vec::new();
        for (number, batch) in batches.iter().enumerate() {
            for (place, &[key, _]) in batch.keys.iter().enumerate() {
                if reaches_far(&batch.splats[place]) {
                    host::push(&mut order, (key, number, place));
                }
            }
        }
        order.sort_unstable();
        let mut budget = COST_PER_TILE * self.left.len();
        let mut unfinished = self.left.len();
        for (key, number, place) in order {
            let splat = &batches[number].splats[place];
            let [columns, rows] = self.covered(splat);
            for row in rows {
                for column in columns.clone() {
                    let tile = (row * self.count[0] + column) as usize;
                    let is_finished = self.depth[tile] < f32::INFINITY;
                    let cost = if is_finished { 1 } else { TAKING };
                    let Some(rest) = budget.checked_sub(cost) else {
                        return;
                    };
                    budget = rest;
                    if !is_finished {
                        self.take(splat, key, [column, row]);
                        unfinished -= usize::from(self.depth[tile] < f32::INFINITY);
                    }
                }
            }
            if unfinished == 0 {
                return;
            }
        }
    }

    /// The columns and rows of the tiles of which a screen may take enough.
    fn covered(&self, splat: &Splat) -> [std::ops::Range<u32>; 2] {
        let [a, b, c] = splat.factor;
        let extent = f64::from(splat.log2_opacity) - self.alphas[1].log2();
        let half = extent.max(0.0).sqrt() / a.abs();
        let half = [half, half * a.hypot(b) / c.abs()];
        let along = |axis: usize| {
            let tile = |pixel: f64| pixel / f64::from(TILE_SIZE) - f64::from(self.first[axis]);
            // Centres are half a pixel within.
            let first = tile(splat.mean[axis] - half[axis] - 0.5).ceil();
            let end = tile(splat.mean[axis] + half[axis] + 0.5).floor();
            let within = |tile: f64| tile.clamp(0.0, self.count[axis].into()) as u32;
            within(first)..within(end)
        };
        [along(0), along(1)]
    }

    /// What a screen takes of a tile.
    fn take(&mut self, splat: &Splat, key: u32, [column, row]: [u32; 2]) {
        let tile = (row * self.count[0] + column) as usize;
        let [first_column, first_row] = self.first;
        let [ceiling, least] = self.alphas;
        let alpha = least_alpha(splat, [first_column + column, first_row + row]).min(ceiling);
        if alpha > least {
            self.left[tile] *= 1.0 - alpha * (1.0 - MARGIN);
            if self.left[tile] < self.floor {
                self.depth[tile] = super::sort::value_of(key);
            }
        }
    }

    /// What is hidden, if any region is finished; of chunks that may be as opaque as these.
    fn hidden(&self, projection: &Projection, chunks: &[Option<Arc<Chunks>>]) -> Option<Hidden> {
        let opacities = chunks.iter().flatten().map(|chunks| chunks.opacity);
        let opacity = opacities.fold(0.0, f32::max);
        let frustum_up_to = |farthest: f32, visible: Visible| {
            let mut projection = projection.clone();
            projection.visible = visible;
            // What is as far comes before or after.
            projection.far = projection.far.min(farthest.next_up());
            Frustum::new(&projection, opacity)
        };
        let mut regions = Vec::new();
        let mut any = false;
        for row in 0..REGIONS {
            for column in 0..REGIONS {
                let part = |axis: usize, number: usize| {
                    let end = |number: usize| self.count[axis] as usize * number / REGIONS;
                    end(number)..end(number + 1)
                };
                let (columns, rows) = (part(0, column), part(1, row));
                if columns.is_empty() || rows.is_empty() {
                    continue;
                }
                let mut farthest = f32::NEG_INFINITY;
                for y in rows.clone() {
                    for x in columns.clone() {
                        farthest = farthest.max(self.depth[y * self.count[0] as usize + x]);
                    }
                }
                any |= farthest < f32::INFINITY;
                let edge = |axis: usize, tile: usize| {
                    i64::from(TILE_SIZE) * (i64::from(self.first[axis]) + tile as i64)
                };
                let whole = Visible::from(self.bounds);
                let visible = Visible {
                    left: edge(0, columns.start).max(whole.left),
                    top: edge(1, rows.start).max(whole.top),
                    right: edge(0, columns.end).min(whole.right),
                    bottom: edge(1, rows.end).min(whole.bottom),
                };
                regions.push(frustum_up_to(farthest, visible));
            }
        }
        let farthest = self.depth.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        any.then(|| Hidden {
            whole: frustum_up_to(farthest, self.bounds.into()),
            regions,
        })
    }
}

/// Whether a splat may take light of a whole tile.
fn reaches_far(splat: &Splat) -> bool {
    // In units of the exponent, a tile's middle to its corners.
    let [a, _, c] = splat.factor.map(f64::abs);
    !splat.wide && a.max(c) * LEAST_DEVIATION < 1.5
}

/// The least alpha of a splat at the pixel centres of a tile: that at a corner, since exponents are convex.
fn least_alpha(splat: &Splat, [column, row]: [u32; 2]) -> f64 {
    let last = f64::from(TILE_SIZE) - 1.0;
    let [x, y] = [column, row].map(|tile| f64::from(tile * TILE_SIZE) + 0.5);
    let [a, b, c] = splat.factor;
    let mut greatest = 0.0f64;
    for [x, y] in [[x, y], [x + last, y], [x, y + last], [x + last, y + last]] {
        let (dx, dy) = (x - splat.mean[0], y - splat.mean[1]);
        let (u, v) = (a * dx, b * dx + c * dy);
        greatest = greatest.max(u * u + v * v);
    }
    (f64::from(splat.log2_opacity) - greatest).exp2()
}
