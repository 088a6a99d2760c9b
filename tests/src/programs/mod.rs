//! Generated programs for tests of the shader cores: single instructions ([`Row`]), and random control flow
//! ([`structured`]).

pub mod assembler;
pub mod inputs;
pub mod precision;
mod row;
pub mod structured;
pub mod types;

pub use row::{Body, Expect, Failure, LANES, Lane, Model, Row, WORKGROUP, check};
