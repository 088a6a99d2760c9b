//! Vulkan's binary interface: errors, handles, pointers, and the guard around each command.

pub(crate) mod error;
pub(crate) mod guard;
pub(crate) mod handle;
pub(crate) mod sanitizer;
pub(crate) mod valid;
