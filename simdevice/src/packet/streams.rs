//! Streams of vertex attributes and indices in buffers. Reads outside of a buffer yield zero.

use crate::format::Format;
use devmem::{BufferRange, host};

/// The source of one vertex attribute. An element outside of `buffer` reads as zero.
#[derive(Clone, Debug)]
pub struct AttributeStream {
    /// The vertex buffer, from the bound offset on.
    pub buffer: BufferRange,
    /// Bytes from one vertex to the next.
    pub stride: u32,
    /// Bytes from the vertex's start to the attribute.
    pub offset: u32,
    /// The format of the stored components.
    pub format: Format,
    /// The number of instances for which a value is used; 0 uses the first value for all. `None` reads by vertex.
    pub instance_divisor: Option<u32>,
}

/// An index buffer.
#[derive(Clone, Debug)]
pub struct IndexStream {
    /// The indices, from the bound offset on.
    pub buffer: BufferRange,
    /// Bytes per index: 1, 2 or 4.
    pub index_size: u32,
    /// The number that is added to every index.
    pub vertex_offset: i32,
}

impl AttributeStream {
    /// The offset in memory of `bytes` bytes from an element on; `None` unless all of them are inside the buffer.
    #[inline]
    pub(crate) fn place(&self, element: u64, bytes: u64) -> Option<u64> {
        let start = element
            .checked_mul(self.stride.into())?
            .checked_add(self.offset.into())?;
        if start.checked_add(bytes)? > self.buffer.size {
            return None;
        }
        self.buffer.offset.checked_add(start)
    }

    /// Reads bytes from an element on. Fills `out` with zeros unless all of the bytes are inside the buffer.
    #[inline]
    pub(crate) fn read(&self, element: u64, out: &mut [u8]) {
        let place = self.place(element, out.len() as u64);
        if place.is_none_or(|place| self.buffer.memory.read(place, out).is_err()) {
            out.fill(0);
        }
    }
}

impl IndexStream {
    /// The number of indices in the buffer.
    pub(crate) fn len(&self) -> u64 {
        let memory = self.buffer.memory.len();
        let bytes = memory.saturating_sub(self.buffer.offset);
        bytes.min(self.buffer.size) / u64::from(self.index_size.max(1))
    }

    /// The index that restarts a primitive: the greatest of its size.
    pub(crate) fn restart_index(&self) -> u32 {
        match self.index_size {
            1 => 0xFF,
            2 => 0xFFFF,
            _ => u32::MAX,
        }
    }

    /// Reads `len` indices from number `first` on into `out`, without the vertex offset. Indices outside of the buffer
    /// are zero.
    pub(crate) fn read(&self, first: u64, len: u32, out: &mut Vec<u32>) {
        let size = u64::from(self.index_size.max(1));
        out.clear();
        host::resize(out, len as usize, 0);
        let known = self.len().saturating_sub(first).min(len.into()) as usize;
        if known == 0 {
            return;
        }
        // The indices are inside the buffer, so that neither operation overflows.
        let start = self.buffer.offset + first * size;
        let out = &mut out[..known];
        let memory = &self.buffer.memory;
        // Reads inside the buffer do not fail.
        match self.index_size {
            1 => {
                let mut bytes: Vec<u8> = host::zeroed(known);
                let _ = memory.read(start, &mut bytes);
                out.iter_mut()
                    .zip(bytes)
                    .for_each(|(out, byte)| *out = byte.into());
            }
            2 => {
                let mut halves: Vec<u16> = host::zeroed(known);
                let _ = memory.read(start, &mut halves);
                out.iter_mut()
                    .zip(halves)
                    .for_each(|(out, half)| *out = half.into());
            }
            _ => {
                let _ = memory.read(start, out);
            }
        }
    }
}
