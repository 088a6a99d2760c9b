//! Commands that copy, blit, resolve and clear.

use super::command::record;
use crate::error::Error;
use crate::handle::{self, Handle};
use crate::lower::{rendering, transfer};
use crate::pointer;
use ash::vk;
use simdevice::Packet;
use simdevice::packet::{AttachmentClear, ClearAttachments};
use std::ffi::c_void;

/// The most bytes that `vkCmdUpdateBuffer` takes.
const MAX_UPDATE: u64 = 65_536;

crate::entry_points! {
    #[doc(alias = "vkCmdCopyBuffer")]
    fn cmd_copy_buffer(
        command_buffer: vk::CommandBuffer,
        src_buffer: vk::Buffer,
        dst_buffer: vk::Buffer,
        region_count: u32,
        regions: *const vk::BufferCopy,
    ) {
        let regions = || converted(regions, region_count, buffer_copy2);
        between(command_buffer, src_buffer, dst_buffer, |source, target| {
            transfer::copy_buffer(source, target, &regions()?)
        })
    }

    #[doc(alias = "vkCmdCopyBuffer2")]
    fn cmd_copy_buffer2(
        command_buffer: vk::CommandBuffer,
        copy_buffer_info: *const vk::CopyBufferInfo2<'_>,
    ) {
        let info = pointer::input(copy_buffer_info)?;
        let regions = || pointer::slice(info.p_regions, info.region_count);
        between(command_buffer, info.src_buffer, info.dst_buffer, |source, target| {
            transfer::copy_buffer(source, target, regions()?)
        })
    }

    #[doc(alias = "vkCmdCopyImage")]
    fn cmd_copy_image(
        command_buffer: vk::CommandBuffer,
        src_image: vk::Image,
        _src_image_layout: vk::ImageLayout,
        dst_image: vk::Image,
        _dst_image_layout: vk::ImageLayout,
        region_count: u32,
        regions: *const vk::ImageCopy,
    ) {
        let regions = || converted(regions, region_count, image_copy2);
        between(command_buffer, src_image, dst_image, |source, target| {
            transfer::copy_image(source, target, &regions()?)
        })
    }

    #[doc(alias = "vkCmdCopyImage2")]
    fn cmd_copy_image2(
        command_buffer: vk::CommandBuffer,
        copy_image_info: *const vk::CopyImageInfo2<'_>,
    ) {
        let info = pointer::input(copy_image_info)?;
        let regions = || pointer::slice(info.p_regions, info.region_count);
        between(command_buffer, info.src_image, info.dst_image, |source, target| {
            transfer::copy_image(source, target, regions()?)
        })
    }

    #[doc(alias = "vkCmdBlitImage")]
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
        let regions = || converted(regions, region_count, image_blit2);
        between(command_buffer, src_image, dst_image, |source, target| {
            transfer::blit_image(source, target, filter, &regions()?)
        })
    }

    #[doc(alias = "vkCmdBlitImage2")]
    fn cmd_blit_image2(
        command_buffer: vk::CommandBuffer,
        blit_image_info: *const vk::BlitImageInfo2<'_>,
    ) {
        let info = pointer::input(blit_image_info)?;
        let regions = || pointer::slice(info.p_regions, info.region_count);
        between(command_buffer, info.src_image, info.dst_image, |source, target| {
            transfer::blit_image(source, target, info.filter, regions()?)
        })
    }

    #[doc(alias = "vkCmdResolveImage")]
    fn cmd_resolve_image(
        command_buffer: vk::CommandBuffer,
        src_image: vk::Image,
        _src_image_layout: vk::ImageLayout,
        dst_image: vk::Image,
        _dst_image_layout: vk::ImageLayout,
        region_count: u32,
        regions: *const vk::ImageResolve,
    ) {
        let regions = || converted(regions, region_count, image_resolve2);
        between(command_buffer, src_image, dst_image, |source, target| {
            transfer::resolve_image(source, target, &regions()?)
        })
    }

    #[doc(alias = "vkCmdResolveImage2")]
    fn cmd_resolve_image2(
        command_buffer: vk::CommandBuffer,
        resolve_image_info: *const vk::ResolveImageInfo2<'_>,
    ) {
        let info = pointer::input(resolve_image_info)?;
        let regions = || pointer::slice(info.p_regions, info.region_count);
        between(command_buffer, info.src_image, info.dst_image, |source, target| {
            transfer::resolve_image(source, target, regions()?)
        })
    }

    #[doc(alias = "vkCmdCopyBufferToImage")]
    fn cmd_copy_buffer_to_image(
        command_buffer: vk::CommandBuffer,
        src_buffer: vk::Buffer,
        dst_image: vk::Image,
        _dst_image_layout: vk::ImageLayout,
        region_count: u32,
        regions: *const vk::BufferImageCopy,
    ) {
        let regions = || converted(regions, region_count, buffer_image_copy2);
        between(command_buffer, src_buffer, dst_image, |buffer, image| {
            let copy = transfer::copy_buffer_image(buffer, image, &regions()?)?;
            Ok(Packet::CopyBufferToImage(copy))
        })
    }

    #[doc(alias = "vkCmdCopyBufferToImage2")]
    fn cmd_copy_buffer_to_image2(
        command_buffer: vk::CommandBuffer,
        copy_buffer_to_image_info: *const vk::CopyBufferToImageInfo2<'_>,
    ) {
        let info = pointer::input(copy_buffer_to_image_info)?;
        let regions = || pointer::slice(info.p_regions, info.region_count);
        between(command_buffer, info.src_buffer, info.dst_image, |buffer, image| {
            let copy = transfer::copy_buffer_image(buffer, image, regions()?)?;
            Ok(Packet::CopyBufferToImage(copy))
        })
    }

    #[doc(alias = "vkCmdCopyImageToBuffer")]
    fn cmd_copy_image_to_buffer(
        command_buffer: vk::CommandBuffer,
        src_image: vk::Image,
        _src_image_layout: vk::ImageLayout,
        dst_buffer: vk::Buffer,
        region_count: u32,
        regions: *const vk::BufferImageCopy,
    ) {
        let regions = || converted(regions, region_count, buffer_image_copy2);
        between(command_buffer, src_image, dst_buffer, |image, buffer| {
            let copy = transfer::copy_buffer_image(buffer, image, &regions()?)?;
            Ok(Packet::CopyImageToBuffer(copy))
        })
    }

    #[doc(alias = "vkCmdCopyImageToBuffer2")]
    fn cmd_copy_image_to_buffer2(
        command_buffer: vk::CommandBuffer,
        copy_image_to_buffer_info: *const vk::CopyImageToBufferInfo2<'_>,
    ) {
        let info = pointer::input(copy_image_to_buffer_info)?;
        let regions = || pointer::slice(info.p_regions, info.region_count);
        between(command_buffer, info.src_image, info.dst_buffer, |image, buffer| {
            let copy = transfer::copy_buffer_image(buffer, image, regions()?)?;
            Ok(Packet::CopyImageToBuffer(copy))
        })
    }

    #[doc(alias = "vkCmdFillBuffer")]
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

    #[doc(alias = "vkCmdUpdateBuffer")]
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

    #[doc(alias = "vkCmdClearColorImage")]
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

    #[doc(alias = "vkCmdClearDepthStencilImage")]
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

    #[doc(alias = "vkCmdClearAttachments")]
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
                .map(|r| (rendering::rect(r.rect), r.base_array_layer, r.layer_count));
            let rects = simdevice::host::collect(rects);
            recorder.packet(Packet::ClearAttachments(ClearAttachments { clears, rects }));
            Ok(())
        })
    }
}

/// Records what `lower` makes of two objects; it is called while recording, so that its error is the recording's.
///
/// # Safety
/// The handles are live.
unsafe fn between<S: Handle, T: Handle>(
    command_buffer: vk::CommandBuffer,
    source: S,
    target: T,
    lower: impl FnOnce(&S::Object, &T::Object) -> Result<Packet, Error>,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        record(command_buffer, |recorder| {
            recorder.require_outside_pass()?;
            let (source, target) = (handle::get(source)?, handle::get(target)?);
            recorder.packet(lower(source, target)?);
            Ok(())
        })
    }
}

/// Regions in the form of `vkCmd*2`.
///
/// # Safety
/// `regions` points at `count` of them.
unsafe fn converted<T, U>(
    regions: *const T,
    count: u32,
    convert: fn(&T) -> U,
) -> Result<Vec<U>, Error> {
    // SAFETY: the caller's promise.
    let regions = unsafe { pointer::slice(regions, count)? };
    Ok(simdevice::host::collect(regions.iter().map(convert)))
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
