//! The chapter *Samplers*.

mod blocks;
mod modes;
mod sampling;
mod ycbcr;
