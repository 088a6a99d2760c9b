//! Images and image views.

use super::buffer::{self, fill_requirements};
use super::memory::Memory;
use crate::abi::error::Error;
use crate::abi::handle::objects;
use crate::abi::valid::{OutputChain, Structures};
use crate::convert;
use crate::physical_device::external;
use crate::physical_device::formats::{self, ImageQuery};
use ash::vk;
use simdevice::format::Aspect;
use simdevice::image::{ImageDesc, ImageKind};
use simdevice::texture::Swizzle;
use simdevice::{Allocation, image};
use std::sync::{Arc, OnceLock};

/// An image.
#[derive(Debug)]
pub(crate) struct Image {
    /// Its description.
    pub(crate) desc: ImageDesc,
    size: u64,
    bound: OnceLock<Arc<image::Image>>,
}

objects! {
    vk::Image => Image;
    vk::ImageView => ImageView;
}

impl Image {
    /// An image, not yet bound to memory.
    ///
    /// # Errors
    /// [`Error::OutOfDeviceMemory`] if no memory could hold it.
    pub(crate) fn new(desc: ImageDesc) -> Result<Self, Error> {
        let size = desc.memory_size().ok_or_else(|| Error::OutOfDeviceMemory(format!("{desc:?} is too large")))?;
        Ok(Self { desc, size, bound: OnceLock::new() })
    }

    /// The bytes of memory that it needs.
    pub(crate) fn size(&self) -> u64 {
        self.size
    }

    /// The memory that it needs, of any type.
    fn requirements(&self) -> vk::MemoryRequirements {
        vk::MemoryRequirements { alignment: image::IMAGE_ALIGNMENT, ..buffer::requirements(self.size) }
    }

    /// Binds it to memory from byte `offset` on.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if it is bound already or does not fit.
    pub(crate) fn bind(&self, memory: Arc<Allocation>, offset: u64) -> Result<(), Error> {
        let vuid = "VUID-vkBindImageMemory-memoryOffset-01048";
        if !offset.is_multiple_of(image::IMAGE_ALIGNMENT) {
            return Err(Error::usage(
                vuid,
                format!("memoryOffset {offset} is not a multiple of {}", image::IMAGE_ALIGNMENT),
            ));
        }
        let bound =
            image::Image::new(self.desc, memory, offset).map_err(|error| Error::usage(vuid, error.to_string()))?;
        self.bound
            .set(Arc::new(bound))
            .map_err(|_| Error::usage("VUID-vkBindImageMemory-image-07460", "the image is bound already"))
    }

    /// The image in its memory.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if it is not bound.
    pub(crate) fn bound(&self, vuid: &'static str) -> Result<&Arc<image::Image>, Error> {
        self.bound
            .get()
            .ok_or_else(|| Error::usage(vuid, "a command or view uses an image that is not bound to memory"))
    }
}

/// An image view.
#[derive(Debug)]
pub(crate) struct ImageView {
    /// The device's image view.
    pub(crate) view: image::ImageView,
    /// The aspect that shaders read.
    pub(crate) aspect: Aspect,
    /// The component mapping for shaders.
    pub(crate) swizzle: Swizzle,
}

impl ImageView {
    /// A view of `range` of a bound image, read as `format`. A view of a 3D image as an array of 2D ones has its slices
    /// for layers; it is rendered to, and programs read and write what is of one slice.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if the image is not bound or does not have the range, or the formats are not compatible.
    pub(crate) fn new(
        image: &Image,
        view_type: vk::ImageViewType,
        view_format: vk::Format,
        format: simdevice::Format,
        components: vk::ComponentMapping,
        range: &vk::ImageSubresourceRange,
    ) -> Result<Self, Error> {
        let desc = &image.desc;
        if format.texel_size() != desc.format.texel_size() {
            return Err(Error::usage(
                "VUID-VkImageViewCreateInfo-image-01761",
                format!("{view_format:?} is not compatible with the image's format"),
            ));
        }
        let base_mip_level = range.base_mip_level;
        let level_count = count(base_mip_level, range.level_count, vk::REMAINING_MIP_LEVELS, desc.mip_levels);
        let base_layer = range.base_array_layer;
        let are_slices = desc.kind == ImageKind::D3 && view_type != vk::ImageViewType::TYPE_3D;
        let layer_count = count(
            base_layer,
            range.layer_count,
            vk::REMAINING_ARRAY_LAYERS,
            if are_slices { desc.mip_extent(base_mip_level)[2] } else { desc.array_layers },
        );
        let (Some(level_count), Some(layer_count)) = (level_count, layer_count) else {
            return Err(Error::usage(
                "VUID-VkImageViewCreateInfo-subresourceRange-01478",
                format!("the image does not have {range:?}"),
            ));
        };
        Ok(Self {
            view: image::ImageView {
                image: Arc::clone(image.bound("VUID-VkImageViewCreateInfo-image-01020")?),
                format,
                base_mip_level,
                level_count,
                base_layer,
                layer_count,
            },
            aspect: convert::view_aspect(range.aspect_mask),
            swizzle: convert::swizzle(components),
        })
    }
}

/// The number of elements in a range from `base` on, out of `available`. None if it is zero or one doesn't exist.
pub(crate) fn count(base: u32, count: u32, remaining: u32, available: u32) -> Option<u32> {
    let rest = available.checked_sub(base)?;
    let count = if count == remaining { rest } else { count };
    (1..=rest).contains(&count).then_some(count)
}

fn unsupported_format(format: vk::Format) -> Error {
    Error::FormatNotSupported(format!("{format:?} is not supported for images"))
}

/// The image of a create info, not yet bound to memory.
///
/// # Errors
/// [`Error::FormatNotSupported`] or [`Error::InvalidUsage`] if such an image is not supported.
pub(crate) fn new_image(
    info: &vk::ImageCreateInfo<'_>,
    shared: Option<&vk::ExternalMemoryImageCreateInfo<'_>>,
    stencil: Option<&vk::ImageStencilUsageCreateInfo<'_>>,
) -> Result<Image, Error> {
    if let Some(shared) = shared {
        external::check_memory_types(shared.handle_types, "VUID-VkImageCreateInfo-pNext-00990")?;
    }
    let supported = formats::image_properties(ImageQuery {
        format: info.format,
        ty: info.image_type,
        tiling: info.tiling,
        // The stencil aspect may have another usage than depth.
        usage: info.usage | stencil.map_or_else(Default::default, |it| it.stencil_usage),
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
    let format = formats::device_format(info.format).ok_or_else(|| unsupported_format(info.format))?;
    Image::new(ImageDesc {
        kind,
        format,
        extent: [extent.width, extent.height, extent.depth],
        mip_levels: info.mip_levels,
        array_layers: info.array_layers,
        samples: info.samples.as_raw(),
    })
}

#[doc(alias = "vkCreateImage")]
pub(crate) fn create_image(
    create_info: &vk::ImageCreateInfo<'_>,
    shared: Option<&vk::ExternalMemoryImageCreateInfo<'_>>,
    stencil: Option<&vk::ImageStencilUsageCreateInfo<'_>>,
) -> Result<Arc<Image>, Error> {
    new_image(create_info, shared, stencil).map(Arc::new)
}

#[doc(alias = "vkGetImageMemoryRequirements")]
pub(crate) fn get_image_memory_requirements(image: &Image) -> Result<vk::MemoryRequirements, Error> {
    Ok(image.requirements())
}

#[doc(alias = "vkGetImageMemoryRequirements2")]
pub(crate) fn get_image_memory_requirements2(
    image: &Image,
    memory_requirements: OutputChain<'_, vk::MemoryRequirements2<'_>>,
) -> Result<(), Error> {
    fill_requirements(memory_requirements, image.requirements())
}

#[doc(alias = "vkGetDeviceImageMemoryRequirements")]
pub(crate) fn get_device_image_memory_requirements(
    create_info: &vk::ImageCreateInfo<'_>,
    memory_requirements: OutputChain<'_, vk::MemoryRequirements2<'_>>,
) -> Result<(), Error> {
    let image = new_image(create_info, None, None)?;
    fill_requirements(memory_requirements, image.requirements())
}

/// Returns nothing: no image is sparse.
#[doc(alias = "vkGetImageSparseMemoryRequirements")]
pub(crate) fn get_image_sparse_memory_requirements() -> Result<[vk::SparseImageMemoryRequirements; 0], Error> {
    Ok([])
}

/// Returns nothing: no image is sparse.
#[doc(alias = "vkGetImageSparseMemoryRequirements2")]
#[doc(alias = "vkGetDeviceImageSparseMemoryRequirements")]
pub(crate) fn get_image_sparse_memory_requirements2(
    sparse_memory_requirements: Structures<'_, vk::SparseImageMemoryRequirements2<'_>>,
) -> Result<(), Error> {
    sparse_memory_requirements.fill(0, |_, _| ()).map(drop)
}

#[doc(alias = "vkGetImageSubresourceLayout")]
pub(crate) fn get_image_subresource_layout(
    image: &Image,
    subresource: &vk::ImageSubresource,
) -> Result<vk::SubresourceLayout, Error> {
    let missing = || {
        Error::usage(
            "VUID-vkGetImageSubresourceLayout-mipLevel-01716",
            format!("the image does not have {subresource:?}"),
        )
    };
    let aspects = convert::aspects(image.desc.format, subresource.aspect_mask);
    let aspect = aspects.and_then(|aspects| aspects.first().copied());
    let (level, layer) = (subresource.mip_level, subresource.array_layer);
    let found = aspect.and_then(|aspect| image.desc.subresource(aspect, level, layer));
    let found = found.ok_or_else(missing)?;
    Ok(vk::SubresourceLayout {
        offset: found.offset,
        size: found.size,
        row_pitch: found.row_pitch,
        array_pitch: found.array_pitch,
        depth_pitch: found.depth_pitch,
    })
}

#[doc(alias = "vkBindImageMemory")]
pub(crate) fn bind_image_memory(image: &Image, memory: &Memory, memory_offset: vk::DeviceSize) -> Result<(), Error> {
    image.bind(Arc::clone(memory.allocation()), memory_offset)
}

#[doc(alias = "vkCreateImageView")]
pub(crate) fn create_image_view(
    create_info: &vk::ImageViewCreateInfo<'_>,
    image: &Arc<Image>,
) -> Result<Arc<ImageView>, Error> {
    let info = create_info;
    let format = formats::device_format(info.format).ok_or_else(|| unsupported_format(info.format))?;
    let view = ImageView::new(image, info.view_type, info.format, format, info.components, &info.subresource_range)?;
    Ok(Arc::new(view))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_lie_inside_what_is_there() {
        assert_eq!(count(2, 3, u32::MAX, 5), Some(3));
        assert_eq!(count(2, 4, u32::MAX, 5), None);
        assert_eq!(count(2, u32::MAX, u32::MAX, 5), Some(3));
        assert_eq!(count(5, u32::MAX, u32::MAX, 5), None);
        assert_eq!(count(6, 0, u32::MAX, 5), None);
    }
}
