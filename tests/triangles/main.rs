//! Triangles, held against lavapipe's.

mod coverage;
mod devices;
mod sweep;
