//! The chapter *Samplers*.

mod modes;
mod sampling;
