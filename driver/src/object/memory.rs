//! Device memory and the accounting of its heap.

use crate::error::Error;
use simdevice::Allocation;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// What is allocated of a memory heap.
#[derive(Debug)]
pub(crate) struct Heap {
    size: u64,
    used: AtomicU64,
}

impl Heap {
    /// An unused heap of `size` bytes.
    pub(crate) fn new(size: u64) -> Self {
        Self {
            size,
            used: AtomicU64::new(0),
        }
    }

    /// Takes `size` bytes, or none.
    fn take(&self, size: u64) -> Result<(), Error> {
        let within_budget = |used: u64| used.checked_add(size).filter(|&used| used <= self.size);
        self.used
            .fetch_update(Ordering::AcqRel, Ordering::Acquire, within_budget)
            .map(drop)
            .map_err(|used| {
                Error::OutOfDeviceMemory(format!(
                    "{size} bytes asked for, and {used} of the heap's {} are taken",
                    self.size
                ))
            })
    }

    fn give_back(&self, size: u64) {
        self.used.fetch_sub(size, Ordering::AcqRel);
    }
}

/// A `VkDeviceMemory`. Resources bound to it share its allocation, which lives as long as any of them.
#[derive(Debug)]
pub(crate) struct Memory {
    allocation: Arc<Allocation>,
    heap: Arc<Heap>,
    mapped: AtomicBool,
}

crate::objects! { ash::vk::DeviceMemory => Memory; }

impl Memory {
    /// Allocates `size` zeroed bytes of `heap`.
    ///
    /// # Errors
    /// [`Error::OutOfDeviceMemory`] if the heap or the host has no more.
    pub(crate) fn new(heap: &Arc<Heap>, size: u64, host_visible: bool) -> Result<Self, Error> {
        if size == 0 {
            return Err(Error::usage(
                "VUID-VkMemoryAllocateInfo-allocationSize-07899",
                "allocationSize is 0",
            ));
        }
        heap.take(size)?;
        let allocation = Allocation::new(size, host_visible).map_err(|error| {
            heap.give_back(size);
            Error::OutOfDeviceMemory(error.to_string())
        })?;
        Ok(Self {
            allocation,
            heap: Arc::clone(heap),
            mapped: AtomicBool::new(false),
        })
    }

    /// The memory itself.
    pub(crate) fn allocation(&self) -> &Arc<Allocation> {
        &self.allocation
    }

    /// Maps `size` bytes from `offset` on; `None` is all that follow.
    ///
    /// # Errors
    /// [`Error::MemoryMapFailed`] if it is not host-visible, [`Error::Usage`] if it is mapped already or the range
    /// does not lie in it.
    pub(crate) fn map(&self, offset: u64, size: Option<u64>) -> Result<*mut u8, Error> {
        if !self.allocation.is_host_visible() {
            return Err(Error::MemoryMapFailed(
                "its type is not host-visible (VUID-vkMapMemory-memory-00682)".into(),
            ));
        }
        let end = offset.checked_add(size.unwrap_or(1));
        if end.is_none_or(|end| end > self.allocation.len()) {
            return Err(Error::usage(
                "VUID-vkMapMemory-offset-00679",
                format!(
                    "the range at {offset} does not lie in an allocation of {} bytes",
                    self.allocation.len()
                ),
            ));
        }
        if self.mapped.swap(true, Ordering::AcqRel) {
            return Err(Error::usage(
                "VUID-vkMapMemory-memory-00678",
                "the memory is mapped already",
            ));
        }
        // The range was checked, so this stays inside the mapping.
        Ok(self.allocation.host_pointer().wrapping_add(offset as usize))
    }

    /// Ends a mapping.
    pub(crate) fn unmap(&self) {
        self.mapped.store(false, Ordering::Release);
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        self.heap.give_back(self.allocation.len());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heap_gives_no_more_than_it_has() {
        let heap = Arc::new(Heap::new(10_000));
        let first = Memory::new(&heap, 9_000, true).unwrap();
        let refused = Memory::new(&heap, 1_001, true).unwrap_err();
        assert!(matches!(refused, Error::OutOfDeviceMemory(_)));
        assert!(Memory::new(&heap, u64::MAX, true).is_err());
        drop(first);
        assert!(Memory::new(&heap, 10_000, true).is_ok());
    }

    #[test]
    fn only_host_visible_memory_is_mapped_and_once() {
        let heap = Arc::new(Heap::new(10_000));
        let device_local = Memory::new(&heap, 100, false).unwrap();
        assert!(matches!(
            device_local.map(0, None),
            Err(Error::MemoryMapFailed(_))
        ));
        let memory = Memory::new(&heap, 100, true).unwrap();
        assert!(memory.map(100, None).is_err());
        assert!(memory.map(60, Some(41)).is_err());
        memory.map(60, Some(40)).unwrap();
        assert!(memory.map(0, None).is_err(), "mapped already");
        memory.unmap();
        memory.map(0, None).unwrap();
    }
}
