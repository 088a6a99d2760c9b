//! Triangles, held against lavapipe's.

mod devices;
mod sweep;
