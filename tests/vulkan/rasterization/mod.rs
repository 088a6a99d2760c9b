//! The chapter *Rasterization*.

mod coverage;
mod extremes;
mod interpolation;
mod lines;
pub mod models;
