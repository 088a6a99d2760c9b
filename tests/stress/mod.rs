//! Numerical stress: scenes made to break a renderer, each held against the binary64 oracle, and
//! properties that every picture has.

mod extremes;
mod known_failures;
mod properties;
mod recorded_work;
mod scenes;
mod verdicts;
