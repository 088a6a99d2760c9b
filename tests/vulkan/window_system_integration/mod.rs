//! The chapter *Window System Integration*.
//!
//! Unit tests: `driver/src/swapchain.rs`.

mod headless;
mod x11;
