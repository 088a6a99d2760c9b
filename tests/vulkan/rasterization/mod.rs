//! The chapter *Rasterization*.

mod coverage;
mod extremes;
mod interpolation;
pub mod models;
pub mod multisample;
pub mod polygons;
