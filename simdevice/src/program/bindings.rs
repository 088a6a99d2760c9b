//! The buffers, images, samplers and constants that the programs of a draw or dispatch are bound to.

use crate::texture::{ImageBinding, ImageTable, Sampler};
use devmem::{Allocation, BufferRange};
use fearless_simd::Level;
use isa::resources::{GlobalMemory, NoGlobalMemory, Resources, words};
use std::sync::Arc;
use std::sync::atomic::AtomicU32;

/// Buffers, images, samplers and push constants, each list indexed by bind point. Bind points beyond the end of a list
/// are unbound.
#[derive(Clone, Debug, Default)]
pub struct Bindings {
    /// The buffers; `None` is a buffer of size zero. Offsets are multiples of 4.
    pub buffers: Vec<Option<BufferRange>>,
    /// The images and texel buffers.
    pub images: Vec<ImageBinding>,
    /// The samplers.
    pub samplers: Vec<Option<Sampler>>,
    /// The push constants. Reads beyond the end yield zero.
    pub push_constants: Vec<u8>,
    /// The buffers that the program reads and writes by device address.
    pub addresses: Option<Arc<AddressTable>>,
    /// The memory that the program may write. After the program, data that were derived from this memory are derived
    /// again.
    pub written: Vec<Arc<Allocation>>,
}

/// The buffers that have device addresses.
#[derive(Debug, Default)]
pub struct AddressTable(Vec<(u64, BufferRange)>);

impl AddressTable {
    /// Makes a table of buffers, each with the address of its first byte. They are in order of addresses and do not
    /// overlap.
    pub fn new(buffers: Vec<(u64, BufferRange)>) -> Self {
        Self(buffers)
    }

    /// The buffers of the table.
    pub fn buffers(&self) -> impl Iterator<Item = &BufferRange> {
        self.0.iter().map(|(_, range)| range)
    }

    /// Finds the buffer that contains an address. Returns it with the address of its first byte.
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

/// Bindings in the form that programs read, made once for a draw or dispatch.
pub(crate) struct BoundResources<'a> {
    bindings: &'a Bindings,
    images: ImageTable,
    push_constants: Vec<AtomicU32>,
}

impl Bindings {
    /// Prepares the bindings for programs that run at a SIMD level.
    pub(crate) fn bind(&self, level: Level) -> BoundResources<'_> {
        let (images, samplers) = (self.images.iter().cloned(), self.samplers.iter().copied());
        BoundResources {
            bindings: self,
            images: ImageTable::new(level, images, samplers),
            push_constants: words(&self.push_constants),
        }
    }

    /// Marks the memory that the program may have written as changed.
    pub(crate) fn bump_generations(&self) {
        for memory in &self.written {
            memory.bump_generation();
        }
    }
}

impl BoundResources<'_> {
    /// The resources of a program.
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
