//! A second implementation of `VK_GAURAST_gaussian_primitive_topology`, written from the extension's text alone.
//!
//! It shares no code with the device, the driver or the oracle, and its author had read none of them. If its pictures
//! equal theirs, the text is sufficient. It draws what every implementation must support: 3D Gaussians projected by the
//! Jacobian, through a pinhole, in the order of view depth, with one sample per pixel. It also supports three optional
//! features: opacity compensation, degree 4 and depth tests. All arithmetic is binary64, except for the roundings that
//! the text requires. Steps are numbered as under _What a Draw Computes_.

mod draw;
mod harmonics;
mod linear;
mod project;
mod viewport;

pub use draw::{Attachments, CompareOp, DepthFormat, DepthTest, draw};
pub use project::{Antialiasing, Camera, Gaussian, State};
pub use viewport::Viewport;
