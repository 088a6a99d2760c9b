//! Gaussians behind others that leave no light for them. Large opaque ones, occluders, are projected first, and followed front
//! to back: each takes of a tile's light at least what it takes of the pixel that it covers least. Where a tile's pixels are
//! all finished by then, nothing farther away contributes to it, whatever else is drawn; what reaches only such tiles is
//! hidden. The answer is conservative, and the picture the same.

use super::attributes::Attributes;
use super::camera::ViewConstants;
use super::clusters::{Cluster, Clusters};
use super::footprint::Visible;
use super::frustum::{Bounds, Frustum};
use super::lanes::GROUP;
use super::preprocess::{GroupSource, GroupTask, Preprocessor};
use super::set::GaussianSet;
use super::sort;
use super::splat::{ProjectedGroup, Splat};
use crate::limits::TILE_SIZE;
use crate::state::gaussian::{
    CameraModel, GaussianCutOff, GaussianGeometry, GaussianOrder, GaussianPrecision, GaussianState,
};
use crate::state::{DepthStencil, Rect};
use crate::stats::counters::{Counter, Counters};
use crate::stats::optimizations::Optimization;
use devmem::host;
use std::sync::Arc;

/// Regions of a picture along each axis: what is hidden is known of each.
const REGIONS: usize = 8;

/// Screens are at least as wide in the picture, in pixels: smaller ones cover no tile.
const LEAST_DEVIATION: f64 = 10.0;

/// What takes less of a tile is not followed.
const LEAST_ALPHA: f64 = 0.2;

/// What following occluders may cost for each tile, in units of what it costs to see that a tile is finished.
const COST_PER_TILE: usize = 512;

/// What it costs to find what an occluder takes of a tile, in the same units.
const TAKING: usize = 8;

/// What rounding may do to an alpha and to a product of many, relative to it.
const MARGIN: f64 = 1e-3;

/// What is hidden.
pub(super) struct OcclusionMap {
    /// The whole picture, as far as anything is seen.
    whole: Frustum,
    /// Its parts, each as far as anything is seen there.
    regions: Vec<Frustum>,
}

impl OcclusionMap {
    /// Whether nothing of a cluster is seen that is not placed by a model; its Gaussians are counted then.
    pub(super) fn cull_cluster(&self, cluster: &Cluster, counters: &mut Counters) -> bool {
        if !self.hides(&cluster.bounds) {
            return false;
        }
        for counter in [Counter::GaussiansRead, Counter::HiddenByOthers] {
            counters.add(counter, cluster.numbers.len() as u64);
        }
        true
    }

    fn hides(&self, bounds: &Bounds) -> bool {
        let excludes = |part: &Frustum| part.excludes(bounds).is_some();
        excludes(&self.whole) || self.regions.iter().all(excludes)
    }
}

/// What occluders hide; `None` if that is nothing, or not to be known.
pub(super) fn find(
    set: &GaussianSet,
    preprocessor: &Preprocessor<'_>,
    clusters: &[Option<Arc<Clusters>>],
) -> Option<OcclusionMap> {
    let constants = preprocessor.constants;
    if !may_hide(set, preprocessor) {
        return None;
    }
    let mut found = Vec::new();
    for (append, clusters) in set.appends.iter().zip(clusters) {
        if let Some(clusters) = clusters
            && !append.attributes.model.is_some()
        {
            let frustum = Arc::new(Frustum::new(constants, clusters.opacity));
            let occluders = large_occluders(constants, &frustum, clusters);
            found.push((append, frustum, occluders));
        }
    }
    let mut tasks = Vec::new();
    for (append, frustum, occluders) in &found {
        tasks.extend(occluders.iter().map(|cluster| GroupTask {
            append,
            instance: append.first_instance,
            sequence: 0,
            has_harmonics: false,
            part: GroupSource::Cluster(cluster),
            frustum: Arc::clone(frustum),
        }));
    }
    if tasks.is_empty() {
        return None;
    }
    let mut light = TileTransmittance::new(set.bounds, &set.begin.state);
    light.pass(&preprocessor.run(&tasks));
    light.occlusion(constants, clusters)
}

/// Whether a finished pixel is all that it takes for what is farther away not to be seen.
fn may_hide(set: &GaussianSet, preprocessor: &Preprocessor<'_>) -> bool {
    let state = &set.begin.state;
    let is_along_axis = matches!(
        preprocessor.constants.model,
        CameraModel::Pinhole | CameraModel::Orthographic
    );
    preprocessor.constants.optimizations.has(Optimization::OcclusionCulling)
        // What was recorded is what hardware without this does.
        && preprocessor.runtime.recorder().is_none()
        && is_along_axis
        && state.order == GaussianOrder::ViewDepth
        && state.geometry == GaussianGeometry::Volume
        && state.precision == GaussianPrecision::Float32
        // What is cut off takes no light there.
        && state.footprint.cut_off == GaussianCutOff::None
        && least_light(state) > 0.0
        // What is tested may not take the light that it could.
        && state.depth_stencil == DepthStencil::default()
        && set.resolve.is_none()
        && !set.bounds.is_empty()
}

/// What is behind less light than this is not drawn.
fn least_light(state: &GaussianState) -> f32 {
    let budget = state.approximation.contribution_budget;
    state.transmittance_floor.max(budget)
}

/// The occluders of clusters that may be wide enough in the picture, packed.
fn large_occluders(
    constants: &ViewConstants,
    frustum: &Frustum,
    clusters: &Clusters,
) -> Vec<Cluster> {
    let mut packed: Vec<Cluster> = Vec::new();
    for cluster in &clusters.occluders {
        if frustum.excludes(&cluster.bounds).is_some() {
            continue;
        }
        for lane in 0..cluster.numbers.len() {
            if is_large(constants, &cluster.attributes, lane) {
                match packed.last_mut() {
                    Some(last) if last.numbers.len() < GROUP => last.push(cluster, lane),
                    _ => packed.push(Cluster::of_one(cluster, lane)),
                }
            }
        }
    }
    packed
}

/// Whether a Gaussian is about as wide as occluders are.
fn is_large(constants: &ViewConstants, attributes: &Attributes, lane: usize) -> bool {
    let mut per_unit = constants.focal[0].abs().max(constants.focal[1].abs());
    if constants.model == CameraModel::Pinhole {
        let forward = &constants.rotation[6..9];
        let depth: f64 = (0..3)
            .map(|axis| {
                let position = f64::from(attributes.position[axis][lane]);
                forward[axis] * (position - constants.eye[axis])
            })
            .sum();
        if depth <= f64::from(constants.near) {
            return false;
        }
        per_unit /= depth;
    }
    f64::from(attributes.second_scale(lane)) * per_unit >= LEAST_DEVIATION
}

/// What light is left of each tile of a picture.
struct TileTransmittance {
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

impl TileTransmittance {
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

    /// Lets occluders take light, front to back.
    fn pass(&mut self, groups: &[ProjectedGroup]) {
        let mut order = Vec::new();
        for (number, group) in groups.iter().enumerate() {
            for (place, &[key, _]) in group.keys.iter().enumerate() {
                if reaches_far(&group.splats[place]) {
                    host::push(&mut order, (key, number, place));
                }
            }
        }
        order.sort_unstable();
        let mut budget = COST_PER_TILE * self.left.len();
        let mut unfinished = self.left.len();
        for (key, number, place) in order {
            let splat = &groups[number].splats[place];
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
                        self.attenuate(splat, key, [column, row]);
                        unfinished -= usize::from(self.depth[tile] < f32::INFINITY);
                    }
                }
            }
            if unfinished == 0 {
                return;
            }
        }
    }

    /// The columns and rows of the tiles of which an occluder may take enough.
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

    /// What an occluder takes of a tile.
    fn attenuate(&mut self, splat: &Splat, key: u32, [column, row]: [u32; 2]) {
        let tile = (row * self.count[0] + column) as usize;
        let [first_column, first_row] = self.first;
        let [ceiling, least] = self.alphas;
        let alpha = least_alpha(splat, [first_column + column, first_row + row]).min(ceiling);
        if alpha > least {
            self.left[tile] *= 1.0 - alpha * (1.0 - MARGIN);
            if self.left[tile] < self.floor {
                self.depth[tile] = sort::value_of(key);
            }
        }
    }

    /// What is hidden, if any region is finished; of clusters that may be as opaque as these.
    fn occlusion(
        &self,
        constants: &ViewConstants,
        clusters: &[Option<Arc<Clusters>>],
    ) -> Option<OcclusionMap> {
        let opacities = clusters.iter().flatten().map(|clusters| clusters.opacity);
        let opacity = opacities.fold(0.0, f32::max);
        let frustum_up_to = |farthest: f32, visible: Visible| {
            let mut constants = constants.clone();
            constants.visible = visible;
            // What is as far comes before or after.
            constants.far = constants.far.min(farthest.next_up());
            Frustum::new(&constants, opacity)
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
        any.then(|| OcclusionMap {
            whole: frustum_up_to(farthest, self.bounds.into()),
            regions,
        })
    }
}

/// Whether a splat may take light of a whole tile.
fn reaches_far(splat: &Splat) -> bool {
    // In units of the exponent, a tile's middle to its corners.
    let [a, _, c] = splat.factor.map(f64::abs);
    !splat.exceeds_period && a.max(c) * LEAST_DEVIATION < 1.5
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
