//! Images and their views.

use super::buffer::fill_requirements;
use crate::capabilities::formats::{self, ImageQuery};
use crate::capabilities::memory::ALL_TYPE_BITS;
use crate::error::Error;
use crate::lower::transfer;
use crate::object::image::{Image, ImageView};
use crate::{handle, pnext, pointer};
use ash::vk;
use simdevice::image::{ImageDesc, ImageKind};
use std::sync::Arc;

crate::entry_points! {
    #[doc(alias = "vkCreateImage")]
    fn create_image(
        _device: vk::Device,
        create_info: *const vk::ImageCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        image: *mut vk::Image,
    ) -> vk::Result {
        let object = new_image(pointer::input(create_info)?)?;
        pointer::output(image, handle::create(Arc::new(object)))
    }

    #[doc(alias = "vkGetImageMemoryRequirements")]
    fn get_image_memory_requirements(
        _device: vk::Device,
        image: vk::Image,
        memory_requirements: *mut vk::MemoryRequirements,
    ) {
        let requirements = handle::get(image)?.requirements(ALL_TYPE_BITS);
        pointer::output(memory_requirements, requirements)
    }

    #[doc(alias = "vkGetImageMemoryRequirements2")]
    fn get_image_memory_requirements2(
        _device: vk::Device,
        info: *const vk::ImageMemoryRequirementsInfo2<'_>,
        memory_requirements: *mut vk::MemoryRequirements2<'_>,
    ) {
        let image = handle::get(pointer::input(info)?.image)?;
        fill_requirements(memory_requirements, image.requirements(ALL_TYPE_BITS))
    }

    #[doc(alias = "vkGetDeviceImageMemoryRequirements")]
    fn get_device_image_memory_requirements(
        _device: vk::Device,
        info: *const vk::DeviceImageMemoryRequirements<'_>,
        memory_requirements: *mut vk::MemoryRequirements2<'_>,
    ) {
        let create_info = pointer::input(pointer::input(info)?.p_create_info)?;
        let image = new_image(create_info)?;
        fill_requirements(memory_requirements, image.requirements(ALL_TYPE_BITS))
    }

    /// No image is sparse.
    #[doc(alias = "vkGetImageSparseMemoryRequirements")]
    fn get_image_sparse_memory_requirements(
        _device: vk::Device,
        _image: vk::Image,
        sparse_memory_requirement_count: *mut u32,
        _sparse_memory_requirements: *mut vk::SparseImageMemoryRequirements,
    ) {
        pointer::output(sparse_memory_requirement_count, 0)
    }

    /// No image is sparse.
    #[doc(alias = "vkGetImageSparseMemoryRequirements2")]
    fn get_image_sparse_memory_requirements2(
        _device: vk::Device,
        _info: *const vk::ImageSparseMemoryRequirementsInfo2<'_>,
        sparse_memory_requirement_count: *mut u32,
        _sparse_memory_requirements: *mut vk::SparseImageMemoryRequirements2<'_>,
    ) {
        pointer::output(sparse_memory_requirement_count, 0)
    }

    /// No image is sparse.
    #[doc(alias = "vkGetDeviceImageSparseMemoryRequirements")]
    fn get_device_image_sparse_memory_requirements(
        _device: vk::Device,
        _info: *const vk::DeviceImageMemoryRequirements<'_>,
        sparse_memory_requirement_count: *mut u32,
        _sparse_memory_requirements: *mut vk::SparseImageMemoryRequirements2<'_>,
    ) {
        pointer::output(sparse_memory_requirement_count, 0)
    }

    #[doc(alias = "vkGetImageSubresourceLayout")]
    fn get_image_subresource_layout(
        _device: vk::Device,
        image: vk::Image,
        subresource: *const vk::ImageSubresource,
        layout: *mut vk::SubresourceLayout,
    ) {
        let image = handle::get(image)?;
        let subresource = pointer::input(subresource)?;
        let aspects = transfer::aspects(image, subresource.aspect_mask)?;
        let found = aspects.first().and_then(|&aspect| {
            image.desc.subresource(aspect, subresource.mip_level, subresource.array_layer)
        });
        let Some(found) = found else {
            return Err(Error::usage(
                "VUID-vkGetImageSubresourceLayout-mipLevel-01716",
                format!("the image does not have {subresource:?}"),
            ));
        };
        pointer::output(layout, vk::SubresourceLayout {
            offset: found.offset,
            size: found.size,
            row_pitch: found.row_pitch,
            array_pitch: found.array_pitch,
            depth_pitch: found.depth_pitch,
        })
    }

    #[doc(alias = "vkCreateImageView")]
    fn create_image_view(
        _device: vk::Device,
        create_info: *const vk::ImageViewCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        view: *mut vk::ImageView,
    ) -> vk::Result {
        let info = pointer::input(create_info)?;
        let image = handle::get(info.image)?;
        let Some(format) = formats::device_format(info.format) else {
            return Err(unsupported_format(info.format));
        };
        let object = ImageView::new(
            image,
            info.view_type,
            info.format,
            format,
            info.components,
            &info.subresource_range,
        )?;
        pointer::output(view, handle::create(Arc::new(object)))
    }
}

fn unsupported_format(format: vk::Format) -> Error {
    Error::FormatNotSupported(format!("{format:?} is not supported for images"))
}

/// The image that a create info asks for.
///
/// # Safety
/// The create info's chain is valid.
unsafe fn new_image(info: &vk::ImageCreateInfo<'_>) -> Result<Image, Error> {
    // SAFETY: the caller's promise.
    let external = unsafe { pnext::find::<vk::ExternalMemoryImageCreateInfo>(info.p_next) };
    if external.is_some_and(|external| !external.handle_types.is_empty()) {
        return Err(Error::FeatureNotPresent("external memory".into()));
    }
    let supported = formats::image_properties(ImageQuery {
        format: info.format,
        ty: info.image_type,
        tiling: info.tiling,
        usage: info.usage,
        flags: info.flags,
    })?;
    let (extent, max) = (info.extent, supported.max_extent);
    if extent.width > max.width
        || extent.height > max.height
        || extent.depth > max.depth
        || info.mip_levels > supported.max_mip_levels
        || info.array_layers > supported.max_array_layers
        || !supported.sample_counts.contains(info.samples)
        || info.samples.is_empty()
    {
        return Err(Error::usage(
            "VUID-VkImageCreateInfo-extent-02252",
            format!(
                "an image of {extent:?} with {} levels, {} layers and samples {:?} is beyond what its format \
                 supports, {supported:?}",
                info.mip_levels, info.array_layers, info.samples
            ),
        ));
    }
    let kind = match info.image_type {
        vk::ImageType::TYPE_1D => ImageKind::D1,
        vk::ImageType::TYPE_2D => ImageKind::D2,
        vk::ImageType::TYPE_3D => ImageKind::D3,
        other => {
            return Err(Error::usage(
                "VUID-VkImageCreateInfo-imageType-parameter",
                format!("{other:?} is not a VkImageType"),
            ));
        }
    };
    let format =
        formats::device_format(info.format).ok_or_else(|| unsupported_format(info.format))?;
    Image::new(ImageDesc {
        kind,
        format,
        extent: [extent.width, extent.height, extent.depth],
        mip_levels: info.mip_levels,
        array_layers: info.array_layers,
        samples: info.samples.as_raw(),
    })
}
