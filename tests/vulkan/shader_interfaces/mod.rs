//! The chapter *Shader Interfaces*.

mod wide_values;
