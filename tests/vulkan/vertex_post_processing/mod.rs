//! The chapter *Fixed-Function Vertex Post-Processing*.

mod depth_clip;
mod transform_feedback;
