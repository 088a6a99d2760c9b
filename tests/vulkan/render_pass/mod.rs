//! The chapter *Render Pass*.
//!
//! Unit tests: `driver/src/render_pass.rs`.

mod feedback_loop;
mod local_read;
mod multiview;
mod passes;
mod subpasses;
mod unused_attachments;
