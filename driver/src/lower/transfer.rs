//! Lowers copies and clears. Regions are converted as they are; the device refuses what lies outside an image.

use super::rendering;
use crate::error::Error;
use crate::object::buffer::Buffer;
use crate::object::image::{Image, count};
use ash::vk;
use simdevice::Packet;
use simdevice::packet::{
    Aspect, BufferCopyRegion, BufferImageRegion, BufferRange, ClearImage, ClearValue, CopyBuffer,
    CopyBufferImage, CopyImage, ImageCopyRegion, SubresourceLayers, SubresourceRange,
};
use std::sync::Arc;

/// `vkCmdCopyBuffer`.
///
/// # Errors
/// [`Error::Usage`] if a buffer is not bound or a region lies outside.
pub(crate) fn copy_buffer(
    source: &Buffer,
    target: &Buffer,
    regions: &[vk::BufferCopy2],
) -> Result<Packet, Error> {
    for region in regions {
        source.range(region.src_offset, Some(region.size))?;
        target.range(region.dst_offset, Some(region.size))?;
    }
    Ok(Packet::CopyBuffer(CopyBuffer {
        source: source.whole()?,
        target: target.whole()?,
        regions: regions
            .iter()
            .map(|region| BufferCopyRegion {
                source_offset: region.src_offset,
                target_offset: region.dst_offset,
                size: region.size,
            })
            .collect(),
    }))
}

/// The body of `vkCmdCopyBufferToImage` and `vkCmdCopyImageToBuffer`.
///
/// # Errors
/// [`Error::Usage`] if the buffer or image is not bound or the image has no such subresource.
pub(crate) fn copy_buffer_image(
    buffer: &Buffer,
    image: &Image,
    regions: &[vk::BufferImageCopy2],
) -> Result<CopyBufferImage, Error> {
    let region = |region: &vk::BufferImageCopy2| {
        Ok(BufferImageRegion {
            buffer_offset: region.buffer_offset,
            buffer_row_length: region.buffer_row_length,
            buffer_image_height: region.buffer_image_height,
            subresource: layers(image, &region.image_subresource)?,
            image_offset: offset(region.image_offset),
            image_extent: extent(region.image_extent),
        })
    };
    Ok(CopyBufferImage {
        buffer: buffer.whole()?,
        image: Arc::clone(image.bound()?),
        regions: regions.iter().map(region).collect::<Result<_, Error>>()?,
    })
}

/// `vkCmdCopyImage`.
///
/// # Errors
/// [`Error::Usage`] if an image is not bound or has no such subresource.
pub(crate) fn copy_image(
    source: &Image,
    target: &Image,
    regions: &[vk::ImageCopy2],
) -> Result<Packet, Error> {
    let region = |region: &vk::ImageCopy2| {
        Ok(ImageCopyRegion {
            source: layers(source, &region.src_subresource)?,
            source_offset: offset(region.src_offset),
            target: layers(target, &region.dst_subresource)?,
            target_offset: offset(region.dst_offset),
            extent: extent(region.extent),
        })
    };
    Ok(Packet::CopyImage(CopyImage {
        source: Arc::clone(source.bound()?),
        target: Arc::clone(target.bound()?),
        regions: regions.iter().map(region).collect::<Result<_, Error>>()?,
    }))
}

/// `vkCmdFillBuffer`; without a size the range ends at the last whole word.
///
/// # Errors
/// [`Error::Usage`] if the buffer is not bound or the range is outside or not of whole words.
pub(crate) fn fill_buffer(
    target: &Buffer,
    offset: u64,
    size: Option<u64>,
    word: u32,
) -> Result<Packet, Error> {
    let range = target.range(offset, size)?;
    let whole_words = BufferRange {
        size: range.size / 4 * 4,
        ..range
    };
    if !offset.is_multiple_of(4) || size.is_some_and(|size| !size.is_multiple_of(4)) {
        return Err(Error::usage(
            "VUID-vkCmdFillBuffer-dstOffset-00025",
            format!("offset {offset} and size {size:?} are not multiples of 4"),
        ));
    }
    Ok(Packet::FillBuffer {
        target: whole_words,
        word,
    })
}

/// `vkCmdUpdateBuffer`.
///
/// # Errors
/// [`Error::Usage`] if the buffer is not bound or the range is outside.
pub(crate) fn update_buffer(target: &Buffer, offset: u64, data: &[u8]) -> Result<Packet, Error> {
    Ok(Packet::UpdateBuffer {
        target: target.range(offset, Some(data.len() as u64))?,
        data: data.into(),
    })
}

/// `vkCmdClearColorImage`.
///
/// # Errors
/// [`Error::Usage`] if the image is not bound or has no such subresource.
pub(crate) fn clear_color_image(
    image: &Image,
    value: vk::ClearColorValue,
    ranges: &[vk::ImageSubresourceRange],
) -> Result<Packet, Error> {
    clear_image(
        image,
        rendering::clear_color(image.desc.format, value),
        ranges,
    )
}

/// `vkCmdClearDepthStencilImage`.
///
/// # Errors
/// [`Error::Usage`] if the image is not bound or has no such subresource.
pub(crate) fn clear_depth_stencil_image(
    image: &Image,
    value: vk::ClearDepthStencilValue,
    ranges: &[vk::ImageSubresourceRange],
) -> Result<Packet, Error> {
    clear_image(image, rendering::clear_depth_stencil(value), ranges)
}

fn clear_image(
    image: &Image,
    value: ClearValue,
    ranges: &[vk::ImageSubresourceRange],
) -> Result<Packet, Error> {
    let mut lowered = Vec::with_capacity(ranges.len());
    for range in ranges {
        for aspect in aspects(image, range.aspect_mask)? {
            lowered.push(subresource_range(image, aspect, range)?);
        }
    }
    Ok(Packet::ClearImage(ClearImage {
        image: Arc::clone(image.bound()?),
        value,
        ranges: lowered,
    }))
}

fn subresource_range(
    image: &Image,
    aspect: Aspect,
    range: &vk::ImageSubresourceRange,
) -> Result<SubresourceRange, Error> {
    let desc = &image.desc;
    let levels = count(
        range.base_mip_level,
        range.level_count,
        vk::REMAINING_MIP_LEVELS,
        desc.mip_levels,
    );
    let layers = count(
        range.base_array_layer,
        range.layer_count,
        vk::REMAINING_ARRAY_LAYERS,
        desc.array_layers,
    );
    match (levels, layers) {
        (Some(level_count), Some(layer_count)) => Ok(SubresourceRange {
            aspect,
            base_mip_level: range.base_mip_level,
            level_count,
            base_layer: range.base_array_layer,
            layer_count,
        }),
        _ => Err(no_subresource(range)),
    }
}

/// The subresources of a copy; it names exactly one aspect.
fn layers(image: &Image, layers: &vk::ImageSubresourceLayers) -> Result<SubresourceLayers, Error> {
    let aspect = match *aspects(image, layers.aspect_mask)?.as_slice() {
        [aspect] => aspect,
        _ => return Err(no_subresource(layers)),
    };
    let layer_count = count(
        layers.base_array_layer,
        layers.layer_count,
        vk::REMAINING_ARRAY_LAYERS,
        image.desc.array_layers,
    );
    match layer_count {
        Some(layer_count) if layers.mip_level < image.desc.mip_levels => Ok(SubresourceLayers {
            aspect,
            mip_level: layers.mip_level,
            base_layer: layers.base_array_layer,
            layer_count,
        }),
        _ => Err(no_subresource(layers)),
    }
}

/// The aspects of a mask, all of which the image has.
pub(crate) fn aspects(image: &Image, mask: vk::ImageAspectFlags) -> Result<Vec<Aspect>, Error> {
    let named = [
        (vk::ImageAspectFlags::COLOR, Aspect::Color),
        (vk::ImageAspectFlags::DEPTH, Aspect::Depth),
        (vk::ImageAspectFlags::STENCIL, Aspect::Stencil),
    ];
    let known = named
        .iter()
        .fold(vk::ImageAspectFlags::empty(), |all, &(flag, _)| all | flag);
    let chosen: Vec<_> = named
        .iter()
        .filter(|(flag, _)| mask.contains(*flag))
        .map(|&(_, aspect)| aspect)
        .collect();
    let has = |aspect| image.desc.format.aspects().contains(aspect);
    if mask.is_empty() || !known.contains(mask) || !chosen.iter().all(has) {
        return Err(no_subresource(&mask));
    }
    Ok(chosen)
}

fn no_subresource(what: &dyn std::fmt::Debug) -> Error {
    Error::usage(
        "VUID-vkCmd-image-subresource",
        format!("an image does not have the subresource {what:?} that a command names"),
    )
}

fn offset(offset: vk::Offset3D) -> [i32; 3] {
    [offset.x, offset.y, offset.z]
}

fn extent(extent: vk::Extent3D) -> [u32; 3] {
    [extent.width, extent.height, extent.depth]
}
