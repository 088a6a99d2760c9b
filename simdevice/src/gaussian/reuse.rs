//! The reuse of sorted sets: if neither the attributes nor the view have changed since a set was last drawn, its
//! projection, sort and tile lists are used again.
//!
//! A set belongs to the memory of the positions that it was made from, like clusters, and is dropped when that is freed
//! or written. A buffer has at most one set for each view, that of its last picture. It is freed before another is
//! made, so that there are never two at once.

use super::read::clusters::Clusters;
use super::read::fingerprint::{SourceFingerprint, is_device_local};
use super::set::GaussianSet;
use super::sorted_set::SortedSet;
use crate::format::Format;
use crate::packet::{Activations, AttributeStream, GaussianAppend};
use crate::state::gaussian::{Camera, GaussianState};
use crate::state::{Rect, Viewport};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

/// Everything that a sorted set depends on.
#[derive(Debug)]
pub(crate) struct Key {
    /// The fingerprints of all attributes of all appends, beginning with the positions of the first.
    streams: Vec<SourceFingerprint>,
    /// First vertex, vertex count, first instance and instance count of each append.
    ranges: Vec<[u32; 4]>,
    /// The activations of each append's attributes.
    activations: Vec<Activations>,
    /// The clusters of each append, on which the counters depend.
    clusters: Vec<Weak<Clusters>>,
    state: Arc<GaussianState>,
    camera: Camera,
    viewport: Viewport,
    bounds: Rect,
    /// The view. Each has a set of its own.
    layer: u32,
    /// The depth attachment's format, if centres have depths.
    depth: Option<Format>,
    /// True if a fragment program computes colours. Then nothing is hidden by others.
    is_resolved: bool,
    /// True if it reads indices of Gaussians.
    is_tracked: bool,
}

#[derive(Debug)]
struct Entry {
    key: Key,
    set: Weak<SortedSet>,
    bytes: u64,
}

/// The last sets of a device's buffers, from the oldest to the newest.
#[derive(Debug, Default)]
pub(crate) struct ReuseCache(Mutex<Vec<Entry>>);

impl Key {
    /// The key of `set`; `None` if the driver does not see all writes to its inputs.
    pub(crate) fn new(set: &GaussianSet, clusters: &[Option<Arc<Clusters>>]) -> Option<Self> {
        let seen = |append: &GaussianAppend| append.indices.is_none() && attributes(append).all(is_device_local);
        if set.appends.is_empty() || !set.draws.is_empty() || !set.appends.iter().all(seen) {
            return None;
        }
        let ranges =
            set.appends.iter().map(|append| [append.first, append.count, append.first_instance, append.instance_count]);
        let begin = &set.begin;
        Some(Self {
            streams: set.appends.iter().flat_map(attributes).map(SourceFingerprint::new).collect(),
            ranges: ranges.collect(),
            activations: (set.appends.iter()).map(|append| append.attributes.activations).collect(),
            clusters: clusters.iter().map(|clusters| clusters.as_ref().map_or(Weak::new(), Arc::downgrade)).collect(),
            state: Arc::clone(&begin.state),
            camera: begin.camera,
            viewport: begin.viewport,
            bounds: set.bounds,
            layer: set.layer,
            depth: set.depth.as_ref().map(|_| set.depth_format),
            is_resolved: set.fragment_stage.is_some(),
            is_tracked: set.is_tracked(),
        })
    }

    fn is_same(&self, other: &Self) -> bool {
        let all = |a: &[SourceFingerprint], b: &[SourceFingerprint]| {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.is_same(b))
        };
        let view = |key: &Self| {
            let depths = (key.depth, key.is_resolved, key.is_tracked);
            let place = (key.bounds, key.layer);
            (key.camera, key.viewport, place, depths)
        };
        view(self) == view(other)
            && self.state == other.state
            && all(&self.streams, &other.streams)
            && self.has_same_appends(other)
    }

    /// True if both have the same appends with the same clusters.
    fn has_same_appends(&self, other: &Self) -> bool {
        let mut clusters = self.clusters.iter().zip(&other.clusters);
        let same = self.ranges == other.ranges && self.activations == other.activations;
        same && clusters.all(|(a, b)| a.ptr_eq(b))
    }

    /// True if the first appends of both read positions from the same buffer, for the same view.
    fn is_of_same_buffer(&self, other: &Self) -> bool {
        let mut first = self.streams.iter().zip(&other.streams).take(1);
        self.layer == other.layer && first.all(|(a, b)| a.is_same_buffer(b))
    }
}

impl Entry {
    fn is_current(&self) -> bool {
        self.set.strong_count() > 0 && self.key.streams.iter().all(SourceFingerprint::is_current)
    }

    /// Frees the set.
    fn release(self) {
        let positions = self.key.streams.first();
        let memory = positions.and_then(SourceFingerprint::memory);
        if let Some((memory, set)) = memory.zip(self.set.upgrade()) {
            memory.drop_derived(&(set as _));
        }
    }
}

impl ReuseCache {
    fn lock(&self) -> MutexGuard<'_, Vec<Entry>> {
        // A panic while the lock was held can only leave entries that are dropped too early.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The set with this key. If there is none, the last set of the same buffer is freed.
    pub(crate) fn find(&self, key: &Key) -> Option<Arc<SortedSet>> {
        let mut entries = self.lock();
        let is_old = |entry: &mut Entry| {
            let is_other = || entry.key.is_of_same_buffer(key) && !entry.key.is_same(key);
            !entry.is_current() || is_other()
        };
        for entry in entries.extract_if(.., is_old) {
            entry.release();
        }
        let found = entries.iter().find(|entry| entry.key.is_same(key));
        found.and_then(|found| found.set.upgrade())
    }

    /// Stores a set that takes `bytes`. The oldest sets are freed while all together would exceed `budget`.
    pub(crate) fn keep(&self, key: Key, set: &Arc<SortedSet>, bytes: u64, budget: u64) {
        if bytes > budget {
            return;
        }
        let Some(memory) = key.streams.first().and_then(SourceFingerprint::memory) else {
            return;
        };
        let mut entries = self.lock();
        let mut held: u64 = entries.iter().map(|entry| entry.bytes).sum();
        let goes = |entry: &mut Entry| {
            let goes = held.saturating_add(bytes) > budget;
            held -= if goes { entry.bytes } else { 0 };
            goes
        };
        for entry in entries.extract_if(.., goes) {
            entry.release();
        }
        memory.keep_derived(Arc::clone(set) as _);
        entries.push(Entry { key, set: Arc::downgrade(set), bytes });
    }
}

/// All attributes and tables that an append reads from memory, positions first.
fn attributes(append: &GaussianAppend) -> impl Iterator<Item = &AttributeStream> {
    let attributes = &append.attributes;
    let model = &attributes.model;
    let shapes = [&attributes.position, &attributes.scale, &attributes.rotation, &attributes.opacity];
    shapes
        .into_iter()
        .chain(&attributes.spherical_harmonics)
        .chain(model.matrix.iter().flat_map(|rows| rows.iter()))
        .chain(&model.opacity)
        .chain(attributes.tables.iter().flat_map(|tables| tables.iter()))
}
