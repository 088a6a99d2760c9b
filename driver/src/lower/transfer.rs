//! Lowers copies, blits, resolves and clears. Regions are converted as they are; the device refuses what lies outside an image.

use super::rendering;
use crate::error::Error;
use crate::object::buffer::Buffer;
use crate::object::image::{Image, count};
use crate::object::sampler;
use ash::vk;
use simdevice::format::{Aspect, ClearValue, Numeric};
use simdevice::packet::{
    BlitImage, BufferCopyRegion, BufferImageRegion, BufferRange, ClearImage, CopyBuffer,
    CopyBufferImage, CopyImage, ImageBlitRegion, ImageCopyRegion, ResolveImage, SubresourceLayers,
    SubresourceRange,
};
use simdevice::state::ResolveMode;
use simdevice::{Format, Packet};
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
    let side = image.desc.format.block_side();
    let region = |region: &vk::BufferImageCopy2| {
        Ok(BufferImageRegion {
            buffer_offset: region.buffer_offset,
            buffer_row_length: region.buffer_row_length.div_ceil(side),
            buffer_image_height: region.buffer_image_height.div_ceil(side),
            subresource: layers(image, &region.image_subresource)?,
            image_offset: block_offset(image, region.image_offset),
            image_extent: block_extent(image, region.image_extent),
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
/// [`Error::Usage`] if an image is not bound, has no such subresource, or differs from the other in its samples.
pub(crate) fn copy_image(
    source: &Image,
    target: &Image,
    regions: &[vk::ImageCopy2],
) -> Result<Packet, Error> {
    let (from, to) = (source.desc.samples, target.desc.samples);
    if from != to {
        return Err(Error::usage(
            "VUID-vkCmdCopyImage-srcImage-00136",
            format!("one image has {from} samples, the other {to}"),
        ));
    }
    let (source_image, target_image) = (source, target);
    let mut lowered = simdevice::host::with_capacity(regions.len());
    for region in regions {
        let pairs = layer_pairs(
            (source, &region.src_subresource),
            (target, &region.dst_subresource),
        )?;
        lowered.extend(pairs.into_iter().map(|(source, target)| ImageCopyRegion {
            source,
            source_offset: block_offset(source_image, region.src_offset),
            target,
            target_offset: block_offset(target_image, region.dst_offset),
            extent: block_extent(source_image, region.extent),
        }));
    }
    Ok(Packet::CopyImage(CopyImage {
        source: Arc::clone(source.bound()?),
        target: Arc::clone(target.bound()?),
        regions: lowered,
    }))
}

/// `vkCmdBlitImage`.
///
/// # Errors
/// [`Error::Usage`] if an image is not bound, has no such subresource or several samples, or if the formats don't
/// convert to each other; [`Error::FeatureNotPresent`] for filters of extensions.
pub(crate) fn blit_image(
    source: &Image,
    target: &Image,
    filter: vk::Filter,
    regions: &[vk::ImageBlit2],
) -> Result<Packet, Error> {
    require_one_sample("VUID-vkCmdBlitImage-srcImage-00233", source)?;
    require_one_sample("VUID-vkCmdBlitImage-dstImage-00234", target)?;
    let (from, to) = (source.desc.format, target.desc.format);
    let to_compressed = to.decompressed().is_some();
    if to_compressed || !converts(from.decompressed().unwrap_or(from), to) {
        return Err(Error::usage(
            "VUID-vkCmdBlitImage-srcImage-00229",
            format!("texels of format {from:?} do not convert to {to:?}"),
        ));
    }
    let mut lowered = simdevice::host::with_capacity(regions.len());
    for region in regions {
        let pairs = layer_pairs(
            (source, &region.src_subresource),
            (target, &region.dst_subresource),
        )?;
        lowered.extend(pairs.into_iter().map(|(source, target)| ImageBlitRegion {
            source,
            source_corners: region.src_offsets.map(offset),
            target,
            target_corners: region.dst_offsets.map(offset),
        }));
    }
    Ok(Packet::BlitImage(BlitImage {
        source: Arc::clone(source.bound()?),
        target: Arc::clone(target.bound()?),
        filter: sampler::filter(filter)?,
        regions: lowered,
    }))
}

/// `vkCmdResolveImage`.
///
/// # Errors
/// [`Error::Usage`] if an image is not bound or has no such subresource, if the target has several samples, or if
/// the formats differ.
pub(crate) fn resolve_image(
    source: &Image,
    target: &Image,
    regions: &[vk::ImageResolve2],
) -> Result<Packet, Error> {
    require_one_sample("VUID-vkCmdResolveImage-dstImage-00259", target)?;
    let (from, to) = (source.desc.format, target.desc.format);
    if from != to || from.aspects() != [Aspect::Color] {
        return Err(Error::usage(
            "VUID-vkCmdResolveImage-srcImage-01386",
            format!("texels of format {from:?} do not resolve to {to:?}"),
        ));
    }
    let region = |region: &vk::ImageResolve2| {
        Ok(ImageCopyRegion {
            source: layers(source, &region.src_subresource)?,
            source_offset: offset(region.src_offset),
            target: layers(target, &region.dst_subresource)?,
            target_offset: offset(region.dst_offset),
            extent: extent(region.extent),
        })
    };
    Ok(Packet::ResolveImage(ResolveImage {
        source: Arc::clone(source.bound()?),
        target: Arc::clone(target.bound()?),
        mode: ResolveMode::Average,
        regions: regions.iter().map(region).collect::<Result<_, Error>>()?,
    }))
}

fn require_one_sample(vuid: &'static str, image: &Image) -> Result<(), Error> {
    match image.desc.samples {
        1 => Ok(()),
        samples => Err(Error::usage(
            vuid,
            format!("the image has {samples} samples"),
        )),
    }
}

/// Whether a blit between the formats means something: signed integers, unsigned ones and everything else keep to
/// themselves, and a depth and stencil format to itself.
fn converts(from: Format, to: Format) -> bool {
    let class = |format: Format| match format.numeric() {
        Numeric::Uint => 0,
        Numeric::Sint => 1,
        _ => 2,
    };
    let are_colors = [from, to].map(|format| format.aspects() == [Aspect::Color]) == [true; 2];
    from == to || are_colors && class(from) == class(to)
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
    let mut lowered = simdevice::host::with_capacity(ranges.len());
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

/// The subresources of a copy that names exactly one aspect.
fn layers(image: &Image, layers: &vk::ImageSubresourceLayers) -> Result<SubresourceLayers, Error> {
    match *aspect_layers(image, layers)?.as_slice() {
        [layers] => Ok(layers),
        _ => Err(no_subresource(layers)),
    }
}

/// The subresources on both sides of a copy, aspect by aspect.
fn layer_pairs(
    (source, from): (&Image, &vk::ImageSubresourceLayers),
    (target, to): (&Image, &vk::ImageSubresourceLayers),
) -> Result<Vec<(SubresourceLayers, SubresourceLayers)>, Error> {
    let (sources, targets) = (aspect_layers(source, from)?, aspect_layers(target, to)?);
    if sources.len() != targets.len() {
        return Err(Error::usage(
            "VUID-vkCmdCopyImage-srcImage-01551",
            format!("a region goes from {from:?} to other aspects, {to:?}"),
        ));
    }
    Ok(sources.into_iter().zip(targets).collect())
}

/// The subresources of a copy, aspect by aspect.
fn aspect_layers(
    image: &Image,
    layers: &vk::ImageSubresourceLayers,
) -> Result<Vec<SubresourceLayers>, Error> {
    let layer_count = count(
        layers.base_array_layer,
        layers.layer_count,
        vk::REMAINING_ARRAY_LAYERS,
        image.desc.array_layers,
    );
    let Some(layer_count) = layer_count.filter(|_| layers.mip_level < image.desc.mip_levels) else {
        return Err(no_subresource(layers));
    };
    let aspects = aspects(image, layers.aspect_mask)?.into_iter();
    Ok(aspects
        .map(|aspect| SubresourceLayers {
            aspect,
            mip_level: layers.mip_level,
            base_layer: layers.base_array_layer,
            layer_count,
        })
        .collect())
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

/// An offset in texels, in the blocks that an image is stored in.
fn block_offset(image: &Image, offset: vk::Offset3D) -> [i32; 3] {
    // Valid usage has them multiples of a block's side.
    let side = image.desc.format.block_side().cast_signed();
    [offset.x / side, offset.y / side, offset.z]
}

/// An extent in texels, in the blocks that an image is stored in.
fn block_extent(image: &Image, extent: vk::Extent3D) -> [u32; 3] {
    let side = image.desc.format.block_side();
    [
        extent.width.div_ceil(side),
        extent.height.div_ceil(side),
        extent.depth,
    ]
}
