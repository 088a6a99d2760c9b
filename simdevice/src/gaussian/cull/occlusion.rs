//! Occlusion culling: finds Gaussians behind others through which no visible transmittance is left. Occluders, which
//! are large and opaque, are projected first and blended front to back: each multiplies a tile's transmittance by that
//! of the pixel that it covers least. Where all pixels of a tile are finished, nothing farther away contributes to the
//! tile, whatever else is drawn. A Gaussian that reaches only such tiles is hidden. The test is conservative, and the
//! picture stays the same.

use super::frustum::Frustum;
use super::occluders::{least_transmittance, reaches_far};
use crate::gaussian::read::clusters::{Bounds, Cluster, Clusters};
use crate::gaussian::set::GaussianSet;
use crate::gaussian::sort::radix;
use crate::gaussian::splats::group::ProjectedGroup;
use crate::gaussian::splats::splat::Splat;
use crate::gaussian::view::constants::ViewConstants;
use crate::gaussian::view::visible::Visible;
use crate::limits::TILE_SIZE;
use crate::state::Rect;
use crate::state::gaussian::GaussianState;
use crate::stats::counters::{Counter, Counters};
use devmem::host;
use std::sync::Arc;

/// The number of regions of a picture along each axis. Each has its own depth beyond which everything is hidden.
const REGIONS: usize = 8;

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
pub(crate) struct OcclusionMap {
    /// The whole picture, up to the farthest visible depth.
    whole: Frustum,
    /// The regions of the picture, each up to its farthest visible depth.
    regions: Vec<Frustum>,
}

impl OcclusionMap {
    /// True if nothing of a cluster is visible. Its Gaussians are then counted as hidden. The cluster must not have a
    /// model.
    pub(crate) fn cull_cluster(&self, cluster: &Cluster, counters: &mut Counters) -> bool {
        if !self.hides(&cluster.bounds) {
            return false;
        }
        for counter in [Counter::GaussiansRead, Counter::HiddenByOthers] {
            counters.add(counter, cluster.numbers.len() as u64);
        }
        true
    }

    /// The map of a set whose occluders were projected to `splats`; `None` if they hide nothing. It is valid for clusters of at most
    /// the opacities of `clusters`.
    pub(crate) fn new(
        set: &GaussianSet,
        view: &ViewConstants,
        clusters: &[Option<Arc<Clusters>>],
        splats: &[ProjectedGroup],
    ) -> Option<Self> {
        let mut transmittance = TileTransmittance::new(set.bounds, &set.begin.state);
        transmittance.blend(splats);
        transmittance.occlusion(view, clusters)
    }

    fn hides(&self, bounds: &Bounds) -> bool {
        let excludes = |part: &Frustum| part.excludes(bounds).is_some();
        excludes(&self.whole) || self.regions.iter().all(excludes)
    }
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
            floor: f64::from(least_transmittance(state)) * (1.0 - MARGIN),
            alphas: [f64::from(state.alpha_ceiling), LEAST_ALPHA.max(f64::from(state.alpha_floor) * (1.0 + MARGIN))],
        }
    }

    /// Blends occluders front to back.
    fn blend(&mut self, groups: &[ProjectedGroup]) {
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
        let extent = f64::from(splat.log2_opacity) - libm::log2(self.alphas[1]);
        let half = extent.max(0.0).sqrt() / a.abs();
        let half = [half, half * libm::hypot(a, b) / c.abs()];
        let along = |axis: usize| {
            let tile = |pixel: f64| pixel / f64::from(TILE_SIZE) - f64::from(self.first[axis]);
            // Pixel centres are half a pixel inside the tile.
            let first = libm::ceil(tile(splat.mean[axis] - half[axis] - 0.5));
            let end = libm::floor(tile(splat.mean[axis] + half[axis] + 0.5));
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
                self.depth[tile] = radix::value_of(key);
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
    libm::exp2(f64::from(splat.log2_opacity) - greatest)
}
