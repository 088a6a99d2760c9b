//! The projected Gaussians of a group.

use super::footprint::{TileFootprint, TileSpan};
use super::identity::Identity;
use super::ray_depth::RayDepth;
use super::splat::Splat;
use super::surfel::Surfel;
use crate::stats::counters::Counters;
use devmem::host;

/// The result of projecting a group.
#[derive(Debug, Default)]
pub(crate) struct ProjectedGroup {
    /// The splats, in the order of the draw.
    pub splats: Vec<Splat>,
    /// The depth key of each, and its number in the set, which orders equal keys.
    pub keys: Vec<[u32; 2]>,
    /// The coefficients of each one's depth along a ray, in the per-pixel order.
    pub ray_depths: Vec<RayDepth>,
    /// The disc of each, for 2D Gaussians.
    pub surfels: Vec<Surfel>,
    /// The identity of each splat, if a fragment program reads it.
    pub identities: Vec<Identity>,
    /// The tiles of each.
    pub reaches: Vec<TileFootprint>,
    /// The spans of footprints that do not store them inline.
    pub spans: Vec<TileSpan>,
    /// The counts of Gaussians that were skipped, by reason.
    pub counters: Counters,
    /// The copies a period to the right and to the left, by side.
    pub copies: Vec<ProjectedGroup>,
}

impl ProjectedGroup {
    pub(crate) fn reserve(&mut self, count: usize) {
        host::reserve(&mut self.splats, count);
        host::reserve(&mut self.keys, count);
        host::reserve(&mut self.reaches, count);
    }
}
