//! The chapter *Fundamentals*.
//!
//! Unit tests: `driver/src/abi`.

mod out_of_memory;
