//! The physical device's properties, features, formats, memory, queues and counters, each defined once.

pub(crate) mod counters;
pub(crate) mod external;
pub(crate) mod formats;
pub(crate) mod limits;
pub(crate) mod memory;

use self::formats::ImageQuery;
use crate::abi::error::Error;
use crate::abi::valid::{self, ChainedOutput, OutputChain, Structures};
use crate::instance::extension_properties;
use crate::options;
use crate::registry::{self, features::SUPPORTED, newer};
use ash::vk;
use std::ffi::CStr;

/// The index of the queue family that supports everything.
pub(crate) const QUEUE_FAMILY: u32 = 0;

/// The capabilities of the queues of each family: everything, all except draws, and copies.
pub(crate) const QUEUE_FAMILIES: [vk::QueueFlags; 3] = [
    vk::QueueFlags::from_raw(
        vk::QueueFlags::GRAPHICS.as_raw() | vk::QueueFlags::COMPUTE.as_raw() | vk::QueueFlags::TRANSFER.as_raw(),
    ),
    vk::QueueFlags::from_raw(vk::QueueFlags::COMPUTE.as_raw() | vk::QueueFlags::TRANSFER.as_raw()),
    vk::QueueFlags::TRANSFER,
];

/// The number of queues of each family.
pub(crate) const QUEUE_COUNT: u32 = 1;

/// The global priority of each queue: the system's default.
pub(crate) const GLOBAL_PRIORITY: vk::QueueGlobalPriorityKHR = vk::QueueGlobalPriorityKHR::MEDIUM;

/// `VkQueueFamilyProperties` of a family. Timestamps are the host's nanoseconds in 64 bits.
fn queue_family_properties(queue_flags: vk::QueueFlags) -> vk::QueueFamilyProperties {
    vk::QueueFamilyProperties {
        queue_flags,
        queue_count: QUEUE_COUNT,
        timestamp_valid_bits: 64,
        min_image_transfer_granularity: vk::Extent3D { width: 1, height: 1, depth: 1 },
    }
}

/// Answers whether such an image is supported. That it isn't is an answer and not reported as a failure, because
/// applications ask to find out.
fn image_format_answer(query: ImageQuery, out: &mut vk::ImageFormatProperties) -> Result<vk::Result, Error> {
    match formats::image_properties(query) {
        Ok(properties) => {
            *out = properties;
            Ok(vk::Result::SUCCESS)
        }
        Err(error) => {
            log::debug!("{error}");
            *out = vk::ImageFormatProperties::default();
            Ok(error.result())
        }
    }
}

/// The core properties, with the type of device that the environment asks for. A wrong value is refused when a device is
/// created.
fn core_properties() -> vk::PhysicalDeviceProperties {
    let mut properties = limits::properties().core();
    properties.device_type = options::device_type().unwrap_or(properties.device_type);
    properties
}

#[doc(alias = "vkGetPhysicalDeviceProperties")]
pub(crate) fn get_physical_device_properties() -> Result<vk::PhysicalDeviceProperties, Error> {
    Ok(core_properties())
}

#[doc(alias = "vkGetPhysicalDeviceProperties2")]
pub(crate) fn get_physical_device_properties2(
    mut properties: OutputChain<'_, vk::PhysicalDeviceProperties2<'_>>,
) -> Result<(), Error> {
    properties.properties = core_properties();
    properties.for_each_chained(|mut out| {
        write_copied_layouts(&mut out);
        limits::properties().write(out);
    });
    Ok(())
}

/// The image layouts from which and to which the host copies: all, since they don't matter to the device.
const COPIED_LAYOUTS: [vk::ImageLayout; 16] = {
    use vk::ImageLayout as L;
    [
        L::GENERAL,
        L::COLOR_ATTACHMENT_OPTIMAL,
        L::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
        L::DEPTH_STENCIL_READ_ONLY_OPTIMAL,
        L::SHADER_READ_ONLY_OPTIMAL,
        L::TRANSFER_SRC_OPTIMAL,
        L::TRANSFER_DST_OPTIMAL,
        L::DEPTH_READ_ONLY_STENCIL_ATTACHMENT_OPTIMAL,
        L::DEPTH_ATTACHMENT_STENCIL_READ_ONLY_OPTIMAL,
        L::DEPTH_ATTACHMENT_OPTIMAL,
        L::DEPTH_READ_ONLY_OPTIMAL,
        L::STENCIL_ATTACHMENT_OPTIMAL,
        L::STENCIL_READ_ONLY_OPTIMAL,
        L::READ_ONLY_OPTIMAL,
        L::ATTACHMENT_OPTIMAL,
        L::PRESENT_SRC_KHR,
    ]
};

/// Writes the lists of a structure in the chain of properties.
fn write_copied_layouts(structure: &mut ChainedOutput<'_>) {
    let write = |count: &mut u32, layouts| {
        // SAFETY: the application lends as many elements as it says, or none.
        unsafe { valid::enumerate(count, layouts, &COPIED_LAYOUTS) }
    };
    // The counts are not null, so that nothing fails; a list that is too short gets what fits.
    if let Some(out) = structure.cast::<newer::PhysicalDeviceVulkan14Properties>() {
        let _ = write(&mut out.copy_src_layout_count, out.p_copy_src_layouts);
        let _ = write(&mut out.copy_dst_layout_count, out.p_copy_dst_layouts);
    }
    if let Some(out) = structure.cast::<vk::PhysicalDeviceHostImageCopyPropertiesEXT<'_>>() {
        let _ = write(&mut out.copy_src_layout_count, out.p_copy_src_layouts);
        let _ = write(&mut out.copy_dst_layout_count, out.p_copy_dst_layouts);
    }
}

#[doc(alias = "vkGetPhysicalDeviceFeatures")]
pub(crate) fn get_physical_device_features() -> Result<vk::PhysicalDeviceFeatures, Error> {
    Ok(SUPPORTED.core())
}

#[doc(alias = "vkGetPhysicalDeviceFeatures2")]
pub(crate) fn get_physical_device_features2(
    mut features: OutputChain<'_, vk::PhysicalDeviceFeatures2<'_>>,
) -> Result<(), Error> {
    features.features = SUPPORTED.core();
    features.for_each_chained(|out| SUPPORTED.write(out));
    Ok(())
}

#[doc(alias = "vkGetPhysicalDeviceFormatProperties")]
pub(crate) fn get_physical_device_format_properties(format: vk::Format) -> Result<vk::FormatProperties, Error> {
    Ok(formats::properties(format))
}

#[doc(alias = "vkGetPhysicalDeviceFormatProperties2")]
pub(crate) fn get_physical_device_format_properties2(
    format: vk::Format,
    mut format_properties: OutputChain<'_, vk::FormatProperties2<'_>>,
) -> Result<(), Error> {
    let found = formats::properties(format);
    format_properties.format_properties = found;
    format_properties.for_each_chained(|mut structure| {
        if let Some(out) = structure.cast::<vk::SubpassResolvePerformanceQueryEXT<'_>>() {
            // Tiles are resolved before they leave the tile buffers.
            out.optimal = vk::TRUE;
        }
        if let Some(out) = structure.cast::<vk::FormatProperties3<'_>>() {
            let widen = |features| formats::features2(format, features);
            out.linear_tiling_features = widen(found.linear_tiling_features);
            out.optimal_tiling_features = widen(found.optimal_tiling_features);
            out.buffer_features = widen(found.buffer_features);
        }
    });
    Ok(())
}

#[doc(alias = "vkGetPhysicalDeviceImageFormatProperties")]
pub(crate) fn get_physical_device_image_format_properties(
    format: vk::Format,
    ty: vk::ImageType,
    tiling: vk::ImageTiling,
    usage: vk::ImageUsageFlags,
    flags: vk::ImageCreateFlags,
    image_format_properties: &mut vk::ImageFormatProperties,
) -> Result<vk::Result, Error> {
    let query = ImageQuery { format, ty, tiling, usage, flags };
    image_format_answer(query, image_format_properties)
}

/// # Safety
/// The image format info's chain is valid.
#[doc(alias = "vkGetPhysicalDeviceImageFormatProperties2")]
pub(crate) unsafe fn get_physical_device_image_format_properties2(
    image_format_info: &vk::PhysicalDeviceImageFormatInfo2<'_>,
    mut image_format_properties: OutputChain<'_, vk::ImageFormatProperties2<'_>>,
) -> Result<vk::Result, Error> {
    let info = image_format_info;
    // SAFETY: the caller's promise.
    let external = unsafe { valid::find_in_chain::<vk::PhysicalDeviceExternalImageFormatInfo<'_>>(info.p_next) };
    let handle_type = external.map_or_else(Default::default, |external| external.handle_type);
    let shared = external::memory_properties(handle_type);
    image_format_properties.for_each_chained(|mut structure| {
        if let Some(out) = structure.cast::<vk::ExternalImageFormatProperties<'_>>() {
            out.external_memory_properties = shared;
        }
    });
    if !handle_type.is_empty() && shared.external_memory_features.is_empty() {
        image_format_properties.image_format_properties = vk::ImageFormatProperties::default();
        return Ok(vk::Result::ERROR_FORMAT_NOT_SUPPORTED);
    }
    image_format_properties.for_each_chained(|mut structure| {
        if let Some(out) = structure.cast::<vk::SamplerYcbcrConversionImageFormatProperties<'_>>() {
            out.combined_image_sampler_descriptor_count = 1;
        }
        if let Some(out) = structure.cast::<vk::HostImageCopyDevicePerformanceQueryEXT<'_>>() {
            // Every image is stored in one way.
            out.optimal_device_access = vk::TRUE;
            out.identical_memory_layout = vk::TRUE;
        }
    });
    // SAFETY: the caller's promise.
    let stencil = unsafe { valid::find_in_chain::<vk::ImageStencilUsageCreateInfo>(info.p_next) };
    let query = ImageQuery {
        format: info.format,
        ty: info.ty,
        tiling: info.tiling,
        usage: info.usage | stencil.map_or_else(Default::default, |it| it.stencil_usage),
        flags: info.flags,
    };
    image_format_answer(query, &mut image_format_properties.image_format_properties)
}

#[doc(alias = "vkGetPhysicalDeviceSparseImageFormatProperties")]
pub(crate) fn get_physical_device_sparse_image_format_properties() -> Result<[vk::SparseImageFormatProperties; 0], Error>
{
    Ok([])
}

#[doc(alias = "vkGetPhysicalDeviceSparseImageFormatProperties2")]
pub(crate) fn get_physical_device_sparse_image_format_properties2(
    properties: Structures<'_, vk::SparseImageFormatProperties2<'_>>,
) -> Result<(), Error> {
    properties.fill(0, |_, _| ()).map(drop)
}

#[doc(alias = "vkGetPhysicalDeviceQueueFamilyProperties")]
pub(crate) fn get_physical_device_queue_family_properties()
-> Result<[vk::QueueFamilyProperties; QUEUE_FAMILIES.len()], Error> {
    Ok(QUEUE_FAMILIES.map(queue_family_properties))
}

#[doc(alias = "vkGetPhysicalDeviceQueueFamilyProperties2")]
pub(crate) fn get_physical_device_queue_family_properties2(
    queue_family_properties: Structures<'_, vk::QueueFamilyProperties2<'_>>,
) -> Result<(), Error> {
    let fill = |index: usize, family: &mut vk::QueueFamilyProperties2<'_>| {
        let flags = QUEUE_FAMILIES.get(index).copied().unwrap_or_default();
        family.queue_family_properties = self::queue_family_properties(flags);
        // SAFETY: the application initialised the structure, and lends its chain to this command.
        unsafe { valid::for_each_output(family.p_next, write_family) };
    };
    let count = QUEUE_FAMILIES.len();
    queue_family_properties.fill(count, fill).map(drop)
}

/// Writes what a structure in the chain of a queue family's properties asks for, which is the same for each family.
fn write_family(mut structure: ChainedOutput<'_>) {
    if let Some(out) = structure.cast::<vk::QueueFamilyGlobalPriorityPropertiesKHR<'_>>() {
        out.priority_count = 1;
        out.priorities[0] = GLOBAL_PRIORITY;
    }
}

#[doc(alias = "vkGetPhysicalDeviceMemoryProperties")]
pub(crate) fn get_physical_device_memory_properties() -> Result<vk::PhysicalDeviceMemoryProperties, Error> {
    Ok(memory::properties())
}

#[doc(alias = "vkGetPhysicalDeviceMemoryProperties2")]
pub(crate) fn get_physical_device_memory_properties2(
    mut memory_properties: OutputChain<'_, vk::PhysicalDeviceMemoryProperties2<'_>>,
) -> Result<(), Error> {
    memory_properties.memory_properties = memory::properties();
    memory_properties.for_each_chained(|mut structure| {
        if let Some(budget) = structure.cast::<vk::PhysicalDeviceMemoryBudgetPropertiesEXT<'_>>() {
            memory::write_budget(budget);
        }
    });
    Ok(())
}

#[doc(alias = "vkEnumerateDeviceExtensionProperties")]
pub(crate) fn enumerate_device_extension_properties(
    layer_name: Option<&CStr>,
) -> Result<Vec<vk::ExtensionProperties>, Error> {
    match layer_name {
        None => Ok(extension_properties(registry::extensions::DEVICE)),
        Some(layer) => Err(Error::LayerNotPresent(layer.to_string_lossy().into_owned())),
    }
}

#[doc(alias = "vkEnumerateDeviceLayerProperties")]
pub(crate) fn enumerate_device_layer_properties() -> Result<[vk::LayerProperties; 0], Error> {
    Ok([])
}

#[doc(alias = "vkGetPhysicalDeviceToolProperties")]
pub(crate) fn get_physical_device_tool_properties(
    tool_properties: Structures<'_, vk::PhysicalDeviceToolProperties<'_>>,
) -> Result<vk::Result, Error> {
    tool_properties.fill(0, |_, _| ())
}

/// # Safety
/// The arrays are null or have as many initialised structures as the count says.
#[doc(alias = "vkEnumeratePhysicalDeviceQueueFamilyPerformanceQueryCountersKHR")]
pub(crate) unsafe fn enumerate_performance_query_counters(
    queue_family_index: u32,
    counter_count: *mut u32,
    counters: *mut vk::PerformanceCounterKHR<'_>,
    counter_descriptions: *mut vk::PerformanceCounterDescriptionKHR<'_>,
) -> Result<vk::Result, Error> {
    let available = if queue_family_index == QUEUE_FAMILY { counters::COUNT } else { 0 };
    // SAFETY: the caller's promise.
    unsafe {
        if !counters.is_null() {
            let mut capacity = *valid::input(counter_count)?;
            Structures::new(&raw mut capacity, counter_descriptions)?.fill(available, counters::describe).map(drop)?;
        }
        Structures::new(counter_count, counters)?.fill(available, counters::fill)
    }
}

/// Returns one pass: every counter is always on.
#[doc(alias = "vkGetPhysicalDeviceQueueFamilyPerformanceQueryPassesKHR")]
pub(crate) fn get_performance_query_passes() -> Result<u32, Error> {
    Ok(1)
}
