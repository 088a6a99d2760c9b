//! The cache of clusters. A draw's clusters are built when it is drawn for the second time, because a picture that is
//! drawn only once is faster without them. Those of a large draw are built over several draws, a piece each time, and
//! are used once all pieces exist. They belong to the memory that they are derived from, and are dropped when it is
//! freed or written.

use super::clusters;
use super::clusters::{ClusterBuilder, ClusterSource, Clusters};
use super::fingerprint::{SourceFingerprint, is_device_local};
use crate::gaussian::set::GaussianSet;
use crate::packet::{Activations, AttributeStream, GaussianAppend};
use crate::runtime::Runtime;
use crate::stats::counters::{Counter, Counters};
use crate::stats::optimizations::Optimization;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Instant;

/// The least number of Gaussians in a draw with clusters.
const LEAST_COUNT: u32 = 512;

/// The most draws that are remembered.
const MAX_ENTRIES: usize = 256;

/// A draw that was recorded, and its clusters.
#[derive(Debug)]
struct Entry {
    /// The fingerprints of positions, scales, rotations, opacities, tables and, if the clusters hold them, spherical
    /// harmonics.
    streams: Vec<SourceFingerprint>,
    /// The activations that are applied to the attributes.
    activations: Activations,
    first: u32,
    count: u32,
    /// True for 2D Gaussians, whose third scale is ignored.
    is_surfel: bool,
    /// The value of [`Entries::now`] when it was last drawn.
    used: u64,
    /// The clusters of the draw, if they were built. The memory of the positions owns them.
    clusters: Weak<Clusters>,
    /// The unfinished clusters, if some pieces are built. The same memory owns them.
    building: Weak<Mutex<ClusterBuilder>>,
    /// The bytes that its clusters take when they are finished.
    bytes: u64,
}

#[derive(Debug, Default)]
struct Entries {
    entries: Vec<Entry>,
    /// The number of draws so far.
    now: u64,
}

/// The recent draws of a device, and their clusters.
#[derive(Debug, Default)]
pub(crate) struct ClusterCache(Mutex<Entries>);

impl Entry {
    fn new(append: &GaussianAppend, is_surfel: bool, with_harmonics: bool) -> Self {
        let attributes = &append.attributes;
        let harmonics = attributes.spherical_harmonics.iter();
        let streams = shapes(append).chain(harmonics.filter(|_| with_harmonics));
        Self {
            streams: streams.map(SourceFingerprint::new).collect(),
            activations: attributes.activations,
            first: append.first,
            count: append.count,
            is_surfel,
            used: 0,
            clusters: Weak::new(),
            building: Weak::new(),
            bytes: clusters::memory_bytes(append, with_harmonics),
        }
    }

    fn is_same(&self, other: &Self) -> bool {
        let mut streams = self.streams.iter().zip(&other.streams);
        let what = |entry: &Self| {
            let Self { first, count, .. } = *entry;
            let how = (entry.is_surfel, entry.activations);
            (first, count, how, entry.streams.len())
        };
        what(self) == what(other) && streams.all(|(a, b)| a.is_same(b))
    }

    /// True if its clusters hold all that those of `other` would: the same Gaussians, and at least the same spherical
    /// harmonics.
    fn covers(&self, other: &Self) -> bool {
        let mut streams = self.streams.iter().zip(&other.streams);
        let what = |entry: &Self| {
            let how = (entry.is_surfel, entry.activations);
            (entry.first, entry.count, how)
        };
        what(self) == what(other) && self.streams.len() >= other.streams.len() && streams.all(|(a, b)| a.is_same(b))
    }

    /// The bytes that its clusters take: zero if none were begun.
    fn memory_bytes(&self) -> u64 {
        match self.clusters.strong_count() + self.building.strong_count() {
            0 => 0,
            _ => self.bytes,
        }
    }

    /// Frees its clusters.
    fn release(&self) {
        let memory = self.streams.first().and_then(|positions| positions.memory());
        let Some(memory) = memory else {
            return;
        };
        if let Some(clusters) = self.clusters.upgrade() {
            memory.drop_derived(&(clusters as _));
        }
        if let Some(building) = self.building.upgrade() {
            memory.drop_derived(&(building as _));
        }
    }
}

impl Entries {
    /// Frees the least recently used clusters until `bytes` more fit into the budget and at most [`MAX_ENTRIES`] draws
    /// are remembered.
    fn evict(&mut self, bytes: u64, budget: u64) {
        self.entries.sort_by_key(|entry| entry.used);
        let held: u64 = self.entries.iter().map(Entry::memory_bytes).sum();
        let mut excess = held.saturating_add(bytes).saturating_sub(budget);
        let mut entries = self.entries.len();
        self.entries.retain(|entry| {
            let keep = excess == 0 && entries <= MAX_ENTRIES;
            if !keep {
                excess = excess.saturating_sub(entry.memory_bytes());
                entries -= 1;
                entry.release();
            }
            keep
        });
    }
}

impl ClusterCache {
    fn lock(&self) -> MutexGuard<'_, Entries> {
        // A panic while the lock was held can only leave entries that are dropped too early.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The clusters of `append`'s Gaussians, as 2D Gaussians if `is_surfel`, or `None` if they have none or these are
    /// unfinished; `advance` builds the next piece of them. Draws of the same Gaussians with a lower degree of
    /// spherical harmonics share them. All clusters together take at most `budget` bytes.
    pub(crate) fn get(
        &self,
        append: &GaussianAppend,
        is_surfel: bool,
        budget: u64,
        advance: impl FnOnce(&mut ClusterBuilder, ClusterSource<'_>) -> Option<Clusters>,
    ) -> Option<Arc<Clusters>> {
        if !is_eligible(append) || clusters::memory_bytes(append, false) > budget {
            return None;
        }
        let with_harmonics = append.attributes.spherical_harmonics.iter().all(is_fixed)
            && clusters::memory_bytes(append, true) <= budget;
        // Generations are read before the memory, so that a write in the meantime makes the clusters out of date.
        let mut drawn = Entry::new(append, is_surfel, with_harmonics);
        let memory = &append.attributes.position.buffer.memory;
        let building = {
            let mut entries = self.lock();
            entries.now += 1;
            drawn.used = entries.now;
            entries.entries.retain(|entry| {
                let current = entry.streams.iter().all(SourceFingerprint::is_current);
                if !current {
                    entry.release();
                }
                current
            });
            for entry in entries.entries.iter_mut() {
                if entry.covers(&drawn)
                    && let Some(clusters) = entry.clusters.upgrade()
                {
                    entry.used = drawn.used;
                    return Some(clusters);
                }
            }
            let Some(entry) = entries.entries.iter().find(|entry| entry.is_same(&drawn)) else {
                entries.entries.push(drawn);
                entries.evict(0, budget);
                return None;
            };
            let building = entry.building.upgrade().unwrap_or_else(|| {
                let building = Arc::<Mutex<ClusterBuilder>>::default();
                memory.keep_derived(Arc::clone(&building) as _);
                building
            });
            drawn.building = Arc::downgrade(&building);
            // The new clusters also serve the draws that they cover.
            entries.entries.retain(|entry| {
                let is_covered = drawn.covers(entry);
                if is_covered && !entry.building.ptr_eq(&drawn.building) {
                    entry.release();
                }
                !is_covered
            });
            entries.evict(drawn.bytes, budget);
            entries.entries.push(drawn);
            building
        };
        let source = ClusterSource { append, is_surfel, with_harmonics };
        let clusters = {
            let mut builder = building.lock().unwrap_or_else(PoisonError::into_inner);
            Arc::new(advance(&mut builder, source)?)
        };
        let mut entries = self.lock();
        let made_by = Arc::downgrade(&building);
        let mut entries = entries.entries.iter_mut();
        // If the entry was dropped in the meantime to free memory, the clusters serve this draw only.
        if let Some(entry) = entries.find(|entry| entry.building.ptr_eq(&made_by)) {
            entry.clusters = Arc::downgrade(&clusters);
            entry.building = Weak::new();
            memory.keep_derived(Arc::clone(&clusters) as _);
        }
        memory.drop_derived(&(building as _));
        Some(clusters)
    }
}

/// The clusters of each append, where it has some.
pub(crate) fn find(
    set: &GaussianSet,
    cache: &ClusterCache,
    runtime: &Runtime,
    counters: &mut Counters,
) -> Vec<Option<Arc<Clusters>>> {
    let config = runtime.config();
    let mut found = vec![None; set.appends.len()];
    if !config.optimizations.has(Optimization::ClusterCulling) {
        return found;
    }
    let is_surfel = set.has_surfels();
    for (append, found) in set.appends.iter().zip(&mut found) {
        let advance = |builder: &mut ClusterBuilder, source: ClusterSource<'_>| {
            let started = Instant::now();
            let (made, clusters) = runtime.install(|| (builder.advance(source), builder.finish(source)));
            counters.add(Counter::ClustersBuilt, made as u64);
            counters.add(Counter::ClusterTime, started.elapsed().as_nanos() as u64);
            clusters
        };
        *found = cache.get(append, is_surfel, config.cluster_budget_bytes, advance);
    }
    found
}

/// The memory that is read for every cluster: the attributes that it holds, and the tables.
fn shapes(append: &GaussianAppend) -> impl Iterator<Item = &AttributeStream> {
    let attributes = &append.attributes;
    let shapes = [&attributes.position, &attributes.scale, &attributes.rotation, &attributes.opacity];
    shapes.into_iter().chain(attributes.tables.iter().flat_map(|tables| tables.iter()))
}

/// True if a stream lies in memory that only the device writes and is read per vertex.
fn is_fixed(stream: &AttributeStream) -> bool {
    is_device_local(stream) && stream.instance_divisor.is_none()
}

/// True if an append's Gaussians can have clusters.
fn is_eligible(append: &GaussianAppend) -> bool {
    let fixed = shapes(append).all(is_fixed);
    let model = &append.attributes.model;
    // Model attributes per vertex would have to be in the clusters.
    let mut of_model = model.matrix.iter().flat_map(|rows| rows.iter());
    let by_instance = of_model.all(is_by_instance) && model.opacity.iter().all(is_by_instance);
    append.indices.is_none() && append.count >= LEAST_COUNT && fixed && by_instance
}

fn is_by_instance(stream: &AttributeStream) -> bool {
    stream.instance_divisor.is_some()
}
