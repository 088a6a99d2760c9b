//! Splats: projected Gaussians as the tile engine reads them, and the data that belong to them.

pub(crate) mod binary16;
pub(crate) mod ellipse;
pub(crate) mod footprint;
pub(crate) mod group;
pub(crate) mod identity;
pub(crate) mod ray_depth;
pub(crate) mod splat;
pub(crate) mod surfel;
