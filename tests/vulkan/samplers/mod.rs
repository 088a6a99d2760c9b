//! The chapter *Samplers*.

mod modes;
mod sampling;
mod ycbcr;
