//! A second implementation of `VK_GAURAST_gaussian_primitive_topology`, written from the extension's text alone.
//!
//! It shares no code with the device, the driver or the oracle, and its author had read none of them: where its pictures
//! are theirs, the text says enough. It draws what every implementation must: 3D Gaussians by the Jacobian, through a pinhole, in the
//! order of view depth, with one sample for each pixel; and opacity compensation, degree 4 and depth tests, which are
//! optional. All arithmetic is binary64, but for the roundings that the text names. Steps are numbered as under _What a Draw
//! Computes_.

mod draw;
mod harmonics;
mod linear;
mod project;
mod viewport;

pub use draw::{Attachments, CompareOp, DepthFormat, DepthTest, draw};
pub use project::{Antialiasing, Camera, Gaussian, State};
pub use viewport::Viewport;
