//! What a draw or dispatch binds its programs to.

use crate::packet::BufferRange;
use crate::texture::{ImageBinding, ImageTable, Sampler};
use devmem::Allocation;
use fearless_simd::Level;
use isa::resources::{GlobalMemory, NoGlobalMemory, Resources, words};
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
    /// The buffers that the program reaches by address.
    pub addresses: Option<Arc<AddressTable>>,
    /// The memory that the program may write to, so that what was derived from it is derived anew.
    pub written: Vec<Arc<Allocation>>,
}

/// The buffers that have device addresses.
#[derive(Debug, Default)]
pub struct AddressTable(Vec<(u64, BufferRange)>);

impl AddressTable {
    /// A table of buffers with the address of each one's first byte, in order of addresses, none within another.
    pub fn new(buffers: Vec<(u64, BufferRange)>) -> Self {
        Self(buffers)
    }

    /// The buffers.
    pub fn buffers(&self) -> impl Iterator<Item = &BufferRange> {
        self.0.iter().map(|(_, range)| range)
    }

    /// The buffer that an address lies in, and the address of the buffer's first byte.
    pub fn find(&self, address: u64) -> Option<(&BufferRange, u64)> {
        let after = self.0.partition_point(|(start, _)| *start <= address);
        let (start, range) = self.0.get(after.checked_sub(1)?)?;
        (address - start < range.size).then_some((range, *start))
    }
}

impl GlobalMemory for AddressTable {
    fn find(&self, address: u64) -> Option<(&BufferRange, u64)> {
        self.find(address)
    }
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
            global: match &self.bindings.addresses {
                Some(table) => &**table,
                None => &NoGlobalMemory,
            },
        }
    }
}
