//! The chapters *Fragment Operations* and *The Framebuffer*.

mod attachments;
