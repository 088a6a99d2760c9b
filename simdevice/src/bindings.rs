//! What a draw or dispatch binds its programs to.

use crate::isa::resources::{NoGlobalMemory, NoImages, Resources, words};
use crate::packet::BufferRange;
use devmem::Allocation;
use std::sync::Arc;
use std::sync::atomic::AtomicU32;

/// Buffers, images and push constants, by the bind points of a program.
#[derive(Clone, Debug, Default)]
pub struct Bindings {
    /// Buffers by bind point. `None`, or beyond the end, is a buffer of size zero. Offsets are multiples of 4.
    pub buffers: Vec<Option<BufferRange>>,
    /// Push constants; what lies beyond the end reads as zero.
    pub push_constants: Vec<u8>,
    /// The memory that the program may write to, so that what was derived from it is derived anew.
    pub written: Vec<Arc<Allocation>>,
}

impl Bindings {
    /// The push constants as a program reads them.
    pub(crate) fn push_constant_words(&self) -> Vec<AtomicU32> {
        words(&self.push_constants)
    }

    /// The bindings as a program reaches them.
    pub(crate) fn resources<'a>(&'a self, push_constants: &'a [AtomicU32]) -> Resources<'a> {
        Resources {
            buffers: &self.buffers,
            push_constants,
            images: &NoImages,
            global: &NoGlobalMemory,
        }
    }

    /// Marks what the program may have written to as changed.
    pub(crate) fn bump_generations(&self) {
        for memory in &self.written {
            memory.bump_generation();
        }
    }
}
