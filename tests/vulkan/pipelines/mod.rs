//! The chapter *Pipelines*.
//!
//! Unit tests: `driver/src/pipeline`.

mod caches;
mod creation;
mod dynamic_states;
mod extended_dynamic_states;
mod libraries;
