//! Sharing with other devices, with other processes and with the host: the types of handles for memory, semaphores and
//! fences, and what can be done with each.

use crate::abi::error::Error;
use ash::vk;

/// The type of handle by which devices and processes share memory.
pub(crate) const MEMORY_FD: vk::ExternalMemoryHandleTypeFlags = vk::ExternalMemoryHandleTypeFlags::OPAQUE_FD;

/// The type of handle of the application's own memory.
pub(crate) const HOST_MEMORY: vk::ExternalMemoryHandleTypeFlags =
    vk::ExternalMemoryHandleTypeFlags::HOST_ALLOCATION_EXT;

/// The alignment of the application's own memory, and of its size, in bytes.
pub(crate) const HOST_ALIGNMENT: u64 = super::memory::ALIGNMENT;

/// `VkExternalMemoryProperties` of buffers and images whose memory has a handle of a type; all zero if none can.
pub(crate) fn memory_properties(handle_type: vk::ExternalMemoryHandleTypeFlags) -> vk::ExternalMemoryProperties {
    use vk::ExternalMemoryFeatureFlags as Features;
    let none = vk::ExternalMemoryHandleTypeFlags::empty();
    let (external_memory_features, export_from_imported_handle_types) = match handle_type {
        MEMORY_FD => (Features::EXPORTABLE | Features::IMPORTABLE, MEMORY_FD),
        HOST_MEMORY => (Features::IMPORTABLE, none),
        _ => return vk::ExternalMemoryProperties::default(),
    };
    vk::ExternalMemoryProperties {
        external_memory_features,
        export_from_imported_handle_types,
        compatible_handle_types: handle_type,
    }
}

/// Checks the types of handles that a buffer or an image is created for, which must be compatible.
///
/// # Errors
/// [`Error::InvalidUsage`] of the rule.
pub(crate) fn check_memory_types(
    handle_types: vk::ExternalMemoryHandleTypeFlags,
    rule: &'static str,
) -> Result<(), Error> {
    if [vk::ExternalMemoryHandleTypeFlags::empty(), MEMORY_FD, HOST_MEMORY].contains(&handle_types) {
        return Ok(());
    }
    Err(Error::usage(
        rule,
        format!("memory cannot have handles of types {handle_types:?}: it can of {MEMORY_FD:?} or of {HOST_MEMORY:?}"),
    ))
}

/// Reports whether semaphores can be shared by handles of a type: timelines by opaque ones alone.
pub(crate) fn shares_semaphores(handle_type: vk::ExternalSemaphoreHandleTypeFlags, is_timeline: bool) -> bool {
    handle_type == vk::ExternalSemaphoreHandleTypeFlags::OPAQUE_FD
        || (handle_type == vk::ExternalSemaphoreHandleTypeFlags::SYNC_FD && !is_timeline)
}

/// Reports whether fences can be shared by handles of a type.
pub(crate) fn shares_fences(handle_type: vk::ExternalFenceHandleTypeFlags) -> bool {
    [vk::ExternalFenceHandleTypeFlags::OPAQUE_FD, vk::ExternalFenceHandleTypeFlags::SYNC_FD].contains(&handle_type)
}

#[doc(alias = "vkGetPhysicalDeviceExternalBufferProperties")]
pub(crate) fn get_physical_device_external_buffer_properties(
    handle_type: vk::ExternalMemoryHandleTypeFlags,
    external_buffer_properties: &mut vk::ExternalBufferProperties<'_>,
) -> Result<(), Error> {
    external_buffer_properties.external_memory_properties = memory_properties(handle_type);
    Ok(())
}

#[doc(alias = "vkGetPhysicalDeviceExternalFenceProperties")]
pub(crate) fn get_physical_device_external_fence_properties(
    handle_type: vk::ExternalFenceHandleTypeFlags,
    external_fence_properties: &mut vk::ExternalFenceProperties<'_>,
) -> Result<(), Error> {
    use vk::ExternalFenceFeatureFlags as Features;
    let properties = external_fence_properties;
    let is_shared = shares_fences(handle_type);
    properties.export_from_imported_handle_types = if is_shared { handle_type } else { Default::default() };
    properties.compatible_handle_types = if is_shared { handle_type } else { Default::default() };
    properties.external_fence_features =
        if is_shared { Features::EXPORTABLE | Features::IMPORTABLE } else { Features::empty() };
    Ok(())
}

#[doc(alias = "vkGetPhysicalDeviceExternalSemaphoreProperties")]
pub(crate) fn get_physical_device_external_semaphore_properties(
    handle_type: vk::ExternalSemaphoreHandleTypeFlags,
    kind: Option<&vk::SemaphoreTypeCreateInfo<'_>>,
    external_semaphore_properties: &mut vk::ExternalSemaphoreProperties<'_>,
) -> Result<(), Error> {
    use vk::ExternalSemaphoreFeatureFlags as Features;
    let properties = external_semaphore_properties;
    let is_timeline = kind.is_some_and(|kind| kind.semaphore_type == vk::SemaphoreType::TIMELINE);
    let is_shared = shares_semaphores(handle_type, is_timeline);
    properties.export_from_imported_handle_types = if is_shared { handle_type } else { Default::default() };
    properties.compatible_handle_types = if is_shared { handle_type } else { Default::default() };
    properties.external_semaphore_features =
        if is_shared { Features::EXPORTABLE | Features::IMPORTABLE } else { Features::empty() };
    Ok(())
}
