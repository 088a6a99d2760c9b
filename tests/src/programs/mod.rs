//! Programs made up for tests of the shader cores: one instruction each ([`Row`]), or control flow at random
//! ([`structured`]).

pub mod assembler;
pub mod inputs;
pub mod precision;
mod row;
pub mod structured;
pub mod types;

pub use row::{Body, Expect, Failure, LANES, Lane, Model, Row, WORKGROUP, check};
