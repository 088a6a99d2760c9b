//! Commands that copy, blit, resolve and clear. Regions are converted unchecked; the device refuses regions outside an
//! image.

use super::buffer::Recorder;
use crate::abi::error::Error;
use crate::abi::valid;
use crate::convert;
use crate::resource::buffer::{Buffer, BufferRules};
use crate::resource::image::{Image, PlaneAspects, count};
use ash::vk;
use simdevice::BufferRange;
use simdevice::format::{Aspect, ClearValue, Numeric};
use simdevice::packet::{
    AttachmentClear, BlitImage, BufferCopyRegion, BufferImageRegion, ClearAttachments, ClearImage, CopyBuffer,
    CopyBufferImage, CopyImage, ImageBlitRegion, ImageCopyRegion, ResolveImage, SubresourceLayers, SubresourceRange,
};
use simdevice::state::ResolveMode;
use simdevice::{Format, Packet};
use std::ffi::c_void;
use std::sync::Arc;

/// The most bytes that `vkCmdUpdateBuffer` takes.
const MAX_UPDATE: u64 = 65_536;

#[doc(alias = "vkCmdCopyBuffer2")]
pub(crate) fn cmd_copy_buffer2(
    recorder: &mut Recorder,
    src_buffer: &Buffer,
    dst_buffer: &Buffer,
    regions: &[vk::BufferCopy2<'_>],
) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    recorder.packet(copy_buffer(src_buffer, dst_buffer, regions)?);
    Ok(())
}

#[doc(alias = "vkCmdCopyImage2")]
pub(crate) fn cmd_copy_image2(
    recorder: &mut Recorder,
    src_image: &Image,
    dst_image: &Image,
    regions: &[vk::ImageCopy2<'_>],
) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    for copy in copy_image([src_image, dst_image], [&COPY_SOURCE, &COPY_TARGET], regions)? {
        recorder.packet(Packet::CopyImage(copy));
    }
    Ok(())
}

#[doc(alias = "vkCmdBlitImage2")]
pub(crate) fn cmd_blit_image2(
    recorder: &mut Recorder,
    src_image: &Image,
    dst_image: &Image,
    regions: &[vk::ImageBlit2<'_>],
    filter: vk::Filter,
) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    recorder.packet(blit_image(src_image, dst_image, filter, regions)?);
    Ok(())
}

#[doc(alias = "vkCmdResolveImage2")]
pub(crate) fn cmd_resolve_image2(
    recorder: &mut Recorder,
    src_image: &Image,
    dst_image: &Image,
    regions: &[vk::ImageResolve2<'_>],
) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    recorder.packet(resolve_image(src_image, dst_image, regions)?);
    Ok(())
}

#[doc(alias = "vkCmdCopyBufferToImage2")]
pub(crate) fn cmd_copy_buffer_to_image2(
    recorder: &mut Recorder,
    src_buffer: &Buffer,
    dst_image: &Image,
    regions: &[vk::BufferImageCopy2<'_>],
) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    for copy in copy_buffer_image(src_buffer, dst_image, regions, &COPY_TO_IMAGE_BUFFER, &COPY_TO_IMAGE)? {
        recorder.packet(Packet::CopyBufferToImage(copy));
    }
    Ok(())
}

#[doc(alias = "vkCmdCopyImageToBuffer2")]
pub(crate) fn cmd_copy_image_to_buffer2(
    recorder: &mut Recorder,
    src_image: &Image,
    dst_buffer: &Buffer,
    regions: &[vk::BufferImageCopy2<'_>],
) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    for copy in copy_buffer_image(dst_buffer, src_image, regions, &COPY_FROM_IMAGE_BUFFER, &COPY_FROM_IMAGE)? {
        recorder.packet(Packet::CopyImageToBuffer(copy));
    }
    Ok(())
}

#[doc(alias = "vkCmdFillBuffer")]
pub(crate) fn cmd_fill_buffer(
    recorder: &mut Recorder,
    dst_buffer: &Arc<Buffer>,
    dst_offset: vk::DeviceSize,
    size: vk::DeviceSize,
    data: u32,
) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    let size = (size != vk::WHOLE_SIZE).then_some(size);
    let packet = fill_buffer(dst_buffer, dst_offset, size, data)?;
    recorder.packet(packet);
    Ok(())
}

/// # Safety
/// The data is as long as its size says.
#[doc(alias = "vkCmdUpdateBuffer")]
pub(crate) unsafe fn cmd_update_buffer(
    recorder: &mut Recorder,
    dst_buffer: &Buffer,
    dst_offset: vk::DeviceSize,
    data_size: vk::DeviceSize,
    data: *const c_void,
) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    if data_size > MAX_UPDATE {
        return Err(Error::usage(
            "VUID-vkCmdUpdateBuffer-dataSize-00037",
            format!("dataSize is {data_size}, more than {MAX_UPDATE}"),
        ));
    }
    // SAFETY: the caller's promise.
    let data = unsafe { valid::slice(data.cast::<u8>(), data_size as u32)? };
    recorder.packet(update_buffer(dst_buffer, dst_offset, data)?);
    Ok(())
}

#[doc(alias = "vkCmdClearColorImage")]
pub(crate) fn cmd_clear_color_image(
    recorder: &mut Recorder,
    image: &Arc<Image>,
    color: &vk::ClearColorValue,
    ranges: &[vk::ImageSubresourceRange],
) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    let color = *color;
    recorder.packet(clear_color_image(image, color, ranges)?);
    Ok(())
}

#[doc(alias = "vkCmdClearDepthStencilImage")]
pub(crate) fn cmd_clear_depth_stencil_image(
    recorder: &mut Recorder,
    image: &Arc<Image>,
    depth_stencil: &vk::ClearDepthStencilValue,
    ranges: &[vk::ImageSubresourceRange],
) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    let value = *depth_stencil;
    let packet = clear_depth_stencil_image(image, value, ranges)?;
    recorder.packet(packet);
    Ok(())
}

#[doc(alias = "vkCmdClearAttachments")]
pub(crate) fn cmd_clear_attachments(
    recorder: &mut Recorder,
    attachments: &[vk::ClearAttachment],
    rects: &[vk::ClearRect],
) -> Result<(), Error> {
    recorder.require_pass()?;
    let mut clears = Vec::new();
    for attachment in attachments {
        let index = attachment.color_attachment as usize;
        let format = if attachment.aspect_mask.contains(vk::ImageAspectFlags::COLOR) {
            recorder.color_format(index)?
        } else {
            None
        };
        if let Some(format) = format {
            // SAFETY: any bits are a value of each member of the union.
            let color = unsafe { attachment.clear_value.color };
            let value = convert::clear_color(format, color);
            clears.push(AttachmentClear::Color { index, value });
        }
        // SAFETY: as above.
        let value = unsafe { attachment.clear_value.depth_stencil };
        if attachment.aspect_mask.contains(vk::ImageAspectFlags::DEPTH) {
            clears.push(AttachmentClear::Depth(value.depth));
        }
        if attachment.aspect_mask.contains(vk::ImageAspectFlags::STENCIL) {
            clears.push(AttachmentClear::Stencil(value.stencil));
        }
    }
    let rects = rects.iter().map(|r| (convert::rect(r.rect), r.base_array_layer, r.layer_count));
    let rects = simdevice::host::collect(rects);
    recorder.packet(Packet::ClearAttachments(ClearAttachments { clears, rects }));
    Ok(())
}

/// The ids of the rules on a use of an image.
pub(super) struct ImageRules {
    /// The image must be bound to memory.
    pub(super) memory: &'static str,
    /// The image must have the named aspects.
    pub(super) aspect: &'static str,
    /// The image must have the named mip levels.
    pub(super) level: &'static str,
    /// The image must have the named array layers.
    pub(super) layers: &'static str,
}

/// The rules on the source of `vkCmdCopyBuffer`.
const COPY_BUFFER_SOURCE: BufferRules =
    BufferRules { memory: "VUID-vkCmdCopyBuffer-srcBuffer-00119", range: "VUID-vkCmdCopyBuffer-size-00115" };

/// The rules on the target of `vkCmdCopyBuffer`.
const COPY_BUFFER_TARGET: BufferRules =
    BufferRules { memory: "VUID-vkCmdCopyBuffer-dstBuffer-00121", range: "VUID-vkCmdCopyBuffer-size-00116" };

/// The rules on the target of `vkCmdFillBuffer`.
const FILL_TARGET: BufferRules =
    BufferRules { memory: "VUID-vkCmdFillBuffer-dstBuffer-00031", range: "VUID-vkCmdFillBuffer-size-00027" };

/// The rules on the target of `vkCmdUpdateBuffer`.
const UPDATE_TARGET: BufferRules =
    BufferRules { memory: "VUID-vkCmdUpdateBuffer-dstBuffer-00035", range: "VUID-vkCmdUpdateBuffer-dataSize-00033" };

/// The rules on the buffer of `vkCmdCopyBufferToImage`.
const COPY_TO_IMAGE_BUFFER: BufferRules = BufferRules {
    memory: "VUID-vkCmdCopyBufferToImage-srcBuffer-00176",
    range: "VUID-vkCmdCopyBufferToImage-pRegions-00171",
};

/// The rules on the buffer of `vkCmdCopyImageToBuffer`.
const COPY_FROM_IMAGE_BUFFER: BufferRules = BufferRules {
    memory: "VUID-vkCmdCopyImageToBuffer-dstBuffer-00192",
    range: "VUID-vkCmdCopyImageToBuffer-pRegions-00183",
};

/// The rules on the image of `vkCmdCopyBufferToImage`.
const COPY_TO_IMAGE: ImageRules = ImageRules {
    memory: "VUID-vkCmdCopyBufferToImage-dstImage-00178",
    aspect: "VUID-vkCmdCopyBufferToImage-aspectMask-00211",
    level: "VUID-vkCmdCopyBufferToImage-imageSubresource-01701",
    layers: "VUID-vkCmdCopyBufferToImage-imageSubresource-01702",
};

/// The rules on the image of `vkCmdCopyImageToBuffer`.
const COPY_FROM_IMAGE: ImageRules = ImageRules {
    memory: "VUID-vkCmdCopyImageToBuffer-srcImage-00187",
    aspect: "VUID-vkCmdCopyImageToBuffer-aspectMask-00211",
    level: "VUID-vkCmdCopyImageToBuffer-imageSubresource-01703",
    layers: "VUID-vkCmdCopyImageToBuffer-imageSubresource-01704",
};

/// The rules on the source of `vkCmdCopyImage`.
const COPY_SOURCE: ImageRules = ImageRules {
    memory: "VUID-vkCmdCopyImage-srcImage-01546",
    aspect: "VUID-vkCmdCopyImage-aspectMask-00142",
    level: "VUID-vkCmdCopyImage-srcSubresource-01696",
    layers: "VUID-vkCmdCopyImage-srcSubresource-01698",
};

/// The rules on the target of `vkCmdCopyImage`.
const COPY_TARGET: ImageRules = ImageRules {
    memory: "VUID-vkCmdCopyImage-dstImage-01547",
    aspect: "VUID-vkCmdCopyImage-aspectMask-00143",
    level: "VUID-vkCmdCopyImage-dstSubresource-01697",
    layers: "VUID-vkCmdCopyImage-dstSubresource-01699",
};

/// The rules on the source of `vkCmdBlitImage`.
const BLIT_SOURCE: ImageRules = ImageRules {
    memory: "VUID-vkCmdBlitImage-srcImage-00220",
    aspect: "VUID-vkCmdBlitImage-aspectMask-00241",
    level: "VUID-vkCmdBlitImage-srcSubresource-01705",
    layers: "VUID-vkCmdBlitImage-srcSubresource-01707",
};

/// The rules on the target of `vkCmdBlitImage`.
const BLIT_TARGET: ImageRules = ImageRules {
    memory: "VUID-vkCmdBlitImage-dstImage-00225",
    aspect: "VUID-vkCmdBlitImage-aspectMask-00242",
    level: "VUID-vkCmdBlitImage-dstSubresource-01706",
    layers: "VUID-vkCmdBlitImage-dstSubresource-01708",
};

/// The rules on the source of `vkCmdResolveImage`.
const RESOLVE_SOURCE: ImageRules = ImageRules {
    memory: "VUID-vkCmdResolveImage-srcImage-00256",
    aspect: "VUID-VkImageResolve-aspectMask-00266",
    level: "VUID-vkCmdResolveImage-srcSubresource-01709",
    layers: "VUID-vkCmdResolveImage-srcSubresource-01711",
};

/// The rules on the target of `vkCmdResolveImage`.
const RESOLVE_TARGET: ImageRules = ImageRules {
    memory: "VUID-vkCmdResolveImage-dstImage-00258",
    aspect: "VUID-VkImageResolve-aspectMask-00266",
    level: "VUID-vkCmdResolveImage-dstSubresource-01710",
    layers: "VUID-vkCmdResolveImage-dstSubresource-01712",
};

/// The rules on the image of `vkCmdClearColorImage`.
const CLEAR_COLOR: ImageRules = ImageRules {
    memory: "VUID-vkCmdClearColorImage-image-00003",
    aspect: "VUID-vkCmdClearColorImage-aspectMask-02498",
    level: "VUID-vkCmdClearColorImage-pRanges-01692",
    layers: "VUID-vkCmdClearColorImage-pRanges-01693",
};

/// The rules on the image of `vkCmdClearDepthStencilImage`.
const CLEAR_DEPTH_STENCIL: ImageRules = ImageRules {
    memory: "VUID-vkCmdClearDepthStencilImage-image-00010",
    aspect: "VUID-vkCmdClearDepthStencilImage-aspectMask-02824",
    level: "VUID-vkCmdClearDepthStencilImage-pRanges-01694",
    layers: "VUID-vkCmdClearDepthStencilImage-pRanges-01695",
};

/// `vkCmdCopyBuffer`.
///
/// # Errors
/// [`Error::InvalidUsage`] if a buffer is not bound or a region lies outside.
fn copy_buffer(source: &Buffer, target: &Buffer, regions: &[vk::BufferCopy2]) -> Result<Packet, Error> {
    for region in regions {
        source.range(region.src_offset, Some(region.size), &COPY_BUFFER_SOURCE)?;
        target.range(region.dst_offset, Some(region.size), &COPY_BUFFER_TARGET)?;
    }
    Ok(Packet::CopyBuffer(CopyBuffer {
        source: source.whole(&COPY_BUFFER_SOURCE)?,
        target: target.whole(&COPY_BUFFER_TARGET)?,
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

/// The body of `vkCmdCopyBufferToImage` and `vkCmdCopyImageToBuffer`: a copy for each plane of the image.
///
/// # Errors
/// [`Error::InvalidUsage`] if the buffer or image is not bound or the image has no such subresource.
fn copy_buffer_image(
    buffer: &Buffer,
    image: &Image,
    regions: &[vk::BufferImageCopy2],
    buffer_rules: &BufferRules,
    image_rules: &ImageRules,
) -> Result<Vec<CopyBufferImage>, Error> {
    let buffer = buffer.whole(buffer_rules)?;
    let [across, down] = image.block_extent();
    let mut copies = ByPlanes::default();
    for region in regions {
        let (plane, subresource) =
            layers(image, &region.image_subresource, image_rules, "VUID-VkBufferImageCopy-aspectMask-00212")?;
        let converted = BufferImageRegion {
            buffer_offset: region.buffer_offset,
            buffer_row_length: region.buffer_row_length.div_ceil(across),
            buffer_image_height: region.buffer_image_height.div_ceil(down),
            subresource,
            image_offset: block_offset(image, region.image_offset),
            image_extent: block_extent(image, region.image_extent),
        };
        copies.add(plane, converted);
    }
    let copy = |(plane, regions)| {
        let image = image.blocks(plane, image_rules.memory)?;
        Ok(CopyBufferImage { buffer: buffer.clone(), image, regions })
    };
    copies.0.into_iter().map(copy).collect()
}

/// The regions of a command, apart for each plane or pair of planes between which they copy. Planes are images of the device.
struct ByPlanes<P, R>(Vec<(P, Vec<R>)>);

impl<P, R> Default for ByPlanes<P, R> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<P: Copy + PartialEq, R> ByPlanes<P, R> {
    fn add(&mut self, planes: P, region: R) {
        match self.0.iter_mut().find(|(known, _)| *known == planes) {
            Some((_, regions)) => simdevice::host::push(regions, region),
            None => self.0.push((planes, vec![region])),
        }
    }
}

/// A copy from one image to the other for each pair of planes.
///
/// # Errors
/// [`Error::InvalidUsage`] if an image is not bound, has no such subresource, or differs from the other in its samples.
pub(super) fn copy_image(
    [source_image, target_image]: [&Image; 2],
    [source_rules, target_rules]: [&ImageRules; 2],
    regions: &[vk::ImageCopy2],
) -> Result<Vec<CopyImage>, Error> {
    let (from, to) = (source_image.desc.samples, target_image.desc.samples);
    if from != to {
        return Err(Error::usage(
            "VUID-vkCmdCopyImage-srcImage-00136",
            format!("one image has {from} samples, the other {to}"),
        ));
    }
    let mut copies = ByPlanes::default();
    for region in regions {
        let (planes, pairs) = layer_pairs(
            &CopySide { image: source_image, layers: region.src_subresource, rules: source_rules },
            &CopySide { image: target_image, layers: region.dst_subresource, rules: target_rules },
        )?;
        for (source, target) in pairs {
            let converted = ImageCopyRegion {
                source,
                source_offset: block_offset(source_image, region.src_offset),
                target,
                target_offset: block_offset(target_image, region.dst_offset),
                extent: block_extent(source_image, region.extent),
            };
            copies.add(planes, converted);
        }
    }
    let copy = |([source, target], regions): ([usize; 2], _)| {
        Ok(CopyImage {
            source: source_image.blocks(source, source_rules.memory)?,
            target: target_image.blocks(target, target_rules.memory)?,
            regions,
        })
    };
    copies.0.into_iter().map(copy).collect()
}

/// `vkCmdBlitImage`.
///
/// # Errors
/// [`Error::InvalidUsage`] if an image is not bound, has no such subresource or several samples, or if the formats
/// don't convert to each other; [`Error::FeatureNotPresent`] for filters of extensions.
fn blit_image(source: &Image, target: &Image, filter: vk::Filter, regions: &[vk::ImageBlit2]) -> Result<Packet, Error> {
    require_no_chroma("VUID-vkCmdBlitImage-srcImage-06421", source)?;
    require_no_chroma("VUID-vkCmdBlitImage-dstImage-06422", target)?;
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
    let mut converted = simdevice::host::with_capacity(regions.len());
    for region in regions {
        let (_, pairs) = layer_pairs(
            &CopySide { image: source, layers: region.src_subresource, rules: &BLIT_SOURCE },
            &CopySide { image: target, layers: region.dst_subresource, rules: &BLIT_TARGET },
        )?;
        converted.extend(pairs.into_iter().map(|(source, target)| ImageBlitRegion {
            source,
            source_corners: region.src_offsets.map(convert::offset),
            target,
            target_corners: region.dst_offsets.map(convert::offset),
        }));
    }
    Ok(Packet::BlitImage(BlitImage {
        source: Arc::clone(source.bound(BLIT_SOURCE.memory)?),
        target: Arc::clone(target.bound(BLIT_TARGET.memory)?),
        filter: convert::filter(filter)?,
        regions: converted,
    }))
}

/// `vkCmdResolveImage`.
///
/// # Errors
/// [`Error::InvalidUsage`] if an image is not bound or has no such subresource, if the target has several samples, or
/// if the formats differ.
fn resolve_image(source: &Image, target: &Image, regions: &[vk::ImageResolve2]) -> Result<Packet, Error> {
    require_no_chroma("VUID-vkCmdResolveImage-srcImage-00257", source)?;
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
            source: layers(source, &region.src_subresource, &RESOLVE_SOURCE, RESOLVE_SOURCE.aspect)?.1,
            source_offset: convert::offset(region.src_offset),
            target: layers(target, &region.dst_subresource, &RESOLVE_TARGET, RESOLVE_TARGET.aspect)?.1,
            target_offset: convert::offset(region.dst_offset),
            extent: convert::extent(region.extent),
        })
    };
    Ok(Packet::ResolveImage(ResolveImage {
        source: Arc::clone(source.bound(RESOLVE_SOURCE.memory)?),
        target: Arc::clone(target.bound(RESOLVE_TARGET.memory)?),
        mode: ResolveMode::Average,
        regions: regions.iter().map(region).collect::<Result<_, Error>>()?,
    }))
}

fn require_no_chroma(vuid: &'static str, image: &Image) -> Result<(), Error> {
    match image.ycbcr {
        None => Ok(()),
        Some(format) => Err(Error::usage(vuid, format!("{:?} requires a sampler Y'CbCr conversion", format.format))),
    }
}

fn require_one_sample(vuid: &'static str, image: &Image) -> Result<(), Error> {
    match image.desc.samples {
        1 => Ok(()),
        samples => Err(Error::usage(vuid, format!("the image has {samples} samples"))),
    }
}

/// Reports whether a blit between the formats is allowed: signed integers, unsigned integers and other formats each
/// convert only among themselves, and a depth and stencil format only to itself.
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
/// [`Error::InvalidUsage`] if the buffer is not bound or the range is outside or not of whole words.
fn fill_buffer(target: &Buffer, offset: u64, size: Option<u64>, word: u32) -> Result<Packet, Error> {
    let range = target.range(offset, size, &FILL_TARGET)?;
    let whole_words = BufferRange { size: range.size / 4 * 4, ..range };
    if !offset.is_multiple_of(4) || size.is_some_and(|size| !size.is_multiple_of(4)) {
        return Err(Error::usage(
            "VUID-vkCmdFillBuffer-dstOffset-00025",
            format!("offset {offset} and size {size:?} are not multiples of 4"),
        ));
    }
    Ok(Packet::FillBuffer { target: whole_words, word })
}

/// `vkCmdUpdateBuffer`.
///
/// # Errors
/// [`Error::InvalidUsage`] if the buffer is not bound or the range is outside.
fn update_buffer(target: &Buffer, offset: u64, data: &[u8]) -> Result<Packet, Error> {
    Ok(Packet::UpdateBuffer {
        target: target.range(offset, Some(data.len() as u64), &UPDATE_TARGET)?,
        data: data.into(),
    })
}

/// `vkCmdClearColorImage`.
///
/// # Errors
/// [`Error::InvalidUsage`] if the image is not bound or has no such subresource.
fn clear_color_image(
    image: &Image,
    value: vk::ClearColorValue,
    ranges: &[vk::ImageSubresourceRange],
) -> Result<Packet, Error> {
    clear_image(image, convert::clear_color(image.desc.format, value), ranges, &CLEAR_COLOR)
}

/// `vkCmdClearDepthStencilImage`.
///
/// # Errors
/// [`Error::InvalidUsage`] if the image is not bound or has no such subresource.
fn clear_depth_stencil_image(
    image: &Image,
    value: vk::ClearDepthStencilValue,
    ranges: &[vk::ImageSubresourceRange],
) -> Result<Packet, Error> {
    clear_image(image, convert::clear_depth_stencil(value), ranges, &CLEAR_DEPTH_STENCIL)
}

fn clear_image(
    image: &Image,
    value: ClearValue,
    ranges: &[vk::ImageSubresourceRange],
    rules: &ImageRules,
) -> Result<Packet, Error> {
    require_no_chroma("VUID-vkCmdClearColorImage-image-01545", image)?;
    let mut converted = simdevice::host::with_capacity(ranges.len());
    for range in ranges {
        for aspect in aspects(image, range.aspect_mask, rules)?.aspects {
            converted.push(subresource_range(image, aspect, range, rules)?);
        }
    }
    Ok(Packet::ClearImage(ClearImage { image: Arc::clone(image.bound(rules.memory)?), value, ranges: converted }))
}

fn subresource_range(
    image: &Image,
    aspect: Aspect,
    range: &vk::ImageSubresourceRange,
    rules: &ImageRules,
) -> Result<SubresourceRange, Error> {
    let desc = &image.desc;
    let levels = count(range.base_mip_level, range.level_count, vk::REMAINING_MIP_LEVELS, desc.mip_levels);
    let layers = count(range.base_array_layer, range.layer_count, vk::REMAINING_ARRAY_LAYERS, desc.array_layers);
    match (levels, layers) {
        (Some(level_count), Some(layer_count)) => Ok(SubresourceRange {
            aspect,
            base_mip_level: range.base_mip_level,
            level_count,
            base_layer: range.base_array_layer,
            layer_count,
        }),
        (None, _) => Err(no_subresource(rules.level, range)),
        _ => Err(no_subresource(rules.layers, range)),
    }
}

/// The plane and the subresources of a copy that must name exactly one aspect; `single` is the id of that rule.
pub(super) fn layers(
    image: &Image,
    layers: &vk::ImageSubresourceLayers,
    rules: &ImageRules,
    single: &'static str,
) -> Result<(usize, SubresourceLayers), Error> {
    let (plane, found) = aspect_layers(image, layers, rules)?;
    match *found.as_slice() {
        [layers] => Ok((plane, layers)),
        _ => Err(no_subresource(single, layers)),
    }
}

/// The source or the target of a copy.
struct CopySide<'a> {
    image: &'a Image,
    layers: vk::ImageSubresourceLayers,
    rules: &'a ImageRules,
}

/// The subresources on both sides of a copy.
type LayerPair = (SubresourceLayers, SubresourceLayers);

/// The planes and the subresources on both sides of a copy, aspect by aspect.
fn layer_pairs(source: &CopySide<'_>, target: &CopySide<'_>) -> Result<([usize; 2], Vec<LayerPair>), Error> {
    let (source_plane, sources) = aspect_layers(source.image, &source.layers, source.rules)?;
    let (target_plane, targets) = aspect_layers(target.image, &target.layers, target.rules)?;
    if sources.len() != targets.len() {
        return Err(Error::usage(
            "VUID-vkCmdCopyImage-srcImage-01551",
            format!("a region goes from {:?} to other aspects, {:?}", source.layers, target.layers),
        ));
    }
    Ok(([source_plane, target_plane], sources.into_iter().zip(targets).collect()))
}

/// The plane and the subresources of a copy, aspect by aspect.
fn aspect_layers(
    image: &Image,
    layers: &vk::ImageSubresourceLayers,
    rules: &ImageRules,
) -> Result<(usize, Vec<SubresourceLayers>), Error> {
    let layer_count =
        count(layers.base_array_layer, layers.layer_count, vk::REMAINING_ARRAY_LAYERS, image.desc.array_layers);
    if layers.mip_level >= image.desc.mip_levels {
        return Err(no_subresource(rules.level, layers));
    }
    let layer_count = layer_count.ok_or_else(|| no_subresource(rules.layers, layers))?;
    let PlaneAspects { plane, aspects } = aspects(image, layers.aspect_mask, rules)?;
    let found = aspects
        .into_iter()
        .map(|aspect| SubresourceLayers {
            aspect,
            mip_level: layers.mip_level,
            base_layer: layers.base_array_layer,
            layer_count,
        })
        .collect();
    Ok((plane, found))
}

/// The aspects of a mask, all of which the image has.
fn aspects(image: &Image, mask: vk::ImageAspectFlags, rules: &ImageRules) -> Result<PlaneAspects, Error> {
    image.aspects(mask).ok_or_else(|| no_subresource(rules.aspect, &mask))
}

fn no_subresource(vuid: &'static str, what: &dyn std::fmt::Debug) -> Error {
    Error::usage(vuid, format!("an image does not have the subresource {what:?} that a command names"))
}

/// Converts an offset from texels to the blocks in which an image is stored.
pub(super) fn block_offset(image: &Image, offset: vk::Offset3D) -> [i32; 3] {
    // Valid usage requires multiples of a block's extent.
    let [across, down] = image.block_extent().map(u32::cast_signed);
    [offset.x / across, offset.y / down, offset.z]
}

/// Converts an extent from texels to the blocks in which an image is stored.
pub(super) fn block_extent(image: &Image, extent: vk::Extent3D) -> [u32; 3] {
    let [across, down] = image.block_extent();
    [extent.width.div_ceil(across), extent.height.div_ceil(down), extent.depth]
}
