//! Numerical stress tests: scenes that are difficult for renderers, each compared with the binary64 oracle, and
//! properties of every picture.

mod accuracy;
mod extremes;
mod known_failures;
mod properties;
mod recorded_work;
mod scenes;
