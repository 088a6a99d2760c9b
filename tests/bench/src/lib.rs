//! Gaussians as blended quads, with which the Gaussian topology is compared. The program `gaurast-bench` does the
//! measurements.

pub mod quads;
