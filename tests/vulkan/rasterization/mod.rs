//! The chapter *Rasterization*.

mod coverage;
mod depth_bias;
mod extremes;
mod interpolation;
mod lines;
pub mod models;
