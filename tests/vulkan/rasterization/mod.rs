//! The chapter *Rasterization*.

mod coverage;
mod extremes;
mod interpolation;
pub mod models;
