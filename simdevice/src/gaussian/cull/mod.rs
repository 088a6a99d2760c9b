//! Culling: the clusters, groups and lanes of which nothing is in the picture, or that others hide.

pub(crate) mod frustum;
pub(crate) mod group;
pub(crate) mod occluders;
pub(crate) mod occlusion;
mod sides;
pub(crate) mod tasks;
