//! The loader's door: the three symbols that `libvulkan_gaurast.so` exports for the Vulkan loader.
