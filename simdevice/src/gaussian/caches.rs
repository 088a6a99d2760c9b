//! The caches in which a device keeps data derived from Gaussians that may be drawn again, and memory that later draws
//! use again.

use super::cluster_cache::ClusterCache;
use super::reuse::ReuseCache;
use super::sort::SortBuffers;

/// The caches of a device.
#[derive(Debug, Default)]
pub struct Caches {
    /// The clusters of Gaussians that were drawn more than once.
    pub(super) clusters: ClusterCache,
    /// The sorted sets of recent draws.
    pub(super) last_sets: ReuseCache,
    /// The memory of earlier depth sorts.
    pub(super) sort_buffers: SortBuffers,
}
