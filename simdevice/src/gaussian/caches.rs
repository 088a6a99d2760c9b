//! The caches in which a device keeps data derived from Gaussians that may be drawn again, and memory that later draws
//! use again.

use super::read::cluster_cache::ClusterCache;
use super::reuse::ReuseCache;
use super::sort::radix::SortBuffers;

/// The caches of a device.
#[derive(Debug, Default)]
pub struct Caches {
    /// The clusters of Gaussians that were drawn more than once.
    pub(crate) clusters: ClusterCache,
    /// The sorted sets of recent draws.
    pub(crate) last_sets: ReuseCache,
    /// The memory of earlier depth sorts.
    pub(crate) sort_buffers: SortBuffers,
}
