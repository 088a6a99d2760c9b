//! What a device keeps of Gaussians that may be drawn again.

use super::cache::ChunkCache;
use super::unchanged::LastSets;

/// The caches of a device.
#[derive(Debug, Default)]
pub struct Caches {
    /// The chunks of Gaussians that were drawn more than once.
    pub(super) chunks: ChunkCache,
    /// What was last made of sets.
    pub(super) last_sets: LastSets,
}
