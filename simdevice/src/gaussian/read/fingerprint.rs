//! Fingerprints of attributes in memory, by which data derived from them stay valid.

use crate::format::Format;
use crate::packet::AttributeStream;
use devmem::Allocation;
use std::sync::{Arc, Weak};

/// Identifies the bytes that an attribute is read from: the memory, its generation, the place in it, and the format.
#[derive(Debug)]
pub(crate) struct SourceFingerprint {
    memory: Weak<Allocation>,
    generation: u64,
    /// Offset and size of the buffer in the memory, then stride and offset of the attribute.
    place: [u64; 4],
    format: Format,
    instance_divisor: Option<u32>,
}

impl SourceFingerprint {
    pub(crate) fn new(stream: &AttributeStream) -> Self {
        let buffer = &stream.buffer;
        Self {
            memory: Arc::downgrade(&buffer.memory),
            generation: buffer.memory.generation(),
            place: [buffer.offset, buffer.size, stream.stride.into(), stream.offset.into()],
            format: stream.format,
            instance_divisor: stream.instance_divisor,
        }
    }

    /// The memory, if it is still allocated.
    pub(crate) fn memory(&self) -> Option<Arc<Allocation>> {
        self.memory.upgrade()
    }

    /// True if the memory is still allocated and nothing was written to it since.
    pub(crate) fn is_current(&self) -> bool {
        let memory = self.memory.upgrade();
        memory.is_some_and(|memory| memory.generation() == self.generation)
    }

    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let how = |own: &Self| (own.generation, own.format, own.instance_divisor);
        self.is_same_buffer(other) && how(self) == how(other)
    }

    /// True if both name the same place in the same memory, of whatever generation and format.
    pub(crate) fn is_same_buffer(&self, other: &Self) -> bool {
        self.memory.ptr_eq(&other.memory) && self.place == other.place
    }
}

/// True if an attribute is in memory that only the device writes.
pub(crate) fn is_device_local(stream: &AttributeStream) -> bool {
    !stream.buffer.memory.is_host_visible()
}
