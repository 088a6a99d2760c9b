//! Preprocessing: reads, culls and projects the Gaussians of a set, a group after the other on each worker.

use super::cull::group::{GroupTask, cull};
use super::cull::occluders::Occluders;
use super::cull::occlusion::OcclusionMap;
use super::cull::tasks::group_tasks;
use super::project::group::project;
use super::project::scratch::Scratch;
use super::project::{panorama, vertex_projection};
use super::read::attributes::{Attributes, Fetcher};
use super::read::clusters::Clusters;
use super::read::models::Matrices;
use super::set::{GaussianSet, SortError};
use super::splats::group::ProjectedGroup;
use super::view::constants::ViewConstants;
use super::view::visible::Visible;
use crate::runtime::Runtime;
use crate::stats::counters::{Counter, Counters};
use crate::stats::optimizations::Optimization;
use devmem::{dispatch, host};
use rayon::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};

/// The most groups per task of a worker. Larger tasks make workers wait for the last one.
const GROUPS_PER_TASK: usize = 4;

/// The least number of groups per task, where little is done for each group.
const LEAST_GROUPS: usize = 64;

/// The result of preprocessing a set.
pub(crate) struct Preprocessed {
    /// The groups that the device projected, then those of vertex programs.
    pub(crate) groups: Vec<ProjectedGroup>,
    /// The number of groups that the device projected.
    pub(crate) fixed: usize,
    /// The counts of the groups that the device projected. `by_programs` has those of vertex programs.
    pub(crate) by_device: Counters,
    pub(crate) by_programs: Counters,
}

/// Preprocesses the Gaussians that have attributes, except those culled with their clusters, and those that vertex
/// programs project.
pub(crate) fn preprocess(
    set: &GaussianSet,
    clusters: &[Option<Arc<Clusters>>],
    runtime: &Runtime,
) -> Result<Preprocessed, SortError> {
    let begin = &set.begin;
    let optimizations = runtime.config().optimizations;
    let constants = ViewConstants {
        is_tracked: set.is_tracked(),
        ..ViewConstants::new(
            &begin.state,
            &begin.camera,
            &begin.viewport,
            Visible::from(set.bounds),
            set.depth,
            optimizations,
        )
    };
    let preprocessor = Preprocessor { runtime, constants: &constants, is_surfel: set.has_surfels() };
    let mut by_device = Counters::default();
    let map = preprocessor.occlusion(set, clusters);
    let tasks = group_tasks(set, clusters, &constants, map.as_ref(), &mut by_device)?;
    by_device.add(Counter::GaussiansRead, set.beyond_buffers);
    by_device.add(Counter::SkippedZeroRotation, set.beyond_buffers);
    if optimizations.has(Optimization::Harmonics) {
        let culled = by_device.get(Counter::OutsideByClusters) + by_device.get(Counter::HiddenByOthers);
        by_device.add(Counter::HarmonicsUnread, culled + set.beyond_buffers);
    }
    let mut groups = preprocessor.run(&tasks);
    panorama::append_copies(&mut groups);
    let fixed = groups.len();
    let shaded = vertex_projection::project_all(set, runtime)?;
    host::reserve(&mut groups, shaded.len());
    groups.extend(shaded);
    by_device.add_all(&counted(&groups[..fixed]));
    Ok(Preprocessed { by_programs: counted(&groups[fixed..]), groups, fixed, by_device })
}

/// The sum of all groups' counters.
fn counted(groups: &[ProjectedGroup]) -> Counters {
    let add = |mut sum: Counters, more: &Counters| {
        sum.add_all(more);
        sum
    };
    groups
        .par_iter()
        .with_min_len(LEAST_GROUPS)
        .fold(Counters::default, |sum, group| add(sum, &group.counters))
        .reduce(Counters::default, |sum, more| add(sum, &more))
}

/// Projects groups of Gaussians for one view.
struct Preprocessor<'a> {
    runtime: &'a Runtime,
    constants: &'a ViewConstants,
    is_surfel: bool,
}

impl Preprocessor<'_> {
    /// The occlusion map of a set; `None` if nothing is hidden, or the mode does not allow it. The occluders are projected for it.
    fn occlusion(&self, set: &GaussianSet, clusters: &[Option<Arc<Clusters>>]) -> Option<OcclusionMap> {
        // A recording describes hardware without this optimization.
        if self.runtime.recorder().is_some() {
            return None;
        }
        let occluders = Occluders::find(set, self.constants, clusters)?;
        let splats = self.run(&occluders.tasks());
        OcclusionMap::new(set, self.constants, clusters, &splats)
    }

    /// Projects all groups, and keeps their order.
    fn run(&self, tasks: &[GroupTask<'_>]) -> Vec<ProjectedGroup> {
        // Each thread allocates its scratch once. No other thread takes its lock, and no task waits for others, so that
        // no task begins within another on the same thread.
        let workers = (0..rayon::current_num_threads()).map(|_| Mutex::new(None));
        let workers: Vec<Mutex<Option<Worker>>> = workers.collect();
        let one = |task| {
            let own = rayon::current_thread_index().unwrap_or(0) % workers.len();
            let mut worker = workers[own].lock().unwrap_or_else(PoisonError::into_inner);
            self.task(worker.get_or_insert_with(Worker::new), task)
        };
        let mut groups = host::with_capacity(tasks.len());
        tasks.par_iter().with_max_len(GROUPS_PER_TASK).map(one).collect_into_vec(&mut groups);
        groups
    }

    /// Reads, culls and projects one group.
    fn task(&self, worker: &mut Worker, task: &GroupTask<'_>) -> ProjectedGroup {
        let Worker { fetcher, attributes, matrices, scratch } = worker;
        let mut projected = ProjectedGroup::default();
        let constants = self.constants;
        let group = task.source.read(fetcher, attributes, matrices, self.is_surfel);
        let frustum = task.frustum_of(&group, constants);
        let sequence = task.source.sequence();
        dispatch!(self.runtime.level(), simd => {
            let kept = cull(constants, simd, &group, frustum.as_deref(), &mut projected.counters);
            project(constants, simd, &group, &kept, scratch, sequence, &mut projected);
        });
        projected
    }
}

/// The buffers that a worker reuses from one group to the next.
struct Worker {
    fetcher: Fetcher,
    attributes: Box<Attributes>,
    /// Allocated when first needed.
    matrices: Option<Box<Matrices>>,
    scratch: Scratch,
}

impl Worker {
    fn new() -> Self {
        Self { fetcher: Fetcher::default(), attributes: Box::default(), matrices: None, scratch: Scratch::new() }
    }
}
