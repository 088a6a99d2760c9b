//! Work that any driver does, for tests and benchmarks: compute kernels, models from files, and scenes of triangles.
//!
//! The code is an ordinary Vulkan application; [`gaurast_testkit`] explains the safety of its `unsafe`.

pub mod kernels;
pub mod models;
pub mod triangles;
