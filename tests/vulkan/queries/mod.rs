//! The chapter *Queries*.
//!
//! Unit tests: `driver/src/query_pool.rs`.

mod pools;
