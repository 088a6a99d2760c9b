//! Modules of any words whatever, taken through a pipeline's creation and a dispatch: for the fuzz target and for the
//! deterministic test.

mod harness;
mod mutate;

pub use harness::{Harness, Layout, Outcome};
pub use mutate::mutate;
