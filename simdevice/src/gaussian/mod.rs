//! Gaussian draws: from vertex attributes to a binned, depth-sorted set that the tile engine renders.
//!
//! [`sort_and_bin`] runs the stages in turn, each in a module: [`reuse`] (an unchanged set is not made again),
//! [`cluster_cache`] and [`clusters`] (neighbours in space with common bounds), [`occlusion`] (clusters that others
//! hide), [`group_tasks`] (the groups that remain), [`preprocess`] (projection to the rasterizer's nine numbers, tiles,
//! colours and keys; [`vertex_projection`] where a vertex program projects), [`depth_order`], [`tile_lists`],
//! [`sorted_set`] (the result).

mod attributes;
pub mod caches;
mod camera;
pub(crate) mod cluster_cache;
mod clusters;
pub(crate) mod cut_off;
pub(crate) mod depth;
mod depth_order;
pub(crate) mod footprint;
mod frustum;
mod group_tasks;
pub(crate) mod identity;
mod instances;
mod lanes;
mod occlusion;
mod panorama;
mod preprocess;
pub(crate) mod ray_depth;
mod recording;
pub(crate) mod reuse;
mod scratch;
mod set;
#[doc(hidden)] // For the benchmarks.
pub mod sort;
mod sorted_set;
pub mod spherical_harmonics;
pub(crate) mod splat;
pub(crate) mod surfel;
pub(crate) mod tile_lists;
mod tiles;
mod unscented;
mod vertex_projection;

pub use set::{GaussianSet, SortError};
pub use sorted_set::BinnedDraw;

use crate::runtime::Runtime;
use crate::stats::counters::{Counter, Counters};
use crate::stats::optimizations::Optimization;
use crate::stats::recorder::DrawRecord;
use caches::Caches;
use camera::ViewConstants;
use clusters::Clusters;
use devmem::host;
use footprint::Visible;
use preprocess::Preprocessor;
use rayon::prelude::*;
use reuse::Key;
use sort::SortBuffers;
use sorted_set::SortedSet;
use splat::ProjectedGroup;
use std::sync::Arc;
use std::time::Instant;
use tile_lists::TileLists;

/// The least number of groups per task, where little is done for each group.
const LEAST_GROUPS: usize = 64;

/// Preprocesses, sorts and bins a set, unless the cache still has the result of an equal one.
///
/// # Errors
/// [`SortError`] if the set exceeds what 32 bits can number, or a vertex program runs for too long.
pub fn sort_and_bin(
    set: GaussianSet,
    runtime: &Runtime,
    caches: &Caches,
    counters: &mut Counters,
) -> Result<BinnedDraw, SortError> {
    let clusters = cluster_cache::find(&set, &caches.clusters, runtime, counters);
    let config = runtime.config();
    let is_kept = config.optimizations.has(Optimization::TemporalReuse);
    let is_kept = is_kept && runtime.recorder().is_none();
    let key = Key::new(&set, &clusters).filter(|_| is_kept);
    if let Some(key) = &key
        && let Some(sorted) = caches.last_sets.find(key)
    {
        counters.add_all(&sorted.counters);
        counters.add(Counter::SetsUnchanged, 1);
        return Ok(BinnedDraw::new(set, sorted, None, runtime));
    }
    // All of it runs on the workers, because each change from this thread to them and back puts threads to sleep and
    // wakes them.
    let (sorted, record) = runtime.install(|| sort(&set, &clusters, runtime, &caches.sort_buffers, counters))?;
    let sorted = Arc::new(sorted);
    if let Some(key) = key {
        let bytes = sorted.memory_bytes();
        let sets = &caches.last_sets;
        sets.keep(key, &sorted, bytes, config.cluster_budget_bytes);
    }
    Ok(BinnedDraw::new(set, sorted, record, runtime))
}

/// The result of preprocessing a set.
struct Preprocessed {
    /// The groups that the device projected, then those of vertex programs.
    groups: Vec<ProjectedGroup>,
    /// The number of groups that the device projected.
    fixed: usize,
    /// The counts of the groups that the device projected. `by_programs` has those of vertex programs.
    by_device: Counters,
    by_programs: Counters,
}

/// Preprocesses, sorts and bins a set. If a recorder is present, it also returns a record of the work.
fn sort(
    set: &GaussianSet,
    clusters: &[Option<Arc<Clusters>>],
    runtime: &Runtime,
    buffers: &SortBuffers,
    counters: &mut Counters,
) -> Result<(SortedSet, Option<Arc<DrawRecord>>), SortError> {
    let started = Instant::now();
    let mut preprocessed = preprocess_set(set, clusters, runtime)?;
    let projected = Instant::now();
    let threads = runtime.threads();
    let pairs = depth_order::sorted(&preprocessed.groups, threads, buffers);
    let sorted = Instant::now();
    // A pair takes twelve bytes while lists are built: four times the budget of all lists of a pass.
    let most_pairs = runtime.config().bin_budget_bytes / 3;
    let groups = &mut preprocessed.groups;
    let tiles = TileLists::build(groups, pairs.pairs(), set.bounds, threads, most_pairs);
    pairs.give_back(buffers);
    let binned = Instant::now();
    let fixed = preprocessed.fixed;
    let (by_device, by_programs) = (preprocessed.by_device, preprocessed.by_programs);
    let mut sorted_set = SortedSet::new(set, preprocessed.groups, tiles);
    let record = runtime.recorder().map(|_| {
        let (of_device, of_programs) = sorted_set.splats.split_at(fixed);
        let of_device = recording::Projected { counters: &by_device, splats: of_device };
        let of_programs = recording::Projected { counters: &by_programs, splats: of_programs };
        let bytes = set.draws.iter().map(vertex_projection::vertex_bytes).sum();
        let (pairs, degree) = (sorted_set.tiles.pairs(), set.begin.state.sh_degree);
        DrawRecord::new(recording::gaussian_draw(&of_device, &of_programs, bytes, pairs, degree, set.bounds))
    });
    let work = &mut sorted_set.counters;
    work.add_all(&by_device);
    work.add_all(&by_programs);
    work.add(Counter::TilePairs, sorted_set.tiles.pairs());
    counters.add_all(work);
    let nanoseconds = |from: Instant, to: Instant| (to - from).as_nanos() as u64;
    counters.add(Counter::PreprocessTime, nanoseconds(started, projected));
    counters.add(Counter::SortTime, nanoseconds(projected, sorted));
    counters.add(Counter::BinningTime, nanoseconds(sorted, binned));
    Ok((sorted_set, record))
}

/// Preprocesses the Gaussians that have attributes, except those culled with their clusters, and those that vertex
/// programs project.
fn preprocess_set(
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
    let preprocessor = Preprocessor { runtime, constants: &constants, is_flat: set.is_flat() };
    let mut by_device = Counters::default();
    let map = occlusion::find(set, &preprocessor, clusters);
    let tasks = group_tasks::group_tasks(set, clusters, &constants, map.as_ref(), &mut by_device)?;
    if optimizations.has(Optimization::Harmonics) {
        let unread = by_device.get(Counter::OutsideByClusters) + by_device.get(Counter::HiddenByOthers);
        by_device.add(Counter::HarmonicsUnread, unread);
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
