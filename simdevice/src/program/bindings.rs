//! What a draw or dispatch binds its programs to.

use crate::packet::BufferRange;
use crate::texture::{ImageBinding, ImageTable, Sampler};
use devmem::Allocation;
use fearless_simd::Level;
use isa::resources::{NoGlobalMemory, Resources, words};
use std::sync::Arc;
use std::sync::atomic::AtomicU32;

/// Buffers, images, samplers and push constants, by the bind points of a program. What lies beyond the end of a list
/// is not bound.
#[derive(Clone, Debug, Default)]
pub struct Bindings {
    /// Buffers; `None` is a buffer of size zero. Offsets are multiples of 4.
    pub buffers: Vec<Option<BufferRange>>,
    /// Images and texel buffers.
    pub images: Vec<ImageBinding>,
    /// Samplers.
    pub samplers: Vec<Option<Sampler>>,
    /// Push constants; what lies beyond the end reads as zero.
    pub push_constants: Vec<u8>,
    /// The memory that the program may write to, so that what was derived from it is derived anew.
    pub written: Vec<Arc<Allocation>>,
}

/// Bindings as programs reach them, made once for a draw or dispatch.
pub(crate) struct BoundResources<'a> {
    bindings: &'a Bindings,
    images: ImageTable,
    push_constants: Vec<AtomicU32>,
}

impl Bindings {
    /// Makes them ready for programs that run at a SIMD level.
    pub(crate) fn bind(&self, level: Level) -> BoundResources<'_> {
        let (images, samplers) = (self.images.iter().cloned(), self.samplers.iter().copied());
        BoundResources {
            bindings: self,
            images: ImageTable::new(level, images, samplers),
            push_constants: words(&self.push_constants),
        }
    }

    /// Marks what the program may have written to as changed.
    pub(crate) fn bump_generations(&self) {
        for memory in &self.written {
            memory.bump_generation();
        }
    }
}

impl BoundResources<'_> {
    /// What a program reaches.
    pub(crate) fn resources(&self) -> Resources<'_> {
        Resources {
            buffers: &self.bindings.buffers,
            push_constants: &self.push_constants,
            images: &self.images,
            global: &NoGlobalMemory,
        }
    }
}
