//! The chapter *Samplers*.

mod modes;
mod sampling;
pub mod textures;
