//! The tile engine.

pub mod gaussian;
