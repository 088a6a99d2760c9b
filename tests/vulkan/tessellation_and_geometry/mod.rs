//! The chapters *Tessellation* and *Geometry Shading*.

mod geometry_shaders;
mod primitive_stages;
mod tessellation_shaders;
