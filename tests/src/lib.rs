//! What the project's tests share beside their Vulkan application ([`gaurast_testkit`]): compute kernels, programs made
//! up at random, scenes of triangles, input for fuzzing.

pub mod fuzzing;
pub mod hybrid;
pub mod kernels;
pub mod long_run;
pub mod programs;
pub mod recorded;
pub mod triangles;
pub mod what_ifs;

pub use gaurast_oracle::{compare, oracle, scenes};
