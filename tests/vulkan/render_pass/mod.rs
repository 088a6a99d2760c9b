//! The chapter *Render Pass*.
//!
//! Unit tests: `driver/src/render_pass.rs`.

mod feedback_loop;
mod multiview;
pub mod pass_objects;
mod passes;
mod subpasses;
