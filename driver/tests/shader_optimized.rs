//! What other tests run, after spirv-opt rewrote it: phis in place of variables, merged and unrolled blocks.

#[path = "shader_execution.rs"]
mod execution;
