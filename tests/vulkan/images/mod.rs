//! Images side by side with lavapipe: what blits, samples and stores give there, they give here. The shaders' SPIR-V is
//! checked in beside them: `glslangValidator -V --target-env vulkan1.3`. Objects that a device outlives are its drop's.

mod blits;
mod lavapipe;
mod sampling;
mod storing;
mod texels;
