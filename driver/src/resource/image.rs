//! Images and image views.

use super::buffer::{self, fill_requirements};
use super::memory::Memory;
use super::ycbcr_conversion::{SamplerYcbcrConversion, chained_conversion};
use crate::abi::error::Error;
use crate::abi::handle::objects;
use crate::abi::valid::{OutputChain, Structures};
use crate::convert;
use crate::physical_device::external;
use crate::physical_device::formats::{self, ImageQuery, YcbcrFormat};
use ash::vk;
use simdevice::format::Aspect;
use simdevice::image::{ImageDesc, ImageKind, SubresourceLayout};
use simdevice::texture::{Chroma, Swizzle};
use simdevice::{Allocation, image};
use std::sync::{Arc, OnceLock};

/// An image. To the device each of its planes is an image; most images have one plane.
#[derive(Debug)]
pub(crate) struct Image {
    /// Its description; that of its first plane if it has several.
    pub(crate) desc: ImageDesc,
    /// Its format, if luma and chroma are apart.
    pub(crate) ycbcr: Option<&'static YcbcrFormat>,
    planes: Vec<Plane>,
    /// True if planes are bound to memory one by one.
    is_disjoint: bool,
    size: u64,
}

/// A plane of an image.
#[derive(Debug)]
struct Plane {
    desc: ImageDesc,
    /// The bytes from the image's beginning to the plane, unless it is bound by itself.
    offset: u64,
    size: u64,
    bound: OnceLock<Arc<image::Image>>,
}

/// A plane of an image and some of the plane's aspects.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PlaneAspects {
    /// The plane's number.
    pub(crate) plane: usize,
    /// The aspects of the device's image of this plane.
    pub(crate) aspects: Vec<Aspect>,
}

objects! {
    vk::Image => Image;
    vk::ImageView => ImageView;
}

impl Image {
    /// An image of one plane, not yet bound to memory.
    ///
    /// # Errors
    /// [`Error::OutOfDeviceMemory`] if no memory could hold it.
    pub(crate) fn new(desc: ImageDesc) -> Result<Self, Error> {
        Self::of_planes(desc, &[desc])
    }

    /// An image of planes that follow each other in memory.
    fn of_planes(desc: ImageDesc, descs: &[ImageDesc]) -> Result<Self, Error> {
        let mut end = Some(0u64);
        let mut planes = Vec::new();
        for desc in descs {
            let offset = end.and_then(|end| end.checked_next_multiple_of(image::IMAGE_ALIGNMENT));
            let size = desc.memory_size();
            end = offset.zip(size).and_then(|(offset, size)| offset.checked_add(size));
            let (Some(offset), Some(size), Some(_)) = (offset, size, end) else {
                return Err(Error::OutOfDeviceMemory(format!("{desc:?} is too large")));
            };
            planes.push(Plane { desc: *desc, offset, size, bound: OnceLock::new() });
        }
        Ok(Self { desc, ycbcr: None, planes, is_disjoint: false, size: end.unwrap_or_default() })
    }

    /// An image of a format whose luma and chroma are apart, not yet bound to memory.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if the extent has no chroma texel at an edge; [`Error::OutOfDeviceMemory`] if no memory
    /// could hold it.
    fn with_chroma(
        format: &'static YcbcrFormat,
        [width, height]: [u32; 2],
        flags: vk::ImageCreateFlags,
    ) -> Result<Self, Error> {
        let [columns, rows] = format.granularity();
        if !width.is_multiple_of(columns) {
            return Err(Error::usage(
                "VUID-VkImageCreateInfo-format-04712",
                format!("the width {width} of an image of {:?} is odd", format.format),
            ));
        }
        if !height.is_multiple_of(rows) {
            return Err(Error::usage(
                "VUID-VkImageCreateInfo-format-04713",
                format!("the height {height} of an image of {:?} is odd", format.format),
            ));
        }
        let descs: Vec<_> = format
            .planes
            .iter()
            .map(|plane| flat(plane.format, [width / plane.divisors[0], height / plane.divisors[1]]))
            .collect();
        let is_disjoint = format.is_multi_planar() && flags.contains(vk::ImageCreateFlags::DISJOINT);
        Ok(Self { ycbcr: Some(format), is_disjoint, ..Self::of_planes(descs[0], &descs)? })
    }

    /// The bytes of memory that it needs.
    pub(crate) fn size(&self) -> u64 {
        self.size
    }

    /// The memory of any type that it needs.
    fn requirements(&self) -> vk::MemoryRequirements {
        vk::MemoryRequirements { alignment: image::IMAGE_ALIGNMENT, ..buffer::requirements(self.size) }
    }

    /// The memory of any type that one of its planes needs.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] with this id if it does not have the plane.
    fn requirements_of_plane(
        &self,
        aspect: vk::ImageAspectFlags,
        vuid: &'static str,
    ) -> Result<vk::MemoryRequirements, Error> {
        let size = self.planes[self.plane_number(aspect, vuid)?].size;
        Ok(vk::MemoryRequirements { alignment: image::IMAGE_ALIGNMENT, ..buffer::requirements(size) })
    }

    /// The number of a plane by its aspect. That of an image with one plane has no aspect of its own.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] with this id if the image does not have the plane.
    fn plane_number(&self, aspect: vk::ImageAspectFlags, vuid: &'static str) -> Result<usize, Error> {
        let number = PLANES.iter().position(|&known| known == aspect);
        number
            .filter(|&number| number < self.planes.len())
            .ok_or_else(|| Error::usage(vuid, format!("the image does not have the plane {aspect:?}")))
    }

    /// The plane and its aspects that a mask names; `None` if the image does not have them all, or they are of several
    /// planes.
    pub(crate) fn aspects(&self, mask: vk::ImageAspectFlags) -> Option<PlaneAspects> {
        if self.planes.len() == 1 {
            return Some(PlaneAspects { plane: 0, aspects: convert::aspects(self.desc.format, mask)? });
        }
        let plane = PLANES[..self.planes.len()].iter().position(|&known| known == mask)?;
        Some(PlaneAspects { plane, aspects: vec![Aspect::Color] })
    }

    /// Binds it to memory from byte `offset` on, or only the plane of an aspect.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if it is bound already or does not fit, or if planes are bound together that are disjoint, or
    /// a plane by itself that is not.
    pub(crate) fn bind(
        &self,
        memory: &Arc<Allocation>,
        offset: u64,
        plane: Option<vk::ImageAspectFlags>,
    ) -> Result<(), Error> {
        let vuid = "VUID-vkBindImageMemory-memoryOffset-01048";
        if !offset.is_multiple_of(image::IMAGE_ALIGNMENT) {
            return Err(Error::usage(
                vuid,
                format!("memoryOffset {offset} is not a multiple of {}", image::IMAGE_ALIGNMENT),
            ));
        }
        let planes = match plane {
            None if self.is_disjoint => {
                return Err(Error::usage(
                    "VUID-VkBindImageMemoryInfo-image-07736",
                    "all planes of a disjoint image are bound together",
                ));
            }
            None => &self.planes[..],
            Some(_) if !self.is_disjoint && self.planes.len() > 1 => {
                return Err(Error::usage(
                    "VUID-VkBindImageMemoryInfo-pNext-01618",
                    "a plane is bound by itself, of an image that is not disjoint",
                ));
            }
            Some(aspect) => {
                let number = self.plane_number(aspect, "VUID-VkBindImagePlaneMemoryInfo-planeAspect-02283")?;
                &self.planes[number..=number]
            }
        };
        let begin = if plane.is_some() { planes[0].offset } else { 0 };
        let in_memory = |plane: &Plane| {
            // An offset that overflows is beyond any memory.
            let offset = offset.saturating_add(plane.offset - begin);
            let image = image::Image::new(plane.desc, Arc::clone(memory), offset);
            image.map(Arc::new).map_err(|error| Error::usage(vuid, error.to_string()))
        };
        let images: Vec<_> = planes.iter().map(in_memory).collect::<Result<_, _>>()?;
        for (plane, image) in planes.iter().zip(images) {
            plane
                .bound
                .set(image)
                .map_err(|_| Error::usage("VUID-vkBindImageMemory-image-07460", "the image is bound already"))?;
        }
        Ok(())
    }

    /// Marks the memory of the planes that are bound as changed.
    pub(crate) fn mark_changed(&self) {
        self.planes.iter().filter_map(|plane| plane.bound.get()).for_each(|image| image.memory.bump_generation());
    }

    /// The image, or its first plane, in its memory.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if it is not bound.
    pub(crate) fn bound(&self, vuid: &'static str) -> Result<&Arc<image::Image>, Error> {
        self.bound_plane(0, vuid)
    }

    /// A plane in its memory.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if it is not bound.
    pub(crate) fn bound_plane(&self, plane: usize, vuid: &'static str) -> Result<&Arc<image::Image>, Error> {
        self.planes
            .get(plane)
            .and_then(|plane| plane.bound.get())
            .ok_or_else(|| Error::usage(vuid, "a command or view uses an image that is not bound to memory"))
    }

    /// The columns and rows of a block, the least part that is copied: those of a compressed format, or the pair of columns
    /// that share chroma in one plane.
    pub(crate) fn block_extent(&self) -> [u32; 2] {
        match self.packed_chroma() {
            Some(_) => [2, 1],
            None => self.desc.format.block_extent(),
        }
    }

    /// A plane in its memory, with a texel for each block.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if it is not bound.
    pub(crate) fn blocks(&self, plane: usize, vuid: &'static str) -> Result<Arc<image::Image>, Error> {
        let bound = self.bound_plane(plane, vuid)?;
        match self.packed_chroma() {
            Some(format) => pairs(bound, format, vuid),
            None => Ok(Arc::clone(bound)),
        }
    }

    /// The format of pairs of columns that share chroma, if one plane has luma and chroma.
    fn packed_chroma(&self) -> Option<simdevice::Format> {
        self.ycbcr.and_then(|format| format.packed_chroma)
    }
}

/// The bytes of an image as texels of pairs of columns.
fn pairs(image: &image::Image, format: simdevice::Format, vuid: &'static str) -> Result<Arc<image::Image>, Error> {
    let [width, height, _] = image.desc.extent;
    let paired = image::Image::new(flat(format, [width / 2, height]), Arc::clone(&image.memory), image.offset);
    paired.map(Arc::new).map_err(|error| Error::usage(vuid, error.to_string()))
}

/// The aspects of planes, by number.
const PLANES: [vk::ImageAspectFlags; 3] =
    [vk::ImageAspectFlags::PLANE_0, vk::ImageAspectFlags::PLANE_1, vk::ImageAspectFlags::PLANE_2];

/// The description of a plane, which has one level, layer and sample.
fn flat(format: simdevice::Format, [width, height]: [u32; 2]) -> ImageDesc {
    ImageDesc { kind: ImageKind::D2, format, extent: [width, height, 1], mip_levels: 1, array_layers: 1, samples: 1 }
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
    /// The chroma of the image and its conversion, if the view is for sampling with a conversion.
    pub(crate) chroma: Option<Arc<Chroma>>,
}

impl ImageView {
    /// A view of `range` of a bound image's plane, read as `format`. A view of a 3D image as an array of 2D ones has its
    /// slices for layers; it is rendered to, and programs read and write what is of one slice.
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
        let plane = PLANES[..image.planes.len()].iter().position(|&known| known == range.aspect_mask).unwrap_or(0);
        let bound = image.bound_plane(plane, "VUID-VkImageViewCreateInfo-image-01020")?;
        let desc = &bound.desc;
        if format.texel_size() != desc.format.texel_size() {
            return Err(Error::usage(
                if image.planes.len() > 1 {
                    "VUID-VkImageViewCreateInfo-image-01586"
                } else {
                    "VUID-VkImageViewCreateInfo-image-01761"
                },
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
                image: Arc::clone(bound),
                format,
                base_mip_level,
                level_count,
                base_layer,
                layer_count,
            },
            aspect: convert::view_aspect(range.aspect_mask),
            swizzle: convert::swizzle(components),
            chroma: None,
        })
    }

    /// A view of all planes of a bound image, of which samplers with the same conversion read colours.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if the image is not bound, or its format is not that of the view or the conversion.
    fn with_chroma(
        image: &Image,
        format: &'static YcbcrFormat,
        info: &vk::ImageViewCreateInfo<'_>,
        conversion: Option<&SamplerYcbcrConversion>,
    ) -> Result<Self, Error> {
        if info.format != format.format {
            return Err(Error::usage(
                "VUID-VkImageViewCreateInfo-image-01762",
                format!("a view of the format {:?} of all planes of an image of {:?}", info.format, format.format),
            ));
        }
        let Some(conversion) = conversion else {
            return Err(Error::usage(
                "VUID-VkImageViewCreateInfo-format-06415",
                format!("a view of an image of {:?} has no VkSamplerYcbcrConversion", format.format),
            ));
        };
        if conversion.format != format.format {
            return Err(Error::usage(
                "VUID-VkImageViewCreateInfo-pNext-06658",
                format!("a view of an image of {:?} has a conversion of {:?}", format.format, conversion.format),
            ));
        }
        let vuid = "VUID-VkImageViewCreateInfo-image-01020";
        let luma = image.bound(vuid)?;
        let mut planes = Vec::new();
        for number in 1..image.planes.len() {
            planes.push(whole(image.bound_plane(number, vuid)?));
        }
        if let Some(chroma) = format.packed_chroma {
            planes.push(whole(&pairs(luma, chroma, vuid)?));
        }
        let chroma = Chroma { planes, components: format.components, conversion: conversion.state };
        Ok(Self {
            view: whole(luma),
            aspect: Aspect::Color,
            swizzle: conversion.swizzle,
            chroma: Some(Arc::new(chroma)),
        })
    }
}

/// A view of an image of one level and layer.
fn whole(image: &Arc<image::Image>) -> image::ImageView {
    image::ImageView {
        image: Arc::clone(image),
        format: image.desc.format,
        base_mip_level: 0,
        level_count: 1,
        base_layer: 0,
        layer_count: 1,
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
    if let Some(format) = formats::ycbcr_format(info.format) {
        return Image::with_chroma(format, [extent.width, extent.height], info.flags);
    }
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
    plane: Option<&vk::ImagePlaneMemoryRequirementsInfo<'_>>,
    memory_requirements: OutputChain<'_, vk::MemoryRequirements2<'_>>,
) -> Result<(), Error> {
    let requirements = match plane {
        Some(info) => image
            .requirements_of_plane(info.plane_aspect, "VUID-VkImagePlaneMemoryRequirementsInfo-planeAspect-02281")?,
        None => image.requirements(),
    };
    fill_requirements(memory_requirements, requirements)
}

#[doc(alias = "vkGetDeviceImageMemoryRequirements")]
pub(crate) fn get_device_image_memory_requirements(
    create_info: &vk::ImageCreateInfo<'_>,
    plane_aspect: vk::ImageAspectFlags,
    memory_requirements: OutputChain<'_, vk::MemoryRequirements2<'_>>,
) -> Result<(), Error> {
    let image = new_image(create_info, None, None)?;
    // An image that is not disjoint has no use for the member, which may be anything.
    let requirements = match image.is_disjoint {
        true => {
            image.requirements_of_plane(plane_aspect, "VUID-VkDeviceImageMemoryRequirementsKHR-pCreateInfo-06419")?
        }
        false => image.requirements(),
    };
    fill_requirements(memory_requirements, requirements)
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
    find_subresource(image, subresource).map(|(begin, found)| vulkan_layout(begin, &found))
}

#[doc(alias = "vkGetImageSubresourceLayout2KHR")]
pub(crate) fn get_image_subresource_layout2(
    image: &Image,
    subresource: &vk::ImageSubresource2KHR<'_>,
    layout: OutputChain<'_, vk::SubresourceLayout2KHR<'_>>,
) -> Result<(), Error> {
    fill_layout(image, &subresource.image_subresource, layout)
}

#[doc(alias = "vkGetDeviceImageSubresourceLayoutKHR")]
pub(crate) fn get_device_image_subresource_layout(
    create_info: &vk::ImageCreateInfo<'_>,
    subresource: &vk::ImageSubresource2KHR<'_>,
    layout: OutputChain<'_, vk::SubresourceLayout2KHR<'_>>,
) -> Result<(), Error> {
    let image = new_image(create_info, None, None)?;
    fill_layout(&image, &subresource.image_subresource, layout)
}

/// Writes the layout of a subresource, and its size in the host's memory where the chain asks for it: there its texels
/// are tightly packed.
fn fill_layout(
    image: &Image,
    subresource: &vk::ImageSubresource,
    mut layout: OutputChain<'_, vk::SubresourceLayout2KHR<'_>>,
) -> Result<(), Error> {
    let (begin, found) = find_subresource(image, subresource)?;
    layout.subresource_layout = vulkan_layout(begin, &found);
    let texels = found.extent.iter().map(|&side| vk::DeviceSize::from(side)).product::<vk::DeviceSize>();
    layout.for_each_chained(|mut structure| {
        if let Some(out) = structure.cast::<vk::SubresourceHostMemcpySizeEXT<'_>>() {
            out.size = texels * found.format.texel_size() as vk::DeviceSize;
        }
    });
    Ok(())
}

/// A subresource in an image's memory, from a byte on.
fn find_subresource(
    image: &Image,
    subresource: &vk::ImageSubresource,
) -> Result<(vk::DeviceSize, SubresourceLayout), Error> {
    let missing = || {
        Error::usage(
            "VUID-vkGetImageSubresourceLayout-mipLevel-01716",
            format!("the image does not have {subresource:?}"),
        )
    };
    let named = image.aspects(subresource.aspect_mask).ok_or_else(missing)?;
    let plane = &image.planes[named.plane];
    let (level, layer) = (subresource.mip_level, subresource.array_layer);
    let found = named.aspects.first().and_then(|&aspect| plane.desc.subresource(aspect, level, layer));
    let found = found.ok_or_else(missing)?;
    // The layout of a plane that is bound by itself counts from there.
    let begin = if image.is_disjoint { 0 } else { plane.offset };
    Ok((begin, found))
}

/// Vulkan's layout of a subresource.
fn vulkan_layout(begin: vk::DeviceSize, found: &SubresourceLayout) -> vk::SubresourceLayout {
    vk::SubresourceLayout {
        offset: begin + found.offset,
        size: found.size,
        row_pitch: found.row_pitch,
        array_pitch: found.array_pitch,
        depth_pitch: found.depth_pitch,
    }
}

#[doc(alias = "vkBindImageMemory")]
pub(crate) fn bind_image_memory(image: &Image, memory: &Memory, memory_offset: vk::DeviceSize) -> Result<(), Error> {
    image.bind(memory.allocation(), memory_offset, None)
}

/// Checks that the parts of an image, one for each instance of memory, are what a group of one device has: the memory of
/// device 0, and the whole image.
///
/// # Errors
/// [`Error::InvalidUsage`] if a device or a part isn't there, or the parts don't cover the image.
pub(crate) fn check_instances(image: &Image, devices: &[u32], regions: &[vk::Rect2D]) -> Result<(), Error> {
    if devices.len() > 1 {
        return Err(Error::usage(
            "VUID-VkBindImageMemoryDeviceGroupInfo-deviceIndexCount-01634",
            format!("there are {} device indices, and the group has one device", devices.len()),
        ));
    }
    if let Some(device) = devices.iter().find(|&&device| device != 0) {
        return Err(Error::usage(
            "VUID-VkBindImageMemoryDeviceGroupInfo-pDeviceIndices-01635",
            format!("the group has no device {device}"),
        ));
    }
    if regions.len() > 1 {
        return Err(Error::usage(
            "VUID-VkBindImageMemoryDeviceGroupInfo-splitInstanceBindRegionCount-01636",
            format!("there are {} regions, and the group has one device", regions.len()),
        ));
    }
    let [width, height, _] = image.desc.extent;
    let whole = vk::Rect2D::default().extent(vk::Extent2D { width, height });
    if let Some(region) = regions.iter().find(|&&region| region != whole) {
        return Err(Error::usage(
            "VUID-VkBindImageMemoryInfo-pNext-01629",
            format!("{region:?} is not the whole image of {width}x{height}, and there is no other device for the rest"),
        ));
    }
    Ok(())
}

/// # Safety
/// The create info's chain and its handles are valid.
#[doc(alias = "vkCreateImageView")]
pub(crate) unsafe fn create_image_view(
    create_info: &vk::ImageViewCreateInfo<'_>,
    image: &Arc<Image>,
) -> Result<Arc<ImageView>, Error> {
    let info = create_info;
    if let Some(format) = image.ycbcr
        && info.subresource_range.aspect_mask == vk::ImageAspectFlags::COLOR
    {
        // SAFETY: the caller's promise.
        let conversion = unsafe { chained_conversion(info.p_next)? };
        return ImageView::with_chroma(image, format, info, conversion.map(|found| &**found)).map(Arc::new);
    }
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
