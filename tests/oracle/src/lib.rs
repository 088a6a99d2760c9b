//! What tests and benchmarks hold pictures of Gaussians against: the reference renderer in binary64, how different two
//! pictures are, and generated scenes.

pub mod compare;
mod convert;
pub mod oracle;
pub mod scenes;
