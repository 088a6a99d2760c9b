//! Code that several test programs share, in addition to the Vulkan application [`gaurast_testkit`]: random programs, scenes of triangles, and input for fuzzing.

pub mod fuzzing;
pub mod hybrid;
pub mod long_run;
pub mod many_gaussians;
pub mod programs;
pub mod recorded;
pub mod triangles;
pub mod what_ifs;

pub use gaurast_oracle::{compare, oracle, scenes};
