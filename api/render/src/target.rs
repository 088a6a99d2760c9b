//! The images that a frame is drawn to, and the copy to the host.

use std::sync::Arc;

use ash::vk;

use crate::device::Device;
use crate::error::RenderError;
use crate::modes::Kept;
use crate::resource::{Buffer, Image, Memory};

/// The colour attachment's format, which stores a draw's result unchanged.
pub const COLOR_FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;

/// The format of the attachment by which triangles hide Gaussians.
pub(crate) const DEPTH_FORMAT: vk::Format = vk::Format::D32_SFLOAT;

/// The images and buffers of a frame.
pub struct Target {
    /// The colour attachment.
    pub image: Image,
    /// The buffer in host memory to which the pixels are copied.
    pub readback: Buffer,
    /// The attachment of a kept value and its buffer, if one is kept.
    pub(crate) kept: Option<(Kept, Image, Buffer)>,
    /// The depth attachment, if triangles are drawn.
    pub(crate) tested: Option<Image>,
}

/// Checks that the device can draw a picture of this size.
///
/// # Errors
/// [`RenderError::Size`] if it cannot.
pub fn check_size(device: &Device, width: u32, height: u32) -> Result<(), RenderError> {
    let max = device.max_size();
    if !(1..=max).contains(&width) || !(1..=max).contains(&height) {
        return Err(RenderError::Size { width, height, max });
    }
    Ok(())
}

impl Target {
    /// A target of [`COLOR_FORMAT`].
    ///
    /// # Errors
    /// If there is no memory for it, or Vulkan fails.
    pub fn new(device: &Arc<Device>, width: u32, height: u32) -> Result<Self, RenderError> {
        Self::keeping(device, width, height, None, false)
    }

    /// A target with an attachment for a kept value of pixels, or with a depth attachment for tests.
    pub(crate) fn keeping(
        device: &Arc<Device>,
        width: u32,
        height: u32,
        kept: Option<Kept>,
        tested: bool,
    ) -> Result<Self, RenderError> {
        let extent = vk::Extent2D { width, height };
        let image = |format| {
            let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT
                | vk::ImageUsageFlags::TRANSFER_SRC
                | vk::ImageUsageFlags::TRANSFER_DST;
            Image::new(device, extent, format, usage)
        };
        let readback = |pixel: usize| {
            let bytes = u64::from(width) * u64::from(height) * pixel as u64;
            let usage = vk::BufferUsageFlags::TRANSFER_DST;
            Buffer::new(device, bytes, usage, Memory::HostCached)
        };
        Ok(Self {
            image: image(COLOR_FORMAT)?,
            readback: readback(size_of::<[f32; 4]>())?,
            kept: match kept {
                Some(kept) => Some((kept, image(kept.format())?, readback(size_of::<[f32; 2]>())?)),
                None => None,
            },
            tested: if tested {
                let usage = vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT;
                Some(Image::new(device, extent, DEPTH_FORMAT, usage)?)
            } else {
                None
            },
        })
    }
}

/// Copies the drawn picture, and the kept values if there are any, to the buffers that the host reads.
pub fn record_copy(device: &Device, commands: vk::CommandBuffer, target: &Target) {
    copy_image(device, commands, &target.image, &target.readback);
    if let Some((_, image, readback)) = &target.kept {
        copy_image(device, commands, image, readback);
    }
}

/// Copies an image, which is in the layout of a colour attachment, to a buffer that the host reads.
pub fn copy_image(device: &Device, commands: vk::CommandBuffer, image: &Image, readback: &Buffer) {
    let to_source = image
        .barrier(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL, vk::ImageLayout::TRANSFER_SRC_OPTIMAL)
        .src_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE)
        .dst_access_mask(vk::AccessFlags::TRANSFER_READ);
    let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
    let region = vk::BufferImageCopy::default().image_subresource(layers).image_extent(image.extent().into());
    let to_host = vk::MemoryBarrier::default()
        .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
        .dst_access_mask(vk::AccessFlags::HOST_READ);
    let raw = device.raw();
    // SAFETY: the command buffer is recording; the buffer holds the whole image without gaps, and
    // both live until the submission has ended.
    unsafe {
        raw.cmd_pipeline_barrier(
            commands,
            vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT,
            vk::PipelineStageFlags::TRANSFER,
            vk::DependencyFlags::empty(),
            &[],
            &[],
            &[to_source],
        );
        raw.cmd_copy_image_to_buffer(
            commands,
            image.handle(),
            vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            readback.handle(),
            &[region],
        );
        raw.cmd_pipeline_barrier(
            commands,
            vk::PipelineStageFlags::TRANSFER,
            vk::PipelineStageFlags::HOST,
            vk::DependencyFlags::empty(),
            &[to_host],
            &[],
            &[],
        );
    }
}
