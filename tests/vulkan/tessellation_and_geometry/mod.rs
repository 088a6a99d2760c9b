//! The chapters *Tessellation* and *Geometry Shading*.

pub mod geometry_scenes;
mod geometry_shaders;
mod primitive_stages;
pub mod tessellation_scenes;
mod tessellation_shaders;
