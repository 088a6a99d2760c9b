//! Triangles, held against lavapipe's.

mod coverage;
mod devices;
mod doors;
mod extremes;
mod interpolation;
mod sweep;
