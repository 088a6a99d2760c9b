//! Occluders: large and opaque Gaussians that may hide others.

use super::frustum::Frustum;
use super::group::GroupTask;
use crate::gaussian::lanes::GROUP;
use crate::gaussian::read::attributes::Attributes;
use crate::gaussian::read::clusters::{Cluster, Clusters};
use crate::gaussian::read::group::{GroupSource, Members};
use crate::gaussian::set::GaussianSet;
use crate::gaussian::splats::splat::Splat;
use crate::gaussian::view::constants::ViewConstants;
use crate::packet::GaussianAppend;
use crate::state::DepthStencil;
use crate::state::gaussian::{
    CameraModel, GaussianCutOff, GaussianGeometry, GaussianOrder, GaussianPrecision, GaussianState,
};
use crate::stats::optimizations::Optimization;
use std::sync::Arc;

/// The least deviation of an occluder in the picture, in pixels. Smaller ones cover no tile.
const LEAST_DEVIATION: f64 = 10.0;

/// The occluders of a set, by append.
pub(crate) struct Occluders<'a>(Vec<OccludersOfAppend<'a>>);

/// The occluders of an append, packed into clusters.
struct OccludersOfAppend<'a> {
    append: &'a GaussianAppend,
    frustum: Arc<Frustum>,
    clusters: Vec<Cluster>,
}

impl<'a> Occluders<'a> {
    /// The occluders of a set that may be wide enough in the picture; `None` if there are none, or the mode does not allow
    /// them.
    pub(crate) fn find(set: &'a GaussianSet, view: &ViewConstants, clusters: &[Option<Arc<Clusters>>]) -> Option<Self> {
        if !may_hide(set, view) {
            return None;
        }
        let mut found = Vec::new();
        for (append, clusters) in set.appends.iter().zip(clusters) {
            if let Some(clusters) = clusters
                && !append.attributes.model.is_some()
            {
                let frustum = Arc::new(Frustum::new(view, clusters.opacity));
                let clusters = large_occluders(view, &frustum, clusters);
                found.push(OccludersOfAppend { append, frustum, clusters });
            }
        }
        let any = found.iter().any(|occluders| !occluders.clusters.is_empty());
        any.then_some(Self(found))
    }

    /// The groups to project.
    pub(crate) fn tasks(&self) -> Vec<GroupTask<'_>> {
        let mut tasks = Vec::new();
        for OccludersOfAppend { append, frustum, clusters } in &self.0 {
            tasks.extend(clusters.iter().map(|cluster| GroupTask {
                source: GroupSource {
                    append,
                    instance: append.first_instance,
                    sequence: 0,
                    members: Members::Cluster(cluster),
                    has_harmonics: false,
                },
                frustum: Arc::clone(frustum),
            }));
        }
        tasks
    }
}

/// True if, in this mode, a finished pixel hides everything that is farther away.
fn may_hide(set: &GaussianSet, view: &ViewConstants) -> bool {
    let state = &set.begin.state;
    let is_along_axis = matches!(view.model, CameraModel::Pinhole | CameraModel::Orthographic);
    view.optimizations.has(Optimization::OcclusionCulling)
        && is_along_axis
        && state.order == GaussianOrder::ViewDepth
        && state.geometry == GaussianGeometry::Volume
        && state.precision == GaussianPrecision::Float32
        // What is cut off takes no transmittance there.
        && state.footprint.cut_off == GaussianCutOff::None
        && least_transmittance(state) > 0.0
        // With depth or stencil tests an occluder may be rejected.
        && state.depth_stencil == DepthStencil::default()
        && set.fragment_stage.is_none()
        && !set.bounds.is_empty()
}

/// The transmittance below which nothing more is drawn.
pub(crate) fn least_transmittance(state: &GaussianState) -> f32 {
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

/// True if a splat may cover a whole tile.
pub(crate) fn reaches_far(splat: &Splat) -> bool {
    // The distance from a tile's middle to its edges, in units of the exponent.
    let [a, _, c] = splat.factor.map(f64::abs);
    !splat.exceeds_period && a.max(c) * LEAST_DEVIATION < 1.5
}
