//! The chapters *Fragment Operations* and *The Framebuffer*.

mod attachments;
mod sample_mask_in;
mod stencil_export;
mod three_components;
