//! The driver as the Vulkan loader and its layers find it; and the limits, features and extensions that strangers' programs ask
//! for, each held against what a program gets of it.

mod addresses;
mod conditional;
mod depth_clip;
mod descriptors;
mod dynamic;
mod limits;
mod loader_door;
mod multiview;
mod pipelines;
mod presentation;
mod queues;
mod robustness;
mod samplers;
mod storage;
mod window;
#[cfg(target_os = "linux")]
mod x11;
