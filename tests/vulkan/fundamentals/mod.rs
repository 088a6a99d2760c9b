//! The chapter *Fundamentals*.
//!
//! Unit tests: `driver/src/abi`.

mod arithmetic;
mod library;
mod out_of_memory;
