//! What the project's tests share: the reference renderer, generated scenes, image comparison,
//! devices to draw on, compute kernels, programs made up at random, and scenes of triangles.

pub mod compare;
pub mod contexts;
pub mod for_levels;
pub mod fuzzing;
pub mod hybrid;
pub mod kernels;
pub mod long_run;
pub mod programs;
pub mod recorded;
pub mod triangles;
pub mod what_ifs;

pub use gaurast_oracle::{oracle, scenes};
