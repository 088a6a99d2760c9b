//! What the `gaurast` command and the samples share: scenes, cameras, images, and a renderer that
//! is an ordinary application of the Gaussian primitive topology.

pub mod camera;
pub mod file;
pub mod output;
pub mod renderer;
pub mod scene;
pub mod size;
pub mod usage;
