//! Triangles, compared with lavapipe's and with exact values.

mod coverage;
pub mod devices;
mod extremes;
mod interpolation;
mod sweep;
