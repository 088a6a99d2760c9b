//! Lowers Vulkan's state to the device's packets.

pub mod gaussian;
pub mod rendering;
pub mod transfer;
