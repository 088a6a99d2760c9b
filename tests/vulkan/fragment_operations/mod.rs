//! The chapters *Fragment Operations* and *The Framebuffer*.

mod attachments;
pub mod blending;
pub mod depth_stencil;
