//! What a device keeps of Gaussians that may be drawn again.

use super::cluster_cache::ClusterCache;
use super::reuse::ReuseCache;

/// The caches of a device.
#[derive(Debug, Default)]
pub struct Caches {
    /// The clusters of Gaussians that were drawn more than once.
    pub(super) clusters: ClusterCache,
    /// What was last made of sets.
    pub(super) last_sets: ReuseCache,
}
