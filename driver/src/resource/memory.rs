//! Device memory.

use crate::abi::error::Error;
use crate::abi::handle::{self, objects};
use crate::abi::valid;
use crate::device::Device;
use crate::external::{self, Kind};
use crate::physical_device::external::{HOST_ALIGNMENT, HOST_MEMORY, MEMORY_FD};
use crate::physical_device::memory::{self, Heap};
use ash::vk;
use simdevice::Allocation;
use std::ffi::{c_int, c_void};
use std::ptr::NonNull;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A `VkDeviceMemory`. Resources bound to it share its allocation, which exists as long as any of them.
#[derive(Debug)]
pub(crate) struct Memory {
    allocation: Arc<Allocation>,
    heap: Arc<Heap>,
    /// The bytes that it takes of the heap.
    taken: u64,
    /// True if the host may map it.
    host_visible: bool,
    mapped: AtomicBool,
}

objects! { vk::DeviceMemory => Memory; }

impl Memory {
    /// Allocates `size` zeroed bytes of `heap`.
    ///
    /// # Errors
    /// [`Error::OutOfDeviceMemory`] if the heap or the host has not enough.
    pub(crate) fn new(heap: &Arc<Heap>, size: u64, host_visible: bool) -> Result<Self, Error> {
        Self::of(heap, size, size, host_visible, || {
            Allocation::new(size, host_visible).map_err(|error| Error::OutOfDeviceMemory(error.to_string()))
        })
    }

    /// Takes `taken` bytes of `heap` for an allocation of `size` bytes: all of them, or none if they are the application's.
    fn of(
        heap: &Arc<Heap>,
        size: u64,
        taken: u64,
        host_visible: bool,
        allocate: impl FnOnce() -> Result<Arc<Allocation>, Error>,
    ) -> Result<Self, Error> {
        if size == 0 {
            return Err(Error::usage("VUID-VkMemoryAllocateInfo-allocationSize-07899", "allocationSize is 0"));
        }
        heap.take(taken)?;
        let allocation = allocate().inspect_err(|_| heap.give_back(taken))?;
        let (heap, mapped) = (Arc::clone(heap), AtomicBool::new(false));
        Ok(Self { allocation, heap, taken, host_visible, mapped })
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
        if !self.host_visible {
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
        self.heap.give_back(self.taken);
    }
}

/// Memory that is allocated for export, or imported, if the chain asks for that.
///
/// # Safety
/// The host pointer of an import is valid for as long as Vulkan requires (see [`host_memory`]).
#[doc(alias = "vkAllocateMemory")]
pub(crate) unsafe fn allocate_memory(
    device: &Device,
    allocate_info: &vk::MemoryAllocateInfo<'_>,
    exports: Option<&vk::ExportMemoryAllocateInfo<'_>>,
    priority: Option<&vk::MemoryPriorityAllocateInfoEXT<'_>>,
    file: Option<&vk::ImportMemoryFdInfoKHR<'_>>,
    host: Option<&vk::ImportMemoryHostPointerInfoEXT<'_>>,
) -> Result<Arc<Memory>, Error> {
    if let Some(given) = priority {
        require_priority(device, "VUID-VkMemoryPriorityAllocateInfoEXT-priority-02602", given.priority)?;
    }
    let (size, memory_type) = (allocate_info.allocation_size, allocate_info.memory_type_index);
    let Some((heap, host_visible)) = device.memory_type(memory_type) else {
        return Err(Error::usage(
            "VUID-vkAllocateMemory-pAllocateInfo-01714",
            format!("there is no memory type {memory_type}"),
        ));
    };
    let exports = exports.map_or_else(Default::default, |exports| exports.handle_types);
    // A structure without a type of handle imports nothing.
    let file = file.filter(|file| !file.handle_type.is_empty());
    let host = host.filter(|host| !host.handle_type.is_empty());
    check_exports(exports, host.is_some())?;
    let kind = Kind::Memory { memory_type };
    let memory = match (file, host) {
        (Some(_), Some(_)) => {
            return Err(Error::usage(
                "VUID-VkMemoryAllocateInfo-None-06657",
                "memory is imported from a file descriptor and from a host pointer",
            ));
        }
        (Some(file), None) => {
            check_import(file.handle_type, MEMORY_FD, "VUID-VkImportMemoryFdInfoKHR-handleType-00667")?;
            let memory = Memory::of(heap, size, size, host_visible, || external::import(file.fd, kind, size))?;
            // SAFETY: an import gives the descriptor to the driver, which has used it.
            unsafe { external::close(file.fd) };
            memory
        }
        (None, Some(host)) => {
            check_import(host.handle_type, HOST_MEMORY, "VUID-VkImportMemoryHostPointerInfoEXT-handleType-01747")?;
            if !host_visible {
                return Err(Error::usage(
                    "VUID-VkMemoryAllocateInfo-memoryTypeIndex-01744",
                    format!("a host pointer is imported as memory of type {memory_type}, which is not host-visible"),
                ));
            }
            // SAFETY: the caller's promise.
            Memory::of(heap, size, 0, host_visible, || unsafe { host_memory(host.p_host_pointer, size) })?
        }
        (None, None) if exports.is_empty() => Memory::new(heap, size, host_visible)?,
        (None, None) => Memory::of(heap, size, size, host_visible, || {
            let allocated = Allocation::new_shared(size, &external::label(kind, size));
            allocated.map_err(|error| Error::OutOfDeviceMemory(error.to_string()))
        })?,
    };
    Ok(Arc::new(memory))
}

/// Checks the types of handles for which memory is allocated.
fn check_exports(exports: vk::ExternalMemoryHandleTypeFlags, is_host_memory: bool) -> Result<(), Error> {
    if exports.is_empty() || (exports == MEMORY_FD && !is_host_memory) {
        return Ok(());
    }
    let what = if is_host_memory { "memory of the host" } else { "memory" };
    Err(Error::usage(
        "VUID-VkExportMemoryAllocateInfo-handleTypes-00656",
        format!("{what} cannot be exported with handles of types {exports:?}"),
    ))
}

/// Checks the type of the handle from which memory is imported.
fn check_import(
    found: vk::ExternalMemoryHandleTypeFlags,
    supported: vk::ExternalMemoryHandleTypeFlags,
    rule: &'static str,
) -> Result<(), Error> {
    if found == supported {
        return Ok(());
    }
    Err(Error::usage(rule, format!("memory cannot be imported from a handle of type {found:?}")))
}

/// The application's own memory as device memory.
///
/// # Errors
/// [`Error::InvalidUsage`] if the range is not aligned, [`Error::InvalidExternalHandle`] if nothing is mapped there.
///
/// # Safety
/// Vulkan requires: the pointer is to `size` bytes of host memory (`VUID-VkImportMemoryHostPointerInfoEXT-handleType-01750`)
/// that can be read and written until the memory object is freed and the device has done what uses it.
unsafe fn host_memory(pointer: *mut c_void, size: u64) -> Result<Arc<Allocation>, Error> {
    check_host_pointer(pointer, "VUID-VkImportMemoryHostPointerInfoEXT-pHostPointer-01749")?;
    if !size.is_multiple_of(HOST_ALIGNMENT) {
        return Err(Error::usage(
            "VUID-VkMemoryAllocateInfo-allocationSize-01745",
            format!("allocationSize {size} of a host pointer is not a multiple of {HOST_ALIGNMENT}"),
        ));
    }
    let refuse = |reason: String| Error::InvalidExternalHandle(format!("{pointer:?} cannot be imported: {reason}"));
    let start = NonNull::new(pointer.cast::<u8>()).ok_or_else(|| refuse("it is null".to_owned()))?;
    // SAFETY: the caller's promise. Objects that are bound to the memory may outlive it, but Vulkan lets them be destroyed
    // alone.
    unsafe { Allocation::of_host(start, size) }.map_err(|_| refuse(format!("not all of its {size} bytes are mapped")))
}

fn check_host_pointer(pointer: *const c_void, rule: &'static str) -> Result<(), Error> {
    if (pointer.addr() as u64).is_multiple_of(HOST_ALIGNMENT) {
        return Ok(());
    }
    Err(Error::usage(rule, format!("the host pointer {pointer:?} is not aligned to {HOST_ALIGNMENT} bytes")))
}

#[doc(alias = "vkGetMemoryHostPointerPropertiesEXT")]
pub(crate) fn get_memory_host_pointer_properties(
    handle_type: vk::ExternalMemoryHandleTypeFlags,
    host_pointer: *const c_void,
    memory_host_pointer_properties: &mut vk::MemoryHostPointerPropertiesEXT<'_>,
) -> Result<(), Error> {
    check_import(handle_type, HOST_MEMORY, "VUID-vkGetMemoryHostPointerPropertiesEXT-handleType-01752")?;
    check_host_pointer(host_pointer, "VUID-vkGetMemoryHostPointerPropertiesEXT-pHostPointer-01753")?;
    memory_host_pointer_properties.memory_type_bits = memory::HOST_VISIBLE_TYPE_BITS;
    Ok(())
}

#[doc(alias = "vkGetMemoryFdKHR")]
pub(crate) fn get_memory_fd(memory: &Memory, handle_type: vk::ExternalMemoryHandleTypeFlags) -> Result<c_int, Error> {
    match memory.allocation.file() {
        Some(file) if handle_type == MEMORY_FD => external::export(file),
        _ => Err(Error::usage(
            "VUID-VkMemoryGetFdInfoKHR-handleType-00671",
            format!("the memory was not allocated for export with handles of type {handle_type:?}"),
        )),
    }
}

/// Refuses: opaque file descriptors alone are imported, of which nothing is asked.
#[doc(alias = "vkGetMemoryFdPropertiesKHR")]
pub(crate) fn get_memory_fd_properties(handle_type: vk::ExternalMemoryHandleTypeFlags) -> Result<(), Error> {
    if handle_type == MEMORY_FD {
        return Err(Error::usage(
            "VUID-vkGetMemoryFdPropertiesKHR-handleType-00674",
            "the properties of an opaque file descriptor are asked for",
        ));
    }
    Err(Error::InvalidExternalHandle(format!("memory is not imported from handles of type {handle_type:?}")))
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
