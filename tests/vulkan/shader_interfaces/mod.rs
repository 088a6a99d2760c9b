//! The chapter *Shader Interfaces*.

mod wide_attributes;
mod wide_values;
