//! The driver as the Vulkan loader and its layers find it.

mod loader_door;
