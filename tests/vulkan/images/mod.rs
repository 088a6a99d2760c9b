//! Images compared with lavapipe: blits, samples and stores give the same results. The shaders' SPIR-V is checked in
//! next to their sources: `glslangValidator -V --target-env vulkan1.3`. Types that own Vulkan objects destroy them when
//! they are dropped.

mod blits;
mod lavapipe;
mod sampling;
mod storing;
mod texels;
