//! Device memory.

use crate::abi::error::Error;
use crate::abi::handle::{self, objects};
use crate::abi::valid;
use crate::device::Device;
use crate::physical_device::memory::Heap;
use ash::vk;
use simdevice::Allocation;
use std::ffi::c_void;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A `VkDeviceMemory`. Resources bound to it share its allocation, which exists as long as any of them.
#[derive(Debug)]
pub(crate) struct Memory {
    allocation: Arc<Allocation>,
    heap: Arc<Heap>,
    mapped: AtomicBool,
}

objects! { vk::DeviceMemory => Memory; }

impl Memory {
    /// Allocates `size` zeroed bytes of `heap`.
    ///
    /// # Errors
    /// [`Error::OutOfDeviceMemory`] if the heap or the host has not enough.
    pub(crate) fn new(heap: &Arc<Heap>, size: u64, host_visible: bool) -> Result<Self, Error> {
        if size == 0 {
            return Err(Error::usage("VUID-VkMemoryAllocateInfo-allocationSize-07899", "allocationSize is 0"));
        }
        heap.take(size)?;
        let allocation = Allocation::new(size, host_visible).map_err(|error| {
            heap.give_back(size);
            Error::OutOfDeviceMemory(error.to_string())
        })?;
        Ok(Self { allocation, heap: Arc::clone(heap), mapped: AtomicBool::new(false) })
    }

    /// The allocation.
    pub(crate) fn allocation(&self) -> &Arc<Allocation> {
        &self.allocation
    }

    /// Maps `size` bytes from `offset` on; with `None`, all bytes from there on.
    ///
    /// # Errors
    /// [`Error::MemoryMapFailed`] if it is not host-visible, [`Error::InvalidUsage`] if it is mapped already or the
    /// range exceeds it.
    pub(crate) fn map(&self, offset: u64, size: Option<u64>) -> Result<*mut u8, Error> {
        if !self.allocation.is_host_visible() {
            return Err(Error::MemoryMapFailed("its type is not host-visible (VUID-vkMapMemory-memory-00682)".into()));
        }
        let end = offset.checked_add(size.unwrap_or(1));
        if end.is_none_or(|end| end > self.allocation.len()) {
            return Err(Error::usage(
                "VUID-vkMapMemory-offset-00679",
                format!("the range at {offset} does not lie in an allocation of {} bytes", self.allocation.len()),
            ));
        }
        if self.mapped.swap(true, Ordering::AcqRel) {
            return Err(Error::usage("VUID-vkMapMemory-memory-00678", "the memory is mapped already"));
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

#[doc(alias = "vkAllocateMemory")]
pub(crate) fn allocate_memory(
    device: &Device,
    allocate_info: &vk::MemoryAllocateInfo<'_>,
    exports: Option<&vk::ExportMemoryAllocateInfo<'_>>,
    priority: Option<&vk::MemoryPriorityAllocateInfoEXT<'_>>,
) -> Result<Arc<Memory>, Error> {
    let info = allocate_info;
    if let Some(given) = priority {
        require_priority(device, "VUID-VkMemoryPriorityAllocateInfoEXT-priority-02602", given.priority)?;
    }
    if exports.is_some_and(|export| !export.handle_types.is_empty()) {
        return Err(Error::FeatureNotPresent("exporting memory".into()));
    }
    let Some((heap, host_visible)) = device.memory_type(info.memory_type_index) else {
        return Err(Error::usage(
            "VUID-vkAllocateMemory-pAllocateInfo-01714",
            format!("there is no memory type {}", info.memory_type_index),
        ));
    };
    Memory::new(heap, info.allocation_size, host_visible).map(Arc::new)
}

/// Binds resources to memory by their infos, whose chains are at `chain`. Each is tried, and its result is written where
/// its chain asks for it.
///
/// # Errors
/// The first error of `bind`.
///
/// # Safety
/// The chains are valid.
pub(crate) unsafe fn bind_all<T>(
    infos: &[T],
    chain: impl Fn(&T) -> *const c_void,
    mut bind: impl FnMut(&T) -> Result<(), Error>,
) -> Result<(), Error> {
    let mut first = Ok(());
    for info in infos {
        let bound = bind(info);
        // SAFETY: the caller's promise.
        unsafe {
            if let Some(status) = valid::find_in_chain::<vk::BindMemoryStatusKHR<'_>>(chain(info)) {
                let result = bound.as_ref().map_or_else(Error::result, |()| vk::Result::SUCCESS);
                valid::output(status.p_result, result)?;
            }
        }
        first = first.and(bound);
    }
    first
}

/// Warns of what is no priority of memory.
///
/// # Errors
/// [`Error::InvalidUsage`] on a strict device.
fn require_priority(device: &Device, vuid: &'static str, priority: f32) -> Result<(), Error> {
    let is_one = (0.0..=1.0).contains(&priority);
    device.enabled().require(is_one, || Error::usage(vuid, format!("the priority {priority} is not from 0 to 1")))
}

/// Checks the priority only: memory is never moved, so that it makes no difference.
#[doc(alias = "vkSetDeviceMemoryPriorityEXT")]
pub(crate) fn set_device_memory_priority(device: &Device, _memory: &Memory, priority: f32) -> Result<(), Error> {
    require_priority(device, "VUID-vkSetDeviceMemoryPriorityEXT-priority-06258", priority)
}

#[doc(alias = "vkMapMemory")]
#[doc(alias = "vkMapMemory2KHR")]
pub(crate) fn map_memory(memory: &Memory, offset: vk::DeviceSize, size: vk::DeviceSize) -> Result<*mut c_void, Error> {
    let size = (size != vk::WHOLE_SIZE).then_some(size);
    Ok(memory.map(offset, size)?.cast())
}

#[doc(alias = "vkUnmapMemory")]
#[doc(alias = "vkUnmapMemory2KHR")]
pub(crate) fn unmap_memory(memory: &Memory) -> Result<(), Error> {
    memory.unmap();
    Ok(())
}

/// Does nothing but check the handles: all host-visible memory is coherent.
///
/// # Safety
/// The ranges' handles are live.
#[doc(alias = "vkFlushMappedMemoryRanges")]
#[doc(alias = "vkInvalidateMappedMemoryRanges")]
pub(crate) unsafe fn flush_mapped_memory_ranges(memory_ranges: &[vk::MappedMemoryRange<'_>]) -> Result<(), Error> {
    memory_ranges.iter().try_for_each(|range| {
        // SAFETY: the caller's promise.
        unsafe { handle::get(range.memory) }.map(drop)
    })
}

/// Returns zero: memory has no address, only the buffers bound to it have.
#[doc(alias = "vkGetDeviceMemoryOpaqueCaptureAddress")]
pub(crate) fn get_device_memory_opaque_capture_address() -> Result<u64, Error> {
    Ok(0)
}

/// Returns the size of the memory: no memory type is lazily allocated.
#[doc(alias = "vkGetDeviceMemoryCommitment")]
pub(crate) fn get_device_memory_commitment(memory: &Memory) -> Result<vk::DeviceSize, Error> {
    Ok(memory.allocation().len())
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
        assert!(matches!(device_local.map(0, None), Err(Error::MemoryMapFailed(_))));
        let memory = Memory::new(&heap, 100, true).unwrap();
        assert!(memory.map(100, None).is_err());
        assert!(memory.map(60, Some(41)).is_err());
        memory.map(60, Some(40)).unwrap();
        assert!(memory.map(0, None).is_err(), "mapped already");
        memory.unmap();
        memory.map(0, None).unwrap();
    }
}
