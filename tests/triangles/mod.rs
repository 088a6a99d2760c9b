//! Triangles, held against lavapipe's.

mod coverage;
pub mod devices;
mod extremes;
mod interpolation;
mod sweep;
