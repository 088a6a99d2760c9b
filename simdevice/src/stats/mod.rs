//! Statistics: counters, queries of counters, optimizations that can be switched off, and the recorder of work.

pub mod counters;
pub mod optimizations;
pub mod query;
pub mod recorder;
