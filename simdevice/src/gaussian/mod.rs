//! Gaussian draws: from vertex attributes to a binned, depth-sorted set that the tile engine renders.
//!
//! [`sort_and_bin`] runs the stages in turn, each a folder:
//!
//! | stage | task |
//! |---|---|
//! | [`read`] | reads attributes from memory, and keeps clusters of neighbours of what is drawn again |
//! | [`cull`] | leaves out the clusters and lanes that are not in the picture, or that others hide |
//! | [`project`] | projects groups to splats: the rasterizer's nine numbers, with tiles, colours and keys |
//! | [`sort`] | sorts the splats by depth |
//! | [`bin`] | lists the splats of each tile, in that order |
//!
//! [`preprocess`] runs the first three, group by group. All stages share the constants of the view ([`view`]), and hand on splats
//! ([`splats`]). The result is a [`sorted_set`]; [`reuse`] keeps it while nothing changes.

pub(crate) mod bin;
pub mod caches;
mod cull;
mod lanes;
mod linear_algebra;
mod preprocess;
mod project;
mod read;
mod recording;
mod reuse;
mod set;
#[doc(hidden)] // For the benchmarks.
pub mod sort;
mod sorted_set;
pub mod spherical_harmonics;
pub(crate) mod splats;
pub(crate) mod view;

pub use set::{GaussianSet, SortError};
pub use sorted_set::BinnedDraw;

use crate::runtime::Runtime;
use crate::stats::counters::{Counter, Counters};
use crate::stats::optimizations::Optimization;
use crate::stats::recorder::DrawRecord;
use bin::tile_lists::TileLists;
use caches::Caches;
use preprocess::preprocess;
use project::vertex_projection;
use read::cluster_cache;
use read::clusters::Clusters;
use reuse::Key;
use sort::depth_order;
use sort::radix::SortBuffers;
use sorted_set::SortedSet;
use std::sync::Arc;
use std::time::Instant;

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

/// Preprocesses, sorts and bins a set. If a recorder is present, it also returns a record of the work.
fn sort(
    set: &GaussianSet,
    clusters: &[Option<Arc<Clusters>>],
    runtime: &Runtime,
    buffers: &SortBuffers,
    counters: &mut Counters,
) -> Result<(SortedSet, Option<Arc<DrawRecord>>), SortError> {
    let started = Instant::now();
    let mut preprocessed = preprocess(set, clusters, runtime)?;
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
