//! The groups to project: groups of vertices, and clusters except those that are outside of the picture or hidden.

use super::frustum::{Frustum, Outside};
use super::group::GroupTask;
use super::occlusion::OcclusionMap;
use crate::gaussian::lanes::GROUP;
use crate::gaussian::read::clusters::{Cluster, Clusters};
use crate::gaussian::read::group::{GroupSource, MemberRun, Members};
use crate::gaussian::read::models::InstanceTransform;
use crate::gaussian::set::{GaussianSet, MAX_GROUPS, SortError, is_packed};
use crate::gaussian::view::constants::ViewConstants;
use crate::packet::GaussianAppend;
use crate::stats::counters::{Counter, Counters};
use devmem::host;
use std::sync::Arc;

/// The groups to project, in the order of draw, instance and, except for clusters, position in the draw. The Gaussians
/// of clusters that are left out are counted.
///
/// # Errors
/// [`SortError::TooManyGaussians`] if there are more groups than [`MAX_GROUPS`].
pub(crate) fn group_tasks<'a>(
    set: &'a GaussianSet,
    clusters: &'a [Option<Arc<Clusters>>],
    constants: &ViewConstants,
    occlusion: Option<&OcclusionMap>,
    counters: &mut Counters,
) -> Result<Vec<GroupTask<'a>>, SortError> {
    // A panorama repeats, so that Gaussians have copies on both sides.
    let sides = if constants.period.is_some() { 3 } else { 1 };
    let groups = set.groups().saturating_mul(sides);
    if groups > MAX_GROUPS {
        return Err(SortError::TooManyGaussians { groups });
    }
    let mut tasks = Vec::new();
    // There are no more Gaussians than lanes in groups, so that the sum wraps only after the last one, if at all.
    let mut sequence = 0u32;
    for (append, clusters) in set.appends.iter().zip(clusters) {
        let opacity = clusters.as_ref().map_or(1.0, |clusters| clusters.opacity);
        let view = InstanceView::new(constants, opacity);
        let has_harmonics = clusters.as_ref().map(|all| all.have_harmonics_of(append));
        if is_packed(append.count) {
            let task = |instance: u32, run| GroupTask {
                source: GroupSource {
                    append,
                    instance: append.first_instance.saturating_add(instance),
                    sequence: sequence.wrapping_add(instance.wrapping_mul(append.count)),
                    members: Members::Run(run),
                    has_harmonics: false,
                },
                frustum: Arc::clone(&view.frustum),
            };
            let count = u64::from(append.count);
            let gaussians = count * u64::from(append.instance_count);
            host::reserve(&mut tasks, gaussians.div_ceil(GROUP as u64) as usize);
            tasks.extend((0..gaussians).step_by(GROUP).map(|first| {
                let len = (gaussians - first).min(GROUP as u64) as u32;
                task((first / count) as u32, MemberRun { start: (first % count) as u32, len })
            }));
            sequence = sequence.wrapping_add(append.count.wrapping_mul(append.instance_count));
            continue;
        }
        for instance in 0..append.instance_count {
            let instance = append.first_instance.saturating_add(instance);
            let of_instance;
            let mut view = &view;
            let occlusion = occlusion.filter(|_| !append.attributes.model.is_some());
            if clusters.is_some() && append.attributes.model.is_some() {
                of_instance = InstanceView::of_instance(constants, append, instance, opacity);
                view = &of_instance;
            }
            let task = |members: Members<'a>| GroupTask {
                source: GroupSource {
                    append,
                    instance,
                    sequence,
                    members,
                    has_harmonics: has_harmonics.unwrap_or(false),
                },
                frustum: Arc::clone(&view.frustum),
            };
            let groups = match clusters {
                None => append.count.div_ceil(GROUP as u32) as usize,
                Some(clusters) => clusters.clusters.len(),
            };
            host::reserve(&mut tasks, groups);
            match clusters {
                None => {
                    let starts = (0..append.count).step_by(GROUP);
                    tasks.extend(starts.map(|start| {
                        task(Members::Run(MemberRun { start, len: (append.count - start).min(GROUP as u32) }))
                    }));
                }
                Some(clusters) => tasks.extend(
                    clusters
                        .clusters
                        .iter()
                        .filter(|cluster| {
                            !view.cull_cluster(cluster, counters)
                                && !occlusion.is_some_and(|map| map.cull_cluster(cluster, counters))
                        })
                        .map(|cluster| task(Members::Cluster(cluster))),
                ),
            }
            sequence = sequence.wrapping_add(append.count);
        }
    }
    Ok(tasks)
}

/// The frustum and the model of an instance.
struct InstanceView {
    frustum: Arc<Frustum>,
    /// The frustum in the instance's own space; `None` if rounding makes it uncertain.
    own: Option<Arc<Frustum>>,
    model: InstanceTransform,
}

impl InstanceView {
    /// The view of instances without a model whose opacities are at most `opacity`.
    fn new(constants: &ViewConstants, opacity: f32) -> Self {
        let frustum = Arc::new(Frustum::new(constants, opacity));
        Self { own: Some(Arc::clone(&frustum)), frustum, model: InstanceTransform::default() }
    }

    /// The view of an instance with a model, whose opacities without the model are at most `opacity`.
    fn of_instance(constants: &ViewConstants, append: &GaussianAppend, instance: u32, opacity: f32) -> Self {
        let model = InstanceTransform::read(append, instance);
        let frustum = Arc::new(Frustum::new(constants, model.greatest_opacity(opacity)));
        let own = match model.matrix {
            None => Some(Arc::clone(&frustum)),
            Some(matrix) => frustum.within(matrix).map(Arc::new),
        };
        Self { frustum, own, model }
    }

    /// True if a whole cluster is outside. Its Gaussians are then counted as skipped.
    fn cull_cluster(&self, cluster: &Cluster, counters: &mut Counters) -> bool {
        let mut bounds = cluster.bounds;
        bounds.opacity = self.model.greatest_opacity(bounds.opacity);
        let Some(reason) = self.own.as_ref().and_then(|own| own.excludes(&bounds)) else {
            return false;
        };
        let reason = match reason {
            Outside::Faint => Counter::SkippedFaint,
            Outside::Near => Counter::SkippedNear,
            Outside::Far => Counter::SkippedFar,
            Outside::Beside => Counter::SkippedOffScreen,
        };
        for counter in [reason, Counter::GaussiansRead, Counter::OutsideByClusters] {
            counters.add(counter, cluster.numbers.len() as u64);
        }
        true
    }
}
