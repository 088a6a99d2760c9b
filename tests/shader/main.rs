//! Shader cores as a Vulkan application sees them.

mod kernels;
