//! Render passes and framebuffers.

use crate::error::Error;
use crate::object::render_pass::{AttachmentDescription, Framebuffer, RenderPass, Subpass};
use crate::{handle, pnext, pointer};
use ash::vk;
use std::sync::Arc;

crate::entry_points! {
    fn create_render_pass(
        _device: vk::Device,
        create_info: *const vk::RenderPassCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        render_pass: *mut vk::RenderPass,
    ) -> vk::Result {
        let info = pointer::input(create_info)?;
        if let Some(multiview) = pnext::find::<vk::RenderPassMultiviewCreateInfo>(info.p_next) {
            let masks = pointer::slice(multiview.p_view_masks, multiview.subpass_count)?;
            masks.iter().try_for_each(|&mask| refuse_multiview(mask))?;
        }
        let attachments = pointer::slice(info.p_attachments, info.attachment_count)?;
        let subpasses = pointer::slice(info.p_subpasses, info.subpass_count)?;
        let mut object_subpasses = Vec::with_capacity(subpasses.len());
        for subpass in subpasses {
            object_subpasses.push(new_subpass(subpass)?);
        }
        let attachments = attachments.iter().map(|attachment| AttachmentDescription {
            format: attachment.format,
            load: attachment.load_op,
            store: attachment.store_op,
            stencil_load: attachment.stencil_load_op,
            stencil_store: attachment.stencil_store_op,
        });
        let object = RenderPass::new(attachments.collect(), object_subpasses)?;
        pointer::output(render_pass, handle::create(Arc::new(object)))
    }

    fn create_render_pass2(
        _device: vk::Device,
        create_info: *const vk::RenderPassCreateInfo2<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        render_pass: *mut vk::RenderPass,
    ) -> vk::Result {
        let info = pointer::input(create_info)?;
        let attachments = pointer::slice(info.p_attachments, info.attachment_count)?;
        let subpasses = pointer::slice(info.p_subpasses, info.subpass_count)?;
        let mut object_subpasses = Vec::with_capacity(subpasses.len());
        for subpass in subpasses {
            object_subpasses.push(new_subpass2(subpass)?);
        }
        let attachments = attachments.iter().map(|attachment| AttachmentDescription {
            format: attachment.format,
            load: attachment.load_op,
            store: attachment.store_op,
            stencil_load: attachment.stencil_load_op,
            stencil_store: attachment.stencil_store_op,
        });
        let object = RenderPass::new(attachments.collect(), object_subpasses)?;
        pointer::output(render_pass, handle::create(Arc::new(object)))
    }

    fn destroy_render_pass(
        _device: vk::Device,
        render_pass: vk::RenderPass,
        _allocator: *const vk::AllocationCallbacks<'_>,
    ) {
        handle::destroy(render_pass).map(drop)
    }

    /// Any area is as good as any other.
    fn get_render_area_granularity(
        _device: vk::Device,
        _render_pass: vk::RenderPass,
        granularity: *mut vk::Extent2D,
    ) {
        pointer::output(granularity, vk::Extent2D { width: 1, height: 1 })
    }

    fn create_framebuffer(
        _device: vk::Device,
        create_info: *const vk::FramebufferCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        framebuffer: *mut vk::Framebuffer,
    ) -> vk::Result {
        let info = pointer::input(create_info)?;
        let views = if info.flags.contains(vk::FramebufferCreateFlags::IMAGELESS) {
            None
        } else {
            Some(handle::get_all(pointer::slice(info.p_attachments, info.attachment_count)?)?)
        };
        let object = Framebuffer {
            views,
            extent: vk::Extent2D { width: info.width, height: info.height },
            layers: info.layers,
        };
        pointer::output(framebuffer, handle::create(Arc::new(object)))
    }

    fn destroy_framebuffer(
        _device: vk::Device,
        framebuffer: vk::Framebuffer,
        _allocator: *const vk::AllocationCallbacks<'_>,
    ) {
        handle::destroy(framebuffer).map(drop)
    }
}

/// A reference's attachment, if it is used.
fn used(attachment: u32) -> Option<usize> {
    (attachment != vk::ATTACHMENT_UNUSED).then_some(attachment as usize)
}

fn refuse_multiview(view_mask: u32) -> Result<(), Error> {
    if view_mask == 0 {
        return Ok(());
    }
    Err(Error::FeatureNotPresent(
        "a view mask (feature multiview)".into(),
    ))
}

/// Resolving needs attachments of several samples, which there aren't.
fn refuse_resolve(is_used: bool) -> Result<(), Error> {
    if is_used {
        return Err(Error::FeatureNotPresent(
            "a resolve attachment (images have one sample)".into(),
        ));
    }
    Ok(())
}

/// A subpass of `vkCreateRenderPass`.
///
/// # Safety
/// The description's pointers are valid.
unsafe fn new_subpass(subpass: &vk::SubpassDescription<'_>) -> Result<Subpass, Error> {
    // SAFETY: the caller's promise.
    let (color, depth_stencil) = unsafe {
        let count = subpass.color_attachment_count;
        let has_resolve = !subpass.p_resolve_attachments.is_null();
        let resolve_count = if has_resolve { count } else { 0 };
        let resolve = pointer::slice(subpass.p_resolve_attachments, resolve_count)?;
        refuse_resolve(resolve.iter().any(|r| used(r.attachment).is_some()))?;
        (
            pointer::slice(subpass.p_color_attachments, count)?,
            pointer::optional(subpass.p_depth_stencil_attachment),
        )
    };
    Ok(Subpass {
        color: color.iter().map(|r| used(r.attachment)).collect(),
        depth_stencil: depth_stencil.and_then(|r| used(r.attachment)),
    })
}

/// A subpass of `vkCreateRenderPass2`.
///
/// # Safety
/// The description's pointers are valid.
unsafe fn new_subpass2(subpass: &vk::SubpassDescription2<'_>) -> Result<Subpass, Error> {
    refuse_multiview(subpass.view_mask)?;
    // SAFETY: the caller's promise.
    let (color, depth_stencil) = unsafe {
        let count = subpass.color_attachment_count;
        let has_resolve = !subpass.p_resolve_attachments.is_null();
        let resolve_count = if has_resolve { count } else { 0 };
        let resolve = pointer::slice(subpass.p_resolve_attachments, resolve_count)?;
        refuse_resolve(resolve.iter().any(|r| used(r.attachment).is_some()))?;
        (
            pointer::slice(subpass.p_color_attachments, count)?,
            pointer::optional(subpass.p_depth_stencil_attachment),
        )
    };
    Ok(Subpass {
        color: color.iter().map(|r| used(r.attachment)).collect(),
        depth_stencil: depth_stencil.and_then(|r| used(r.attachment)),
    })
}
