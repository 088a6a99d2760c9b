//! Lowers Vulkan's state to the device's packets.

pub(crate) mod bindings;
pub(crate) mod camera;
pub(crate) mod compute;
pub(crate) mod draw;
pub(crate) mod gaussian;
pub(crate) mod polygon;
pub(crate) mod rendering;
pub(crate) mod transfer;
