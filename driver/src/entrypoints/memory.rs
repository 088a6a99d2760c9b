//! Device memory.

use crate::error::Error;
use crate::object::memory::Memory;
use crate::{handle, pnext, pointer};
use ash::vk;
use std::ffi::c_void;
use std::sync::Arc;

crate::entry_points! {
    #[doc(alias = "vkAllocateMemory")]
    fn allocate_memory(
        device: vk::Device,
        allocate_info: *const vk::MemoryAllocateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        memory: *mut vk::DeviceMemory,
    ) -> vk::Result {
        let device = handle::get(device)?;
        let info = pointer::input(allocate_info)?;
        let exports = pnext::find::<vk::ExportMemoryAllocateInfo>(info.p_next);
        if exports.is_some_and(|export| !export.handle_types.is_empty()) {
            return Err(Error::FeatureNotPresent("exporting memory".into()));
        }
        let Some((heap, host_visible)) = device.memory_type(info.memory_type_index) else {
            return Err(Error::usage(
                "VUID-vkAllocateMemory-pAllocateInfo-01714",
                format!("there is no memory type {}", info.memory_type_index),
            ));
        };
        let object = Memory::new(heap, info.allocation_size, host_visible)?;
        pointer::output(memory, handle::create(Arc::new(object)))
    }

    #[doc(alias = "vkMapMemory")]
    fn map_memory(
        _device: vk::Device,
        memory: vk::DeviceMemory,
        offset: vk::DeviceSize,
        size: vk::DeviceSize,
        _flags: vk::MemoryMapFlags,
        data: *mut *mut c_void,
    ) -> vk::Result {
        let size = (size != vk::WHOLE_SIZE).then_some(size);
        let address = handle::get(memory)?.map(offset, size)?;
        pointer::output(data, address.cast())
    }

    #[doc(alias = "vkUnmapMemory")]
    fn unmap_memory(_device: vk::Device, memory: vk::DeviceMemory) {
        handle::get(memory)?.unmap();
        Ok(())
    }

    /// All host-visible memory is coherent.
    #[doc(alias = "vkFlushMappedMemoryRanges")]
    fn flush_mapped_memory_ranges(
        _device: vk::Device,
        memory_range_count: u32,
        memory_ranges: *const vk::MappedMemoryRange<'_>,
    ) -> vk::Result {
        check_ranges(pointer::slice(memory_ranges, memory_range_count)?)
    }

    /// All host-visible memory is coherent.
    #[doc(alias = "vkInvalidateMappedMemoryRanges")]
    fn invalidate_mapped_memory_ranges(
        _device: vk::Device,
        memory_range_count: u32,
        memory_ranges: *const vk::MappedMemoryRange<'_>,
    ) -> vk::Result {
        check_ranges(pointer::slice(memory_ranges, memory_range_count)?)
    }

    /// No memory type is lazily allocated, so what is committed is all of it.
    #[doc(alias = "vkGetDeviceMemoryCommitment")]
    fn get_device_memory_commitment(
        _device: vk::Device,
        memory: vk::DeviceMemory,
        committed_memory_in_bytes: *mut vk::DeviceSize,
    ) {
        let size = handle::get(memory)?.allocation().len();
        pointer::output(committed_memory_in_bytes, size)
    }

    #[doc(alias = "vkBindBufferMemory")]
    fn bind_buffer_memory(
        _device: vk::Device,
        buffer: vk::Buffer,
        memory: vk::DeviceMemory,
        memory_offset: vk::DeviceSize,
    ) -> vk::Result {
        bind_buffer(buffer, memory, memory_offset)
    }

    #[doc(alias = "vkBindBufferMemory2")]
    fn bind_buffer_memory2(
        _device: vk::Device,
        bind_info_count: u32,
        bind_infos: *const vk::BindBufferMemoryInfo<'_>,
    ) -> vk::Result {
        pointer::slice(bind_infos, bind_info_count)?
            .iter()
            .try_for_each(|info| bind_buffer(info.buffer, info.memory, info.memory_offset))
    }

    #[doc(alias = "vkBindImageMemory")]
    fn bind_image_memory(
        _device: vk::Device,
        image: vk::Image,
        memory: vk::DeviceMemory,
        memory_offset: vk::DeviceSize,
    ) -> vk::Result {
        bind_image(image, memory, memory_offset)
    }

    #[doc(alias = "vkBindImageMemory2")]
    fn bind_image_memory2(
        _device: vk::Device,
        bind_info_count: u32,
        bind_infos: *const vk::BindImageMemoryInfo<'_>,
    ) -> vk::Result {
        pointer::slice(bind_infos, bind_info_count)?
            .iter()
            .try_for_each(|info| bind_image(info.image, info.memory, info.memory_offset))
    }
}

/// Checks that every range names memory.
///
/// # Safety
/// The ranges' handles are live.
unsafe fn check_ranges(ranges: &[vk::MappedMemoryRange<'_>]) -> Result<(), Error> {
    ranges.iter().try_for_each(|range| {
        // SAFETY: the caller's promise.
        unsafe { handle::get(range.memory) }.map(drop)
    })
}

/// Binds a buffer.
///
/// # Safety
/// The handles are live.
unsafe fn bind_buffer(
    buffer: vk::Buffer,
    memory: vk::DeviceMemory,
    offset: vk::DeviceSize,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    let (buffer, memory) = unsafe { (handle::get(buffer)?, handle::get(memory)?) };
    buffer.bind(Arc::clone(memory.allocation()), offset)
}

/// Binds an image.
///
/// # Safety
/// The handles are live.
unsafe fn bind_image(
    image: vk::Image,
    memory: vk::DeviceMemory,
    offset: vk::DeviceSize,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    let (image, memory) = unsafe { (handle::get(image)?, handle::get(memory)?) };
    image.bind(Arc::clone(memory.allocation()), offset)
}
