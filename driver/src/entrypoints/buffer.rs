//! Buffers.

use crate::capabilities::memory::ALL_TYPE_BITS;
use crate::error::Error;
use crate::object::buffer::Buffer;
use crate::{handle, pnext, pointer};
use ash::vk;
use std::sync::Arc;

crate::entry_points! {
    #[doc(alias = "vkCreateBuffer")]
    fn create_buffer(
        _device: vk::Device,
        create_info: *const vk::BufferCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        buffer: *mut vk::Buffer,
    ) -> vk::Result {
        let object = new_buffer(pointer::input(create_info)?)?;
        pointer::output(buffer, handle::create(Arc::new(object)))
    }

    #[doc(alias = "vkGetBufferMemoryRequirements")]
    fn get_buffer_memory_requirements(
        _device: vk::Device,
        buffer: vk::Buffer,
        memory_requirements: *mut vk::MemoryRequirements,
    ) {
        let requirements = handle::get(buffer)?.requirements(ALL_TYPE_BITS);
        pointer::output(memory_requirements, requirements)
    }

    #[doc(alias = "vkGetBufferMemoryRequirements2")]
    fn get_buffer_memory_requirements2(
        _device: vk::Device,
        info: *const vk::BufferMemoryRequirementsInfo2<'_>,
        memory_requirements: *mut vk::MemoryRequirements2<'_>,
    ) {
        let buffer = handle::get(pointer::input(info)?.buffer)?;
        fill_requirements(memory_requirements, buffer.requirements(ALL_TYPE_BITS))
    }

    #[doc(alias = "vkGetDeviceBufferMemoryRequirements")]
    fn get_device_buffer_memory_requirements(
        _device: vk::Device,
        info: *const vk::DeviceBufferMemoryRequirements<'_>,
        memory_requirements: *mut vk::MemoryRequirements2<'_>,
    ) {
        let create_info = pointer::input(pointer::input(info)?.p_create_info)?;
        let buffer = new_buffer(create_info)?;
        fill_requirements(memory_requirements, buffer.requirements(ALL_TYPE_BITS))
    }
}

/// The buffer that a create info asks for.
///
/// # Safety
/// The create info's chain is valid.
unsafe fn new_buffer(info: &vk::BufferCreateInfo<'_>) -> Result<Buffer, Error> {
    // SAFETY: the caller's promise.
    let external = unsafe { pnext::find::<vk::ExternalMemoryBufferCreateInfo>(info.p_next) };
    if external.is_some_and(|external| !external.handle_types.is_empty()) {
        return Err(Error::FeatureNotPresent("external memory".into()));
    }
    let sparse_or_protected = vk::BufferCreateFlags::SPARSE_BINDING
        | vk::BufferCreateFlags::SPARSE_RESIDENCY
        | vk::BufferCreateFlags::SPARSE_ALIASED
        | vk::BufferCreateFlags::PROTECTED;
    if info.flags.intersects(sparse_or_protected) {
        return Err(Error::FeatureNotPresent(format!(
            "a buffer with flags {:?}",
            info.flags
        )));
    }
    if info.size == 0 {
        return Err(Error::usage(
            "VUID-VkBufferCreateInfo-size-00912",
            "the size of a buffer is 0",
        ));
    }
    Ok(Buffer::new(info.size))
}

/// Writes requirements and, where asked for, that no dedicated allocation is wanted.
///
/// # Safety
/// `out` is null or a structure with a valid chain that the application lends.
pub(crate) unsafe fn fill_requirements(
    out: *mut vk::MemoryRequirements2<'_>,
    requirements: vk::MemoryRequirements,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    let out = unsafe { pointer::output_structure(out)? };
    out.memory_requirements = requirements;
    // SAFETY: the caller's promise.
    unsafe {
        pnext::for_each_output(out.p_next, |mut structure| {
            if let Some(dedicated) = structure.cast::<vk::MemoryDedicatedRequirements>() {
                dedicated.prefers_dedicated_allocation = vk::FALSE;
                dedicated.requires_dedicated_allocation = vk::FALSE;
            }
        });
    }
    Ok(())
}
