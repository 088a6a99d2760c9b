//! The programs that tests need.

/// The compiler of the shaders that are written in GLSL.
pub const GLSLANG: gaurast_runner::Need = gaurast_runner::Need::Program("glslangValidator");
