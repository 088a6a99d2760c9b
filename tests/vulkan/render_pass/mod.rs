//! The chapter *Render Pass*.
//!
//! Unit tests: `driver/src/render_pass.rs`.

mod feedback_loop;
mod local_read;
mod multisampled_to_single;
mod multiview;
mod passes;
mod rasterization_order;
mod subpasses;
mod unused_attachments;
