//! Shader cores as a Vulkan application sees them.

mod instructions;
mod kernels;
mod structured;
