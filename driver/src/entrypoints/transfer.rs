//! Commands that copy, blit, resolve and clear.

use crate::command::recorder::Recorder;
use crate::error::Error;
use crate::handle;
use crate::lower::{rendering, transfer};
use crate::object::buffer::Buffer;
use crate::object::image::Image;
use crate::pointer;
use ash::vk;
use simdevice::Packet;
use simdevice::packet::{AttachmentClear, ClearAttachments};
use std::ffi::c_void;
use std::sync::Arc;

/// The most bytes that `vkCmdUpdateBuffer` takes.
const MAX_UPDATE: u64 = 65_536;

/// # Safety
/// The info is valid, and its handles are live.
#[doc(alias = "vkCmdCopyBuffer2")]
pub(crate) unsafe fn cmd_copy_buffer2(
    recorder: &mut Recorder,
    copy_buffer_info: &vk::CopyBufferInfo2<'_>,
) -> Result<(), Error> {
    let info = copy_buffer_info;
    // SAFETY: the caller's promise.
    let (regions, source, target) = unsafe {
        (
            pointer::slice(info.p_regions, info.region_count)?,
            handle::get(info.src_buffer)?,
            handle::get(info.dst_buffer)?,
        )
    };
    recorder.require_outside_pass()?;
    recorder.packet(transfer::copy_buffer(source, target, regions)?);
    Ok(())
}

/// # Safety
/// The info is valid, and its handles are live.
#[doc(alias = "vkCmdCopyImage2")]
pub(crate) unsafe fn cmd_copy_image2(
    recorder: &mut Recorder,
    copy_image_info: &vk::CopyImageInfo2<'_>,
) -> Result<(), Error> {
    let info = copy_image_info;
    // SAFETY: the caller's promise.
    let (regions, source, target) = unsafe {
        (
            pointer::slice(info.p_regions, info.region_count)?,
            handle::get(info.src_image)?,
            handle::get(info.dst_image)?,
        )
    };
    recorder.require_outside_pass()?;
    recorder.packet(transfer::copy_image(source, target, regions)?);
    Ok(())
}

/// # Safety
/// The info is valid, and its handles are live.
#[doc(alias = "vkCmdBlitImage2")]
pub(crate) unsafe fn cmd_blit_image2(
    recorder: &mut Recorder,
    blit_image_info: &vk::BlitImageInfo2<'_>,
) -> Result<(), Error> {
    let info = blit_image_info;
    // SAFETY: the caller's promise.
    let (regions, source, target) = unsafe {
        (
            pointer::slice(info.p_regions, info.region_count)?,
            handle::get(info.src_image)?,
            handle::get(info.dst_image)?,
        )
    };
    recorder.require_outside_pass()?;
    recorder.packet(transfer::blit_image(source, target, info.filter, regions)?);
    Ok(())
}

/// # Safety
/// The info is valid, and its handles are live.
#[doc(alias = "vkCmdResolveImage2")]
pub(crate) unsafe fn cmd_resolve_image2(
    recorder: &mut Recorder,
    resolve_image_info: &vk::ResolveImageInfo2<'_>,
) -> Result<(), Error> {
    let info = resolve_image_info;
    // SAFETY: the caller's promise.
    let (regions, source, target) = unsafe {
        (
            pointer::slice(info.p_regions, info.region_count)?,
            handle::get(info.src_image)?,
            handle::get(info.dst_image)?,
        )
    };
    recorder.require_outside_pass()?;
    recorder.packet(transfer::resolve_image(source, target, regions)?);
    Ok(())
}

/// # Safety
/// The info is valid, and its handles are live.
#[doc(alias = "vkCmdCopyBufferToImage2")]
pub(crate) unsafe fn cmd_copy_buffer_to_image2(
    recorder: &mut Recorder,
    copy_buffer_to_image_info: &vk::CopyBufferToImageInfo2<'_>,
) -> Result<(), Error> {
    let info = copy_buffer_to_image_info;
    // SAFETY: the caller's promise.
    let (regions, buffer, image) = unsafe {
        (
            pointer::slice(info.p_regions, info.region_count)?,
            handle::get(info.src_buffer)?,
            handle::get(info.dst_image)?,
        )
    };
    recorder.require_outside_pass()?;
    recorder.packet(Packet::CopyBufferToImage(transfer::copy_buffer_image(
        buffer, image, regions,
    )?));
    Ok(())
}

/// # Safety
/// The info is valid, and its handles are live.
#[doc(alias = "vkCmdCopyImageToBuffer2")]
pub(crate) unsafe fn cmd_copy_image_to_buffer2(
    recorder: &mut Recorder,
    copy_image_to_buffer_info: &vk::CopyImageToBufferInfo2<'_>,
) -> Result<(), Error> {
    let info = copy_image_to_buffer_info;
    // SAFETY: the caller's promise.
    let (regions, image, buffer) = unsafe {
        (
            pointer::slice(info.p_regions, info.region_count)?,
            handle::get(info.src_image)?,
            handle::get(info.dst_buffer)?,
        )
    };
    recorder.require_outside_pass()?;
    recorder.packet(Packet::CopyImageToBuffer(transfer::copy_buffer_image(
        buffer, image, regions,
    )?));
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
    let packet = transfer::fill_buffer(dst_buffer, dst_offset, size, data)?;
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
    let data = unsafe { pointer::slice(data.cast::<u8>(), data_size as u32)? };
    recorder.packet(transfer::update_buffer(dst_buffer, dst_offset, data)?);
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
    recorder.packet(transfer::clear_color_image(image, color, ranges)?);
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
    let packet = transfer::clear_depth_stencil_image(image, value, ranges)?;
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
            let value = rendering::clear_color(format, color);
            clears.push(AttachmentClear::Color { index, value });
        }
        // SAFETY: as above.
        let value = unsafe { attachment.clear_value.depth_stencil };
        if attachment.aspect_mask.contains(vk::ImageAspectFlags::DEPTH) {
            clears.push(AttachmentClear::Depth(value.depth));
        }
        if attachment
            .aspect_mask
            .contains(vk::ImageAspectFlags::STENCIL)
        {
            clears.push(AttachmentClear::Stencil(value.stencil));
        }
    }
    let rects = rects
        .iter()
        .map(|r| (rendering::rect(r.rect), r.base_array_layer, r.layer_count));
    let rects = simdevice::host::collect(rects);
    recorder.packet(Packet::ClearAttachments(ClearAttachments { clears, rects }));
    Ok(())
}
