//! Which draws have clusters. Those of a draw are made when it is drawn for the second time, since a picture that is drawn
//! once is drawn faster without them; those of a large one from then on, a piece each time, and it has none before all are
//! there. They live in the memory that they are derived from: when that is freed or written,
//! they are gone.

use super::attributes::{SourceFingerprint, is_device_local};
use super::clusters;
use super::clusters::{ClusterBuilder, ClusterSource, Clusters};
use super::set::GaussianSet;
use crate::packet::{Activations, AttributeStream, GaussianAppend};
use crate::runtime::Runtime;
use crate::stats::counters::{Counter, Counters};
use crate::stats::optimizations::Optimization;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Instant;

/// Draws of fewer Gaussians have no clusters.
const LEAST_COUNT: u32 = 512;

/// Draws that are remembered.
const MAX_ENTRIES: usize = 256;

/// A draw that was seen.
#[derive(Debug)]
struct Entry {
    /// Those of positions, scales, rotations, opacities and, if they are in the clusters, spherical harmonics.
    streams: Vec<SourceFingerprint>,
    /// What is applied to them.
    activations: Activations,
    first: u32,
    count: u32,
    /// Whether they are 2D Gaussians, whose third scale means nothing.
    is_flat: bool,
    /// When it was last drawn.
    used: u64,
    /// Its clusters, if they were made; they belong to the memory of its positions.
    clusters: Weak<Clusters>,
    /// Those that are being made; they belong there, too.
    building: Weak<Mutex<ClusterBuilder>>,
    /// Bytes that they take.
    bytes: u64,
}

#[derive(Debug, Default)]
struct Entries {
    entries: Vec<Entry>,
    /// Counts the draws.
    now: u64,
}

/// The draws of a device that were seen, and their clusters.
#[derive(Debug, Default)]
pub(crate) struct ClusterCache(Mutex<Entries>);

impl Entry {
    fn new(append: &GaussianAppend, is_flat: bool, with_harmonics: bool) -> Self {
        let attributes = &append.attributes;
        let harmonics = attributes.spherical_harmonics.iter();
        let shapes = shapes(append).into_iter();
        let streams = shapes.chain(harmonics.filter(|_| with_harmonics));
        Self {
            streams: streams.map(SourceFingerprint::new).collect(),
            activations: attributes.activations,
            first: append.first,
            count: append.count,
            is_flat,
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
            let how = (entry.is_flat, entry.activations);
            (first, count, how, entry.streams.len())
        };
        what(self) == what(other) && streams.all(|(a, b)| a.is_same(b))
    }

    /// Whether its clusters hold all that those of `other` would: the same Gaussians, and at least the same of their spherical
    /// harmonics.
    fn covers(&self, other: &Self) -> bool {
        let mut streams = self.streams.iter().zip(&other.streams);
        let what = |entry: &Self| {
            let how = (entry.is_flat, entry.activations);
            (entry.first, entry.count, how)
        };
        what(self) == what(other)
            && self.streams.len() >= other.streams.len()
            && streams.all(|(a, b)| a.is_same(b))
    }

    /// Bytes that its clusters take.
    fn memory_bytes(&self) -> u64 {
        match self.clusters.strong_count() + self.building.strong_count() {
            0 => 0,
            _ => self.bytes,
        }
    }

    /// Frees its clusters.
    fn release(&self) {
        let memory = self
            .streams
            .first()
            .and_then(|positions| positions.memory());
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
    /// Makes room for `bytes` more by freeing the clusters that were not used for longest, and those whose memory has
    /// changed.
    fn make_room(&mut self, bytes: u64, budget: u64) {
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
        // What a panic left behind is only forgotten sooner.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The clusters of what `append` draws, as 2D Gaussians if `is_flat`, if it has any; `advance` makes a piece of them. Draws
    /// of the same Gaussians by lower degrees share them. All clusters together take at most `budget` bytes.
    pub(super) fn get(
        &self,
        append: &GaussianAppend,
        is_flat: bool,
        budget: u64,
        advance: impl FnOnce(&mut ClusterBuilder, ClusterSource<'_>) -> Option<Clusters>,
    ) -> Option<Arc<Clusters>> {
        if !is_eligible(append) || clusters::memory_bytes(append, false) > budget {
            return None;
        }
        let with_harmonics = append.attributes.spherical_harmonics.iter().all(is_fixed)
            && clusters::memory_bytes(append, true) <= budget;
        // Generations are read before the memory, so that what is written meanwhile makes them old.
        let mut drawn = Entry::new(append, is_flat, with_harmonics);
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
                entries.make_room(0, budget);
                return None;
            };
            let building = entry.building.upgrade().unwrap_or_else(|| {
                let building = Arc::<Mutex<ClusterBuilder>>::default();
                memory.keep_derived(Arc::clone(&building) as _);
                building
            });
            drawn.building = Arc::downgrade(&building);
            // What is made now is for the draws of those, too.
            entries.entries.retain(|entry| {
                let is_covered = drawn.covers(entry);
                if is_covered && !entry.building.ptr_eq(&drawn.building) {
                    entry.release();
                }
                !is_covered
            });
            entries.make_room(drawn.bytes, budget);
            entries.entries.push(drawn);
            building
        };
        let source = ClusterSource {
            append,
            is_flat,
            with_harmonics,
        };
        let clusters = {
            let mut builder = building.lock().unwrap_or_else(PoisonError::into_inner);
            Arc::new(advance(&mut builder, source)?)
        };
        let mut entries = self.lock();
        let made_by = Arc::downgrade(&building);
        let mut entries = entries.entries.iter_mut();
        // If there was no room for them meanwhile, this is the only draw that they serve.
        if let Some(entry) = entries.find(|entry| entry.building.ptr_eq(&made_by)) {
            entry.clusters = Arc::downgrade(&clusters);
            entry.building = Weak::new();
            memory.keep_derived(Arc::clone(&clusters) as _);
        }
        memory.drop_derived(&(building as _));
        Some(clusters)
    }
}

/// The clusters of each append that has some.
pub(super) fn find(
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
    let is_flat = set.is_flat();
    for (append, found) in set.appends.iter().zip(&mut found) {
        let advance = |builder: &mut ClusterBuilder, source: ClusterSource<'_>| {
            let started = Instant::now();
            let (made, clusters) =
                runtime.install(|| (builder.advance(source), builder.finish(source)));
            counters.add(Counter::ClustersBuilt, made as u64);
            counters.add(Counter::ClusterTime, started.elapsed().as_nanos() as u64);
            clusters
        };
        *found = cache.get(append, is_flat, config.cluster_budget_bytes, advance);
    }
    found
}

/// The attributes that every cluster holds.
fn shapes(append: &GaussianAppend) -> [&AttributeStream; 4] {
    let attributes = &append.attributes;
    [
        &attributes.position,
        &attributes.scale,
        &attributes.rotation,
        &attributes.opacity,
    ]
}

/// Whether it is, and read by vertex.
fn is_fixed(stream: &AttributeStream) -> bool {
    is_device_local(stream) && stream.instance_divisor.is_none()
}

/// Whether what is drawn can have clusters.
fn is_eligible(append: &GaussianAppend) -> bool {
    let fixed = shapes(append).into_iter().all(is_fixed);
    let model = &append.attributes.model;
    // What differs from vertex to vertex would have to be in the clusters.
    let mut of_model = model.matrix.iter().flat_map(|rows| rows.iter());
    let by_instance = of_model.all(is_by_instance) && model.opacity.iter().all(is_by_instance);
    append.indices.is_none() && append.count >= LEAST_COUNT && fixed && by_instance
}

fn is_by_instance(stream: &AttributeStream) -> bool {
    stream.instance_divisor.is_some()
}
