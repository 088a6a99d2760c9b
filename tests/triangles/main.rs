//! Triangles, held against lavapipe's.

mod coverage;
mod devices;
mod doors;
mod interpolation;
mod sweep;
