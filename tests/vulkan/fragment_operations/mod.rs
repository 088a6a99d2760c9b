//! The chapters *Fragment Operations* and *The Framebuffer*.

mod attachments;
mod stencil_export;
mod three_components;
