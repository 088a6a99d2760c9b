//! Projection: from the attributes of a group, or the outputs of a vertex program, to splats.

mod color;
mod covariance;
pub(crate) mod group;
mod keys;
pub(crate) mod panorama;
pub(crate) mod scratch;
mod screen;
mod surfel;
mod tile_cut_off;
mod tiles;
mod unscented;
pub(crate) mod vertex_projection;
