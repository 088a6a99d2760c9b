//! Gaussians as blended quads, the peer that the Gaussian topology is measured against. The measurements themselves are the
//! program `gaurast-bench`.

pub mod quads;
