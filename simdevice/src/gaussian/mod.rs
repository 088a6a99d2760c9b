//! Gaussian draws: from vertex attributes to a binned, depth-sorted set that the tile engine renders.
//!
//! [`sort_and_bin`] is the walk, a stage after the other, each in a module: [`reuse`] (a set that is still as it was),
//! [`cluster_cache`] and [`clusters`] (neighbours with bounds), [`occlusion`] (what others hide), [`group_tasks`] (what is
//! left to do), [`preprocess`] (3D to the rasterizer's nine numbers, tiles, colours and keys; [`vertex_projection`] where a
//! vertex program does it), [`depth_order`], [`tile_lists`], [`sorted_set`] (what is drawn).

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
use sorted_set::SortedSet;
use splat::ProjectedGroup;
use std::sync::Arc;
use std::time::Instant;
use tile_lists::TileLists;

/// The least groups that a worker takes where little is done for each.
const LEAST_GROUPS: usize = 64;

/// Preprocesses, sorts and bins a set, unless it is still there from when it was last drawn.
///
/// # Errors
/// [`SortError`] if the set exceeds what 32 bits can name, or a vertex program runs for too long.
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
    // All of it by workers: for each way from this thread to them and back, threads fall asleep and are woken.
    let (sorted, record) = runtime.install(|| sort(&set, &clusters, runtime, counters))?;
    let sorted = Arc::new(sorted);
    if let Some(key) = key {
        let bytes = sorted.memory_bytes();
        let sets = &caches.last_sets;
        sets.keep(key, &sorted, bytes, config.cluster_budget_bytes);
    }
    Ok(BinnedDraw::new(set, sorted, record, runtime))
}

/// What preprocessing makes of a set.
struct Preprocessed {
    /// Those that the device projected, then those of vertex programs.
    groups: Vec<ProjectedGroup>,
    /// How many of them the device projected.
    fixed: usize,
    /// What became of the Gaussians that the device projected, and of those of vertex programs.
    by_device: Counters,
    by_programs: Counters,
}

/// Preprocesses, sorts and bins; and begins an account of it, if anybody wants to
/// know.
fn sort(
    set: &GaussianSet,
    clusters: &[Option<Arc<Clusters>>],
    runtime: &Runtime,
    counters: &mut Counters,
) -> Result<(SortedSet, Option<Arc<DrawRecord>>), SortError> {
    let started = Instant::now();
    let mut preprocessed = preprocess_set(set, clusters, runtime)?;
    let projected = Instant::now();
    let threads = runtime.threads();
    let pairs = depth_order::sorted(&preprocessed.groups, threads);
    let sorted = Instant::now();
    // Twelve bytes a pair while lists are made: four times the budget of all lists of a pass.
    let most_pairs = runtime.config().bin_budget_bytes / 3;
    let groups = &mut preprocessed.groups;
    let tiles = TileLists::build(groups, &pairs, set.bounds, threads, most_pairs);
    let binned = Instant::now();
    let fixed = preprocessed.fixed;
    let (by_device, by_programs) = (preprocessed.by_device, preprocessed.by_programs);
    let mut sorted_set = SortedSet::new(set, preprocessed.groups, tiles);
    let record = runtime.recorder().map(|_| {
        let (of_device, of_programs) = sorted_set.splats.split_at(fixed);
        let of_device = recording::Projected {
            counters: &by_device,
            splats: of_device,
        };
        let of_programs = recording::Projected {
            counters: &by_programs,
            splats: of_programs,
        };
        let bytes = set.draws.iter().map(vertex_projection::vertex_bytes).sum();
        let (pairs, degree) = (sorted_set.tiles.pairs(), set.begin.state.sh_degree);
        DrawRecord::new(recording::gaussian_draw(
            &of_device,
            &of_programs,
            bytes,
            pairs,
            degree,
            set.bounds,
        ))
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

/// Preprocesses what has attributes, but for what is left out with its cluster, and what vertex programs project.
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
    let preprocessor = Preprocessor {
        runtime,
        constants: &constants,
        is_flat: set.is_flat(),
    };
    let mut by_device = Counters::default();
    let map = occlusion::find(set, &preprocessor, clusters);
    let tasks = group_tasks::group_tasks(set, clusters, &constants, map.as_ref(), &mut by_device)?;
    if optimizations.has(Optimization::Harmonics) {
        let unread =
            by_device.get(Counter::OutsideByClusters) + by_device.get(Counter::HiddenByOthers);
        by_device.add(Counter::HarmonicsUnread, unread);
    }
    let mut groups = preprocessor.run(&tasks);
    panorama::append_copies(&mut groups);
    let fixed = groups.len();
    let shaded = vertex_projection::project_all(set, runtime)?;
    host::reserve(&mut groups, shaded.len());
    groups.extend(shaded);
    by_device.add_all(&counted(&groups[..fixed]));
    Ok(Preprocessed {
        by_programs: counted(&groups[fixed..]),
        groups,
        fixed,
        by_device,
    })
}

/// What all groups counted.
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
