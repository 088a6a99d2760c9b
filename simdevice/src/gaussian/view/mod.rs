//! The view of a set: the camera, and the constants that all its Gaussians share.

pub(crate) mod camera;
pub(crate) mod center_depth;
pub(crate) mod constants;
pub(crate) mod cut_off;
pub(crate) mod distortion;
pub(crate) mod sigma_points;
pub(crate) mod visible;
