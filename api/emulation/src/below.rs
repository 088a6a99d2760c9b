//! The entry over which the extension is put within the process.

use std::sync::OnceLock;

/// The entry of the Vulkan loader, once there is one.
pub(crate) static BELOW: OnceLock<ash::Entry> = OnceLock::new();
