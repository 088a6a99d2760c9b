//! Physical devices: what they can do. The answers are in [`capabilities`](crate::capabilities).

use crate::capabilities::formats::{self, ImageQuery};
use crate::capabilities::{counters, extensions, limits, memory, queues};
use crate::entry_points;
use crate::error::Error;
use crate::registry::{self, features::SUPPORTED};
use crate::{pnext, pointer};
use ash::vk;
use std::ffi::c_char;

entry_points! {
    #[doc(alias = "vkGetPhysicalDeviceProperties")]
    fn get_physical_device_properties(
        _physical_device: vk::PhysicalDevice,
        properties: *mut vk::PhysicalDeviceProperties,
    ) {
        pointer::output(properties, limits::properties().core())
    }

    #[doc(alias = "vkGetPhysicalDeviceProperties2")]
    fn get_physical_device_properties2(
        _physical_device: vk::PhysicalDevice,
        properties: *mut vk::PhysicalDeviceProperties2<'_>,
    ) {
        let properties = pointer::output_structure(properties)?;
        properties.properties = limits::properties().core();
        pnext::for_each_output(properties.p_next, |out| limits::properties().write(out));
        Ok(())
    }

    #[doc(alias = "vkGetPhysicalDeviceFeatures")]
    fn get_physical_device_features(
        _physical_device: vk::PhysicalDevice,
        features: *mut vk::PhysicalDeviceFeatures,
    ) {
        pointer::output(features, SUPPORTED.core())
    }

    #[doc(alias = "vkGetPhysicalDeviceFeatures2")]
    fn get_physical_device_features2(
        _physical_device: vk::PhysicalDevice,
        features: *mut vk::PhysicalDeviceFeatures2<'_>,
    ) {
        let features = pointer::output_structure(features)?;
        features.features = SUPPORTED.core();
        pnext::for_each_output(features.p_next, |out| SUPPORTED.write(out));
        Ok(())
    }

    #[doc(alias = "vkGetPhysicalDeviceFormatProperties")]
    fn get_physical_device_format_properties(
        _physical_device: vk::PhysicalDevice,
        format: vk::Format,
        properties: *mut vk::FormatProperties,
    ) {
        pointer::output(properties, formats::properties(format))
    }

    #[doc(alias = "vkGetPhysicalDeviceFormatProperties2")]
    fn get_physical_device_format_properties2(
        _physical_device: vk::PhysicalDevice,
        format: vk::Format,
        properties: *mut vk::FormatProperties2<'_>,
    ) {
        let properties = pointer::output_structure(properties)?;
        let found = formats::properties(format);
        properties.format_properties = found;
        pnext::for_each_output(properties.p_next, |mut structure| {
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
    fn get_physical_device_image_format_properties(
        _physical_device: vk::PhysicalDevice,
        format: vk::Format,
        ty: vk::ImageType,
        tiling: vk::ImageTiling,
        usage: vk::ImageUsageFlags,
        flags: vk::ImageCreateFlags,
        properties: *mut vk::ImageFormatProperties,
    ) -> vk::Result {
        let query = ImageQuery { format, ty, tiling, usage, flags };
        image_format_answer(query, pointer::output_structure(properties)?)
    }

    #[doc(alias = "vkGetPhysicalDeviceImageFormatProperties2")]
    fn get_physical_device_image_format_properties2(
        _physical_device: vk::PhysicalDevice,
        info: *const vk::PhysicalDeviceImageFormatInfo2<'_>,
        properties: *mut vk::ImageFormatProperties2<'_>,
    ) -> vk::Result {
        let info = pointer::input(info)?;
        let properties = pointer::output_structure(properties)?;
        let external = pnext::find::<vk::PhysicalDeviceExternalImageFormatInfo<'_>>(info.p_next);
        if external.is_some_and(|external| !external.handle_type.is_empty()) {
            properties.image_format_properties = vk::ImageFormatProperties::default();
            return Ok(vk::Result::ERROR_FORMAT_NOT_SUPPORTED);
        }
        pnext::for_each_output(properties.p_next, |mut structure| {
            if let Some(out) = structure.cast::<vk::ExternalImageFormatProperties<'_>>() {
                out.external_memory_properties = vk::ExternalMemoryProperties::default();
            }
        });
        let query = ImageQuery {
            format: info.format,
            ty: info.ty,
            tiling: info.tiling,
            usage: info.usage,
            flags: info.flags,
        };
        image_format_answer(query, &mut properties.image_format_properties)
    }

    #[doc(alias = "vkGetPhysicalDeviceSparseImageFormatProperties")]
    fn get_physical_device_sparse_image_format_properties(
        _physical_device: vk::PhysicalDevice,
        _format: vk::Format,
        _ty: vk::ImageType,
        _samples: vk::SampleCountFlags,
        _usage: vk::ImageUsageFlags,
        _tiling: vk::ImageTiling,
        count: *mut u32,
        properties: *mut vk::SparseImageFormatProperties,
    ) {
        pointer::enumerate(count, properties, &[]).map(drop)
    }

    #[doc(alias = "vkGetPhysicalDeviceSparseImageFormatProperties2")]
    fn get_physical_device_sparse_image_format_properties2(
        _physical_device: vk::PhysicalDevice,
        _info: *const vk::PhysicalDeviceSparseImageFormatInfo2<'_>,
        count: *mut u32,
        properties: *mut vk::SparseImageFormatProperties2<'_>,
    ) {
        pointer::enumerate_structures(count, properties, 0, |_, _| ()).map(drop)
    }

    #[doc(alias = "vkGetPhysicalDeviceQueueFamilyProperties")]
    fn get_physical_device_queue_family_properties(
        _physical_device: vk::PhysicalDevice,
        count: *mut u32,
        properties: *mut vk::QueueFamilyProperties,
    ) {
        pointer::enumerate(count, properties, &[queues::properties()]).map(drop)
    }

    #[doc(alias = "vkGetPhysicalDeviceQueueFamilyProperties2")]
    fn get_physical_device_queue_family_properties2(
        _physical_device: vk::PhysicalDevice,
        count: *mut u32,
        properties: *mut vk::QueueFamilyProperties2<'_>,
    ) {
        pointer::enumerate_structures(count, properties, 1, |_, family| {
            family.queue_family_properties = queues::properties();
        })
        .map(drop)
    }

    #[doc(alias = "vkGetPhysicalDeviceMemoryProperties")]
    fn get_physical_device_memory_properties(
        _physical_device: vk::PhysicalDevice,
        properties: *mut vk::PhysicalDeviceMemoryProperties,
    ) {
        pointer::output(properties, memory::properties())
    }

    #[doc(alias = "vkGetPhysicalDeviceMemoryProperties2")]
    fn get_physical_device_memory_properties2(
        _physical_device: vk::PhysicalDevice,
        properties: *mut vk::PhysicalDeviceMemoryProperties2<'_>,
    ) {
        pointer::output_structure(properties)?.memory_properties = memory::properties();
        Ok(())
    }

    #[doc(alias = "vkEnumerateDeviceExtensionProperties")]
    fn enumerate_device_extension_properties(
        _physical_device: vk::PhysicalDevice,
        layer: *const c_char,
        count: *mut u32,
        properties: *mut vk::ExtensionProperties,
    ) -> vk::Result {
        match pointer::string(layer) {
            None => pointer::enumerate(count, properties, &extensions::properties(registry::extensions::DEVICE)),
            Some(layer) => Err(Error::LayerNotPresent(layer.to_string_lossy().into_owned())),
        }
    }

    #[doc(alias = "vkEnumerateDeviceLayerProperties")]
    fn enumerate_device_layer_properties(
        _physical_device: vk::PhysicalDevice,
        count: *mut u32,
        properties: *mut vk::LayerProperties,
    ) -> vk::Result {
        pointer::enumerate(count, properties, &[])
    }

    #[doc(alias = "vkGetPhysicalDeviceExternalBufferProperties")]
    fn get_physical_device_external_buffer_properties(
        _physical_device: vk::PhysicalDevice,
        _info: *const vk::PhysicalDeviceExternalBufferInfo<'_>,
        properties: *mut vk::ExternalBufferProperties<'_>,
    ) {
        pointer::output_structure(properties)?.external_memory_properties = vk::ExternalMemoryProperties::default();
        Ok(())
    }

    #[doc(alias = "vkGetPhysicalDeviceExternalFenceProperties")]
    fn get_physical_device_external_fence_properties(
        _physical_device: vk::PhysicalDevice,
        _info: *const vk::PhysicalDeviceExternalFenceInfo<'_>,
        properties: *mut vk::ExternalFenceProperties<'_>,
    ) {
        let properties = pointer::output_structure(properties)?;
        properties.export_from_imported_handle_types = vk::ExternalFenceHandleTypeFlags::empty();
        properties.compatible_handle_types = vk::ExternalFenceHandleTypeFlags::empty();
        properties.external_fence_features = vk::ExternalFenceFeatureFlags::empty();
        Ok(())
    }

    #[doc(alias = "vkGetPhysicalDeviceExternalSemaphoreProperties")]
    fn get_physical_device_external_semaphore_properties(
        _physical_device: vk::PhysicalDevice,
        _info: *const vk::PhysicalDeviceExternalSemaphoreInfo<'_>,
        properties: *mut vk::ExternalSemaphoreProperties<'_>,
    ) {
        let properties = pointer::output_structure(properties)?;
        properties.export_from_imported_handle_types = vk::ExternalSemaphoreHandleTypeFlags::empty();
        properties.compatible_handle_types = vk::ExternalSemaphoreHandleTypeFlags::empty();
        properties.external_semaphore_features = vk::ExternalSemaphoreFeatureFlags::empty();
        Ok(())
    }

    #[doc(alias = "vkGetPhysicalDeviceToolProperties")]
    fn get_physical_device_tool_properties(
        _physical_device: vk::PhysicalDevice,
        count: *mut u32,
        properties: *mut vk::PhysicalDeviceToolProperties<'_>,
    ) -> vk::Result {
        pointer::enumerate_structures(count, properties, 0, |_, _| ())
    }

    #[doc(alias = "vkEnumeratePhysicalDeviceQueueFamilyPerformanceQueryCountersKHR")]
    fn enumerate_physical_device_queue_family_performance_query_counters_khr(
        _physical_device: vk::PhysicalDevice,
        family: u32,
        count: *mut u32,
        counters: *mut vk::PerformanceCounterKHR<'_>,
        descriptions: *mut vk::PerformanceCounterDescriptionKHR<'_>,
    ) -> vk::Result {
        let available = if family == queues::FAMILY { counters::COUNT } else { 0 };
        if !counters.is_null() {
            let mut room = *pointer::input(count)?;
            pointer::enumerate_structures(&raw mut room, descriptions, available, counters::describe).map(drop)?;
        }
        pointer::enumerate_structures(count, counters, available, counters::fill)
    }

    #[doc(alias = "vkGetPhysicalDeviceQueueFamilyPerformanceQueryPassesKHR")]
    fn get_physical_device_queue_family_performance_query_passes_khr(
        _physical_device: vk::PhysicalDevice,
        _info: *const vk::QueryPoolPerformanceCreateInfoKHR<'_>,
        passes: *mut u32,
    ) {
        // Every counter is always on.
        pointer::output(passes, 1)
    }
}

/// Answers whether there can be such an image. That there can't is an answer and no failure: applications ask to
/// find out.
fn image_format_answer(
    query: ImageQuery,
    out: &mut vk::ImageFormatProperties,
) -> Result<vk::Result, Error> {
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
