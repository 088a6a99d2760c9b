//! Buffers.

use crate::error::Error;
use ash::vk;
use simdevice::Allocation;
use simdevice::packet::BufferRange;
use std::sync::{Arc, OnceLock};

/// Every buffer's offset in memory must be a multiple of this. It is a cache line, and as much as any texel needs.
pub(crate) const ALIGNMENT: u64 = 64;

/// A buffer.
#[derive(Debug)]
pub(crate) struct Buffer {
    size: u64,
    memory: OnceLock<(Arc<Allocation>, u64)>,
}

crate::objects! { vk::Buffer => Buffer; }

impl Buffer {
    /// A buffer of `size` bytes, not yet bound to memory.
    pub(crate) fn new(size: u64) -> Self {
        Self {
            size,
            memory: OnceLock::new(),
        }
    }

    /// What memory it needs; of any type.
    pub(crate) fn requirements(&self, memory_type_bits: u32) -> vk::MemoryRequirements {
        requirements(self.size, memory_type_bits)
    }

    /// Binds it to memory from byte `offset` on.
    ///
    /// # Errors
    /// [`Error::Usage`] if it is bound already or does not fit.
    pub(crate) fn bind(&self, memory: Arc<Allocation>, offset: u64) -> Result<(), Error> {
        fits(
            "VUID-vkBindBufferMemory-size-01037",
            &memory,
            offset,
            self.size,
        )?;
        self.memory.set((memory, offset)).map_err(|_| {
            Error::usage(
                "VUID-vkBindBufferMemory-buffer-07459",
                "the buffer is bound already",
            )
        })
    }

    /// The bytes from `offset` on: `size` of them, or with `None` (`VK_WHOLE_SIZE`) all that follow.
    ///
    /// # Errors
    /// [`Error::Usage`] if the buffer is not bound or has no such bytes.
    pub(crate) fn range(&self, offset: u64, size: Option<u64>) -> Result<BufferRange, Error> {
        let Some((memory, start)) = self.memory.get() else {
            return Err(Error::usage(
                "VUID-vkCmd-buffer-memory",
                "a command uses a buffer that is not bound to memory",
            ));
        };
        let rest = self.size.checked_sub(offset);
        match (rest, size) {
            (Some(rest), size) if size.is_none_or(|size| size <= rest) => Ok(BufferRange {
                memory: Arc::clone(memory),
                offset: start + offset,
                size: size.unwrap_or(rest),
            }),
            _ => Err(Error::usage(
                "VUID-vkCmd-buffer-range",
                format!(
                    "a command uses {} bytes at offset {offset} of a buffer of {} bytes",
                    size.unwrap_or(0),
                    self.size
                ),
            )),
        }
    }

    /// All of the buffer.
    ///
    /// # Errors
    /// [`Error::Usage`] if the buffer is not bound.
    pub(crate) fn whole(&self) -> Result<BufferRange, Error> {
        self.range(0, None)
    }
}

/// The requirements of a resource of `size` bytes.
pub(crate) fn requirements(size: u64, memory_type_bits: u32) -> vk::MemoryRequirements {
    vk::MemoryRequirements {
        // No memory has room for what cannot be rounded up.
        size: size.checked_next_multiple_of(ALIGNMENT).unwrap_or(u64::MAX),
        alignment: ALIGNMENT,
        memory_type_bits,
    }
}

/// Checks that `size` bytes from `offset` on lie in `memory` and that the offset is aligned.
pub(crate) fn fits(
    vuid: &'static str,
    memory: &Allocation,
    offset: u64,
    size: u64,
) -> Result<(), Error> {
    let end = offset.checked_add(size);
    if offset.is_multiple_of(ALIGNMENT) && end.is_some_and(|end| end <= memory.len()) {
        return Ok(());
    }
    Err(Error::usage(
        vuid,
        format!(
            "a resource of {size} bytes cannot be bound at offset {offset} of {} bytes of memory (offsets are \
             multiples of {ALIGNMENT})",
            memory.len()
        ),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_lie_inside_the_buffer() {
        let buffer = Buffer::new(100);
        assert!(buffer.whole().is_err(), "not bound");
        let memory = Allocation::new_zeroed(4096).unwrap();
        assert!(buffer.bind(memory.clone(), 4032).is_err(), "does not fit");
        assert!(buffer.bind(memory.clone(), 3).is_err(), "not aligned");
        buffer.bind(memory.clone(), 128).unwrap();
        assert!(buffer.bind(memory, 128).is_err(), "bound already");
        let range = buffer.range(10, None).unwrap();
        assert_eq!((range.offset, range.size), (138, 90));
        assert_eq!(buffer.range(100, None).unwrap().size, 0);
        assert!(buffer.range(101, None).is_err());
        assert!(buffer.range(99, Some(2)).is_err());
        assert!(buffer.range(u64::MAX, Some(2)).is_err());
    }
}
