//! Holding an image against a reference ([`gaurast_oracle::compare`]), or against another device's: triangles have no
//! oracle, so that [`differences`] holds what two devices drew against each other.

mod devices;

pub use devices::{Difference, difference, differences, for_people, write_differences};
pub use gaurast_oracle::compare::*;
