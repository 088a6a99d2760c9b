//! A program made ready to run.

use std::sync::Arc;

use super::engine::{Engine, engine};
use crate::compiler::{CompiledProgram, Options};
use crate::ir::validate::InvalidProgram;
use crate::ir::{Input, Output, Program};

/// A program made ready for batches of a fixed number of lanes. It can be shared between workers.
#[derive(Debug)]
pub struct Executable {
    pub(super) program: CompiledProgram,
    pub(super) engine: Arc<dyn Engine>,
}

impl Executable {
    /// Compiles a program, for kernels of the options' SIMD level.
    ///
    /// # Errors
    /// If the program isn't valid, needs too many registers, or the options are out of range.
    pub fn new(program: Program, options: &Options) -> Result<Self, InvalidProgram> {
        Ok(Self { program: CompiledProgram::new(program, options)?, engine: engine(options.level) })
    }

    /// Lanes of a batch.
    pub fn lanes(&self) -> usize {
        self.program.lanes
    }

    /// The inputs that the program reads; others need not be set.
    pub fn inputs(&self) -> &[Input] {
        &self.program.inputs
    }

    /// The outputs that the program has.
    pub fn outputs(&self) -> &[Output] {
        &self.program.outputs
    }
}
