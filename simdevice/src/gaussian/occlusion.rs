//! Occlusion culling: finds Gaussians behind others through which no visible transmittance is left. Occluders, which
//! are large and opaque, are projected first and blended front to back: each multiplies a tile's transmittance by that
//! of the pixel that it covers least. Where all pixels of a tile are finished, nothing farther away contributes to the
//! tile, whatever else is drawn. A Gaussian that reaches only such tiles is hidden. The test is conservative, and the
//! picture stays the same.

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

/// The number of regions of a picture along each axis. Each has its own depth beyond which everything is hidden.
const REGIONS: usize = 8;

/// The least deviation of an occluder in the picture, in pixels. Smaller ones cover no tile.
const LEAST_DEVIATION: f64 = 10.0;

/// The least alpha in a tile for which an occluder is blended there.
const LEAST_ALPHA: f64 = 0.2;

/// The cost of blending occluders that is allowed for each tile. The unit is the cost of a test whether a tile is
/// finished.
const COST_PER_TILE: usize = 512;

/// The cost of blending an occluder into a tile, in the same unit.
const TAKING: usize = 8;

/// The relative rounding error of an alpha and of a product of many.
const MARGIN: f64 = 1e-3;

/// The part of space that occluders leave visible.
pub(super) struct OcclusionMap {
    /// The whole picture, up to the farthest visible depth.
    whole: Frustum,
    /// The regions of the picture, each up to its farthest visible depth.
    regions: Vec<Frustum>,
}

impl OcclusionMap {
    /// True if nothing of a cluster is visible. Its Gaussians are then counted as hidden. The cluster must not have a
    /// model.
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

/// The occlusion map of a set; `None` if nothing is hidden, or the mode does not allow it.
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

/// True if, in this mode, a finished pixel hides everything that is farther away.
fn may_hide(set: &GaussianSet, preprocessor: &Preprocessor<'_>) -> bool {
    let state = &set.begin.state;
    let is_along_axis = matches!(preprocessor.constants.model, CameraModel::Pinhole | CameraModel::Orthographic);
    preprocessor.constants.optimizations.has(Optimization::OcclusionCulling)
        // A recording describes hardware without this optimization.
        && preprocessor.runtime.recorder().is_none()
        && is_along_axis
        && state.order == GaussianOrder::ViewDepth
        && state.geometry == GaussianGeometry::Volume
        && state.precision == GaussianPrecision::Float32
        // What is cut off takes no light there.
        && state.footprint.cut_off == GaussianCutOff::None
        && least_light(state) > 0.0
        // With depth or stencil tests an occluder may be rejected.
        && state.depth_stencil == DepthStencil::default()
        && set.resolve.is_none()
        && !set.bounds.is_empty()
}

/// The transmittance below which nothing more is drawn.
fn least_light(state: &GaussianState) -> f32 {
    let budget = state.approximation.contribution_budget;
    state.transmittance_floor.max(budget)
}

/// The clusters' occluders that may be wide enough in the picture, packed into new clusters.
fn large_occluders(constants: &ViewConstants, frustum: &Frustum, clusters: &Clusters) -> Vec<Cluster> {
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

/// True if a Gaussian is approximately as wide in the picture as an occluder must be.
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

/// The transmittance of each tile of a picture.
struct TileTransmittance {
    bounds: Rect,
    /// The first column and row of tiles.
    first: [u32; 2],
    count: [u32; 2],
    /// An upper bound of the transmittance of the tile's pixels.
    left: Vec<f64>,
    /// The depth of the occluder that finished the tile, or infinity.
    depth: Vec<f32>,
    /// The transmittance below which pixels are finished.
    floor: f64,
    /// The alpha ceiling, and the least alpha that is blended.
    alphas: [f64; 2],
}

impl TileTransmittance {
    fn new(bounds: Rect, state: &GaussianState) -> Self {
        let [x, y] = [bounds.x.max(0) as u32, bounds.y.max(0) as u32];
        let first = [x / TILE_SIZE, y / TILE_SIZE];
        let count =
            [(x + bounds.width).div_ceil(TILE_SIZE) - first[0], (y + bounds.height).div_ceil(TILE_SIZE) - first[1]];
        let tiles = count[0] as usize * count[1] as usize;
        Self {
            bounds,
            first,
            count,
            left: host::filled(1.0, tiles),
            depth: host::filled(f32::INFINITY, tiles),
            floor: f64::from(least_light(state)) * (1.0 - MARGIN),
            alphas: [f64::from(state.alpha_ceiling), LEAST_ALPHA.max(f64::from(state.alpha_floor) * (1.0 + MARGIN))],
        }
    }

    /// Blends occluders front to back.
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

    /// The columns and rows of the tiles of which an occluder may cover enough.
    fn covered(&self, splat: &Splat) -> [std::ops::Range<u32>; 2] {
        let [a, b, c] = splat.factor;
        let extent = f64::from(splat.log2_opacity) - self.alphas[1].log2();
        let half = extent.max(0.0).sqrt() / a.abs();
        let half = [half, half * a.hypot(b) / c.abs()];
        let along = |axis: usize| {
            let tile = |pixel: f64| pixel / f64::from(TILE_SIZE) - f64::from(self.first[axis]);
            // Pixel centres are half a pixel inside the tile.
            let first = tile(splat.mean[axis] - half[axis] - 0.5).ceil();
            let end = tile(splat.mean[axis] + half[axis] + 0.5).floor();
            let within = |tile: f64| tile.clamp(0.0, self.count[axis].into()) as u32;
            within(first)..within(end)
        };
        [along(0), along(1)]
    }

    /// Multiplies a tile's transmittance by what an occluder leaves of it.
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

    /// The map of the hidden space, if any region is finished. It is valid for clusters of at most these clusters'
    /// opacities.
    fn occlusion(&self, constants: &ViewConstants, clusters: &[Option<Arc<Clusters>>]) -> Option<OcclusionMap> {
        let opacities = clusters.iter().flatten().map(|clusters| clusters.opacity);
        let opacity = opacities.fold(0.0, f32::max);
        let frustum_up_to = |farthest: f32, visible: Visible| {
            let mut constants = constants.clone();
            constants.visible = visible;
            // Gaussians at the same depth may come before or after.
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
                let edge =
                    |axis: usize, tile: usize| i64::from(TILE_SIZE) * (i64::from(self.first[axis]) + tile as i64);
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
        any.then(|| OcclusionMap { whole: frustum_up_to(farthest, self.bounds.into()), regions })
    }
}

/// True if a splat may cover a whole tile.
fn reaches_far(splat: &Splat) -> bool {
    // The distance from a tile's middle to its edges, in units of the exponent.
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
