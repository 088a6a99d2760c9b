//! Commands that copy, blit, resolve and clear.

use super::command::record;
use crate::error::Error;
use crate::lower::{rendering, transfer};
use crate::{handle, pointer};
use ash::vk;
use simdevice::Packet;
use simdevice::packet::{AttachmentClear, ClearAttachments};
use std::ffi::c_void;

/// The most bytes that `vkCmdUpdateBuffer` takes.
const MAX_UPDATE: u64 = 65_536;

crate::entry_points! {
    fn cmd_copy_buffer(
        command_buffer: vk::CommandBuffer,
        src_buffer: vk::Buffer,
        dst_buffer: vk::Buffer,
        region_count: u32,
        regions: *const vk::BufferCopy,
    ) {
        let regions = || Ok(pointer::slice(regions, region_count)?.iter().map(buffer_copy2).collect());
        copy_buffer(command_buffer, src_buffer, dst_buffer, regions)
    }

    fn cmd_copy_buffer2(
        command_buffer: vk::CommandBuffer,
        copy_buffer_info: *const vk::CopyBufferInfo2<'_>,
    ) {
        let info = pointer::input(copy_buffer_info)?;
        let regions = || Ok(pointer::slice(info.p_regions, info.region_count)?.to_vec());
        copy_buffer(command_buffer, info.src_buffer, info.dst_buffer, regions)
    }

    fn cmd_copy_image(
        command_buffer: vk::CommandBuffer,
        src_image: vk::Image,
        _src_image_layout: vk::ImageLayout,
        dst_image: vk::Image,
        _dst_image_layout: vk::ImageLayout,
        region_count: u32,
        regions: *const vk::ImageCopy,
    ) {
        let regions = || Ok(pointer::slice(regions, region_count)?.iter().map(image_copy2).collect());
        copy_image(command_buffer, src_image, dst_image, regions)
    }

    fn cmd_copy_image2(
        command_buffer: vk::CommandBuffer,
        copy_image_info: *const vk::CopyImageInfo2<'_>,
    ) {
        let info = pointer::input(copy_image_info)?;
        let regions = || Ok(pointer::slice(info.p_regions, info.region_count)?.to_vec());
        copy_image(command_buffer, info.src_image, info.dst_image, regions)
    }

    fn cmd_blit_image(
        command_buffer: vk::CommandBuffer,
        src_image: vk::Image,
        _src_image_layout: vk::ImageLayout,
        dst_image: vk::Image,
        _dst_image_layout: vk::ImageLayout,
        region_count: u32,
        regions: *const vk::ImageBlit,
        filter: vk::Filter,
    ) {
        let regions = || Ok(pointer::slice(regions, region_count)?.iter().map(image_blit2).collect());
        blit_image(command_buffer, src_image, dst_image, filter, regions)
    }

    fn cmd_blit_image2(
        command_buffer: vk::CommandBuffer,
        blit_image_info: *const vk::BlitImageInfo2<'_>,
    ) {
        let info = pointer::input(blit_image_info)?;
        let regions = || Ok(pointer::slice(info.p_regions, info.region_count)?.to_vec());
        blit_image(command_buffer, info.src_image, info.dst_image, info.filter, regions)
    }

    fn cmd_resolve_image(
        command_buffer: vk::CommandBuffer,
        src_image: vk::Image,
        _src_image_layout: vk::ImageLayout,
        dst_image: vk::Image,
        _dst_image_layout: vk::ImageLayout,
        region_count: u32,
        regions: *const vk::ImageResolve,
    ) {
        let regions =
            || Ok(pointer::slice(regions, region_count)?.iter().map(image_resolve2).collect());
        resolve_image(command_buffer, src_image, dst_image, regions)
    }

    fn cmd_resolve_image2(
        command_buffer: vk::CommandBuffer,
        resolve_image_info: *const vk::ResolveImageInfo2<'_>,
    ) {
        let info = pointer::input(resolve_image_info)?;
        let regions = || Ok(pointer::slice(info.p_regions, info.region_count)?.to_vec());
        resolve_image(command_buffer, info.src_image, info.dst_image, regions)
    }

    fn cmd_copy_buffer_to_image(
        command_buffer: vk::CommandBuffer,
        src_buffer: vk::Buffer,
        dst_image: vk::Image,
        _dst_image_layout: vk::ImageLayout,
        region_count: u32,
        regions: *const vk::BufferImageCopy,
    ) {
        let regions =
            || Ok(pointer::slice(regions, region_count)?.iter().map(buffer_image_copy2).collect());
        copy_buffer_image(command_buffer, src_buffer, dst_image, true, regions)
    }

    fn cmd_copy_buffer_to_image2(
        command_buffer: vk::CommandBuffer,
        copy_buffer_to_image_info: *const vk::CopyBufferToImageInfo2<'_>,
    ) {
        let info = pointer::input(copy_buffer_to_image_info)?;
        let regions = || Ok(pointer::slice(info.p_regions, info.region_count)?.to_vec());
        copy_buffer_image(command_buffer, info.src_buffer, info.dst_image, true, regions)
    }

    fn cmd_copy_image_to_buffer(
        command_buffer: vk::CommandBuffer,
        src_image: vk::Image,
        _src_image_layout: vk::ImageLayout,
        dst_buffer: vk::Buffer,
        region_count: u32,
        regions: *const vk::BufferImageCopy,
    ) {
        let regions =
            || Ok(pointer::slice(regions, region_count)?.iter().map(buffer_image_copy2).collect());
        copy_buffer_image(command_buffer, dst_buffer, src_image, false, regions)
    }

    fn cmd_copy_image_to_buffer2(
        command_buffer: vk::CommandBuffer,
        copy_image_to_buffer_info: *const vk::CopyImageToBufferInfo2<'_>,
    ) {
        let info = pointer::input(copy_image_to_buffer_info)?;
        let regions = || Ok(pointer::slice(info.p_regions, info.region_count)?.to_vec());
        copy_buffer_image(command_buffer, info.dst_buffer, info.src_image, false, regions)
    }

    fn cmd_fill_buffer(
        command_buffer: vk::CommandBuffer,
        dst_buffer: vk::Buffer,
        dst_offset: vk::DeviceSize,
        size: vk::DeviceSize,
        data: u32,
    ) {
        record(command_buffer, |recorder| {
            recorder.require_outside_pass()?;
            let size = (size != vk::WHOLE_SIZE).then_some(size);
            let packet = transfer::fill_buffer(handle::get(dst_buffer)?, dst_offset, size, data)?;
            recorder.packet(packet);
            Ok(())
        })
    }

    fn cmd_update_buffer(
        command_buffer: vk::CommandBuffer,
        dst_buffer: vk::Buffer,
        dst_offset: vk::DeviceSize,
        data_size: vk::DeviceSize,
        data: *const c_void,
    ) {
        record(command_buffer, |recorder| {
            recorder.require_outside_pass()?;
            if data_size > MAX_UPDATE {
                return Err(Error::usage(
                    "VUID-vkCmdUpdateBuffer-dataSize-00037",
                    format!("dataSize is {data_size}, more than {MAX_UPDATE}"),
                ));
            }
            let data = pointer::slice(data.cast::<u8>(), data_size as u32)?;
            let packet = transfer::update_buffer(handle::get(dst_buffer)?, dst_offset, data)?;
            recorder.packet(packet);
            Ok(())
        })
    }

    fn cmd_clear_color_image(
        command_buffer: vk::CommandBuffer,
        image: vk::Image,
        _image_layout: vk::ImageLayout,
        color: *const vk::ClearColorValue,
        range_count: u32,
        ranges: *const vk::ImageSubresourceRange,
    ) {
        record(command_buffer, |recorder| {
            recorder.require_outside_pass()?;
            let ranges = pointer::slice(ranges, range_count)?;
            let color = *pointer::input(color)?;
            recorder.packet(transfer::clear_color_image(handle::get(image)?, color, ranges)?);
            Ok(())
        })
    }

    fn cmd_clear_depth_stencil_image(
        command_buffer: vk::CommandBuffer,
        image: vk::Image,
        _image_layout: vk::ImageLayout,
        depth_stencil: *const vk::ClearDepthStencilValue,
        range_count: u32,
        ranges: *const vk::ImageSubresourceRange,
    ) {
        record(command_buffer, |recorder| {
            recorder.require_outside_pass()?;
            let ranges = pointer::slice(ranges, range_count)?;
            let value = *pointer::input(depth_stencil)?;
            let packet = transfer::clear_depth_stencil_image(handle::get(image)?, value, ranges)?;
            recorder.packet(packet);
            Ok(())
        })
    }

    fn cmd_clear_attachments(
        command_buffer: vk::CommandBuffer,
        attachment_count: u32,
        attachments: *const vk::ClearAttachment,
        rect_count: u32,
        rects: *const vk::ClearRect,
    ) {
        record(command_buffer, |recorder| {
            recorder.require_pass()?;
            let attachments = pointer::slice(attachments, attachment_count)?;
            let rects = pointer::slice(rects, rect_count)?;
            let mut clears = Vec::new();
            for attachment in attachments {
                let index = attachment.color_attachment as usize;
                let format = if attachment.aspect_mask.contains(vk::ImageAspectFlags::COLOR) {
                    recorder.color_format(index)?
                } else {
                    None
                };
                if let Some(format) = format {
                    let value = rendering::clear_color(format, attachment.clear_value.color);
                    clears.push(AttachmentClear::Color { index, value });
                }
                let value = attachment.clear_value.depth_stencil;
                if attachment.aspect_mask.contains(vk::ImageAspectFlags::DEPTH) {
                    clears.push(AttachmentClear::Depth(value.depth));
                }
                if attachment.aspect_mask.contains(vk::ImageAspectFlags::STENCIL) {
                    clears.push(AttachmentClear::Stencil(value.stencil));
                }
            }
            let rects = rects
                .iter()
                .map(|r| (rendering::rect(r.rect), r.base_array_layer, r.layer_count))
                .collect();
            recorder.packet(Packet::ClearAttachments(ClearAttachments { clears, rects }));
            Ok(())
        })
    }
}

/// Records a copy between buffers; `regions` is called while recording, so that its error is the recording's.
///
/// # Safety
/// The handles are live.
unsafe fn copy_buffer<'a>(
    command_buffer: vk::CommandBuffer,
    source: vk::Buffer,
    target: vk::Buffer,
    regions: impl FnOnce() -> Result<Vec<vk::BufferCopy2<'a>>, Error>,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        record(command_buffer, |recorder| {
            recorder.require_outside_pass()?;
            let (source, target) = (handle::get(source)?, handle::get(target)?);
            recorder.packet(transfer::copy_buffer(source, target, &regions()?)?);
            Ok(())
        })
    }
}

/// Records a copy between images.
///
/// # Safety
/// The handles are live.
unsafe fn copy_image<'a>(
    command_buffer: vk::CommandBuffer,
    source: vk::Image,
    target: vk::Image,
    regions: impl FnOnce() -> Result<Vec<vk::ImageCopy2<'a>>, Error>,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        record(command_buffer, |recorder| {
            recorder.require_outside_pass()?;
            let (source, target) = (handle::get(source)?, handle::get(target)?);
            recorder.packet(transfer::copy_image(source, target, &regions()?)?);
            Ok(())
        })
    }
}

/// Records a blit.
///
/// # Safety
/// The handles are live.
unsafe fn blit_image<'a>(
    command_buffer: vk::CommandBuffer,
    source: vk::Image,
    target: vk::Image,
    filter: vk::Filter,
    regions: impl FnOnce() -> Result<Vec<vk::ImageBlit2<'a>>, Error>,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        record(command_buffer, |recorder| {
            recorder.require_outside_pass()?;
            let (source, target) = (handle::get(source)?, handle::get(target)?);
            recorder.packet(transfer::blit_image(source, target, filter, &regions()?)?);
            Ok(())
        })
    }
}

/// Records a resolve.
///
/// # Safety
/// The handles are live.
unsafe fn resolve_image<'a>(
    command_buffer: vk::CommandBuffer,
    source: vk::Image,
    target: vk::Image,
    regions: impl FnOnce() -> Result<Vec<vk::ImageResolve2<'a>>, Error>,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        record(command_buffer, |recorder| {
            recorder.require_outside_pass()?;
            let (source, target) = (handle::get(source)?, handle::get(target)?);
            recorder.packet(transfer::resolve_image(source, target, &regions()?)?);
            Ok(())
        })
    }
}

/// Records a copy between a buffer and an image.
///
/// # Safety
/// The handles are live.
unsafe fn copy_buffer_image<'a>(
    command_buffer: vk::CommandBuffer,
    buffer: vk::Buffer,
    image: vk::Image,
    to_image: bool,
    regions: impl FnOnce() -> Result<Vec<vk::BufferImageCopy2<'a>>, Error>,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        record(command_buffer, |recorder| {
            recorder.require_outside_pass()?;
            let (buffer, image) = (handle::get(buffer)?, handle::get(image)?);
            let copy = transfer::copy_buffer_image(buffer, image, &regions()?)?;
            recorder.packet(if to_image {
                Packet::CopyBufferToImage(copy)
            } else {
                Packet::CopyImageToBuffer(copy)
            });
            Ok(())
        })
    }
}

fn buffer_copy2(region: &vk::BufferCopy) -> vk::BufferCopy2<'static> {
    vk::BufferCopy2::default()
        .src_offset(region.src_offset)
        .dst_offset(region.dst_offset)
        .size(region.size)
}

fn image_copy2(region: &vk::ImageCopy) -> vk::ImageCopy2<'static> {
    vk::ImageCopy2::default()
        .src_subresource(region.src_subresource)
        .src_offset(region.src_offset)
        .dst_subresource(region.dst_subresource)
        .dst_offset(region.dst_offset)
        .extent(region.extent)
}

fn image_blit2(region: &vk::ImageBlit) -> vk::ImageBlit2<'static> {
    vk::ImageBlit2::default()
        .src_subresource(region.src_subresource)
        .src_offsets(region.src_offsets)
        .dst_subresource(region.dst_subresource)
        .dst_offsets(region.dst_offsets)
}

fn image_resolve2(region: &vk::ImageResolve) -> vk::ImageResolve2<'static> {
    vk::ImageResolve2::default()
        .src_subresource(region.src_subresource)
        .src_offset(region.src_offset)
        .dst_subresource(region.dst_subresource)
        .dst_offset(region.dst_offset)
        .extent(region.extent)
}

fn buffer_image_copy2(region: &vk::BufferImageCopy) -> vk::BufferImageCopy2<'static> {
    vk::BufferImageCopy2::default()
        .buffer_offset(region.buffer_offset)
        .buffer_row_length(region.buffer_row_length)
        .buffer_image_height(region.buffer_image_height)
        .image_subresource(region.image_subresource)
        .image_offset(region.image_offset)
        .image_extent(region.image_extent)
}
