//! Render passes and framebuffers.

use crate::error::Error;
use crate::lower::rendering;
use crate::object::render_pass::{
    AttachmentDescription, DepthStencilResolve, Framebuffer, RenderPass, Subpass,
};
use crate::{handle, pnext, pointer};
use ash::vk;
use std::sync::Arc;

crate::entry_points! {
    #[doc(alias = "vkCreateRenderPass")]
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
        let mut object_subpasses = simdevice::host::with_capacity(subpasses.len());
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

    #[doc(alias = "vkCreateRenderPass2")]
    fn create_render_pass2(
        _device: vk::Device,
        create_info: *const vk::RenderPassCreateInfo2<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        render_pass: *mut vk::RenderPass,
    ) -> vk::Result {
        let info = pointer::input(create_info)?;
        let attachments = pointer::slice(info.p_attachments, info.attachment_count)?;
        let subpasses = pointer::slice(info.p_subpasses, info.subpass_count)?;
        let mut object_subpasses = simdevice::host::with_capacity(subpasses.len());
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

    /// Any area is as good as any other.
    #[doc(alias = "vkGetRenderAreaGranularity")]
    fn get_render_area_granularity(
        _device: vk::Device,
        _render_pass: vk::RenderPass,
        granularity: *mut vk::Extent2D,
    ) {
        pointer::output(granularity, vk::Extent2D { width: 1, height: 1 })
    }

    #[doc(alias = "vkCreateFramebuffer")]
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

/// A subpass of `vkCreateRenderPass`.
///
/// # Safety
/// The description's pointers are valid.
unsafe fn new_subpass(subpass: &vk::SubpassDescription<'_>) -> Result<Subpass, Error> {
    // SAFETY: the caller's promise.
    let (color, resolve, input, depth_stencil) = unsafe {
        let count = subpass.color_attachment_count;
        let has_resolve = !subpass.p_resolve_attachments.is_null();
        let resolve_count = if has_resolve { count } else { 0 };
        (
            pointer::slice(subpass.p_color_attachments, count)?,
            pointer::slice(subpass.p_resolve_attachments, resolve_count)?,
            pointer::slice(subpass.p_input_attachments, subpass.input_attachment_count)?,
            pointer::optional(subpass.p_depth_stencil_attachment),
        )
    };
    let all = |references: &[vk::AttachmentReference]| {
        references.iter().map(|r| used(r.attachment)).collect()
    };
    Ok(Subpass {
        color: all(color),
        resolve: all(resolve),
        depth_stencil: depth_stencil.and_then(|r| used(r.attachment)),
        depth_stencil_resolve: None,
        input: all(input),
    })
}

/// A subpass of `vkCreateRenderPass2`.
///
/// # Safety
/// The description's pointers and chain are valid.
unsafe fn new_subpass2(subpass: &vk::SubpassDescription2<'_>) -> Result<Subpass, Error> {
    refuse_multiview(subpass.view_mask)?;
    // SAFETY: the caller's promise.
    let (color, resolve, input, depth_stencil, depth_stencil_resolve) = unsafe {
        let count = subpass.color_attachment_count;
        let has_resolve = !subpass.p_resolve_attachments.is_null();
        let resolve_count = if has_resolve { count } else { 0 };
        (
            pointer::slice(subpass.p_color_attachments, count)?,
            pointer::slice(subpass.p_resolve_attachments, resolve_count)?,
            pointer::slice(subpass.p_input_attachments, subpass.input_attachment_count)?,
            pointer::optional(subpass.p_depth_stencil_attachment),
            match pnext::find(subpass.p_next) {
                Some(info) => new_depth_stencil_resolve(info)?,
                None => None,
            },
        )
    };
    let all = |references: &[vk::AttachmentReference2<'_>]| {
        references.iter().map(|r| used(r.attachment)).collect()
    };
    Ok(Subpass {
        color: all(color),
        resolve: all(resolve),
        depth_stencil: depth_stencil.and_then(|r| used(r.attachment)),
        depth_stencil_resolve,
        input: all(input),
    })
}

/// How a subpass resolves depth and stencil, if it does.
///
/// # Safety
/// The structure's pointers are valid.
unsafe fn new_depth_stencil_resolve(
    info: &vk::SubpassDescriptionDepthStencilResolve<'_>,
) -> Result<Option<DepthStencilResolve>, Error> {
    // SAFETY: the caller's promise.
    let reference = unsafe { pointer::optional(info.p_depth_stencil_resolve_attachment) };
    let Some(attachment) = reference.and_then(|r| used(r.attachment)) else {
        return Ok(None);
    };
    Ok(Some(DepthStencilResolve {
        attachment,
        depth: rendering::resolve_mode(info.depth_resolve_mode)?,
        stencil: rendering::resolve_mode(info.stencil_resolve_mode)?,
    }))
}
