//! Commands that begin and end render passes and dynamic rendering.

use crate::command::recorder::Recorder;
use crate::error::Error;
use crate::lower::rendering::{self, BegunPass, DynamicAttachment, DynamicRendering, rect};
use crate::{handle, pnext, pointer};
use ash::vk;
use simdevice::state::Rect;
use std::sync::Arc;

/// # Safety
/// The info, its chain and its handles are valid.
#[doc(alias = "vkCmdBeginRenderPass")]
#[doc(alias = "vkCmdBeginRenderPass2")]
pub(crate) unsafe fn cmd_begin_render_pass(
    recorder: &mut Recorder,
    render_pass_begin: &vk::RenderPassBeginInfo<'_>,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    recorder.begin_render_pass(unsafe { begun_pass(render_pass_begin)? })
}

#[doc(alias = "vkCmdNextSubpass")]
#[doc(alias = "vkCmdNextSubpass2")]
pub(crate) fn cmd_next_subpass(recorder: &mut Recorder) -> Result<(), Error> {
    recorder.next_subpass()
}

#[doc(alias = "vkCmdEndRenderPass")]
#[doc(alias = "vkCmdEndRenderPass2")]
pub(crate) fn cmd_end_render_pass(recorder: &mut Recorder) -> Result<(), Error> {
    recorder.end_render_pass()
}

/// # Safety
/// The info and its handles are valid.
#[doc(alias = "vkCmdBeginRendering")]
pub(crate) unsafe fn cmd_begin_rendering(
    recorder: &mut Recorder,
    rendering_info: &vk::RenderingInfo<'_>,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    let rendering = unsafe { dynamic_rendering(rendering_info)? };
    recorder.begin_rendering(rendering.packet()?)
}

#[doc(alias = "vkCmdEndRendering")]
pub(crate) fn cmd_end_rendering(recorder: &mut Recorder) -> Result<(), Error> {
    recorder.end_rendering()
}

/// The render pass that a begin info begins.
///
/// # Safety
/// The info, its chain and its handles are valid.
unsafe fn begun_pass(info: &vk::RenderPassBeginInfo<'_>) -> Result<BegunPass, Error> {
    // SAFETY: the caller's promise.
    unsafe {
        let framebuffer = handle::get(info.framebuffer)?;
        let views = match &framebuffer.views {
            Some(views) => views.clone(),
            None => match pnext::find::<vk::RenderPassAttachmentBeginInfo>(info.p_next) {
                Some(info) => {
                    handle::get_all(pointer::slice(info.p_attachments, info.attachment_count)?)?
                }
                None => Vec::new(),
            },
        };
        let whole = Rect {
            x: 0,
            y: 0,
            width: framebuffer.extent.width,
            height: framebuffer.extent.height,
        };
        Ok(BegunPass {
            render_pass: Arc::clone(handle::get(info.render_pass)?),
            views,
            clear_values: pointer::slice(info.p_clear_values, info.clear_value_count)?.to_vec(),
            area: rect(info.render_area).intersect(whole),
            layers: framebuffer.layers,
        })
    }
}

/// The dynamic rendering that an info describes.
///
/// # Safety
/// The info and its handles are valid.
unsafe fn dynamic_rendering(info: &vk::RenderingInfo<'_>) -> Result<DynamicRendering, Error> {
    if info.view_mask != 0 {
        return Err(Error::FeatureNotPresent(
            "a view mask (feature multiview)".into(),
        ));
    }
    // SAFETY: the caller's promise.
    unsafe {
        let color = pointer::slice(info.p_color_attachments, info.color_attachment_count)?;
        let depth_stencil = |pointer| match pointer::optional(pointer) {
            Some(info) => attachment(info),
            None => Ok(None),
        };
        Ok(DynamicRendering {
            flags: info.flags,
            area: info.render_area,
            layers: info.layer_count,
            color: color
                .iter()
                .map(|info| attachment(info))
                .collect::<Result<_, _>>()?,
            depth: depth_stencil(info.p_depth_attachment)?,
            stencil: depth_stencil(info.p_stencil_attachment)?,
        })
    }
}

/// An attachment of dynamic rendering, if it is used.
///
/// # Safety
/// The info's handles are live.
unsafe fn attachment(
    info: &vk::RenderingAttachmentInfo<'_>,
) -> Result<Option<DynamicAttachment>, Error> {
    let mode = rendering::resolve_mode(info.resolve_mode)?;
    // SAFETY: the caller's promise; without a mode there may be anything in place of a view.
    let (view, resolve_view) = unsafe {
        let resolve_view = match mode {
            Some(_) => handle::get_optional(info.resolve_image_view)?,
            None => None,
        };
        (handle::get_optional(info.image_view)?, resolve_view)
    };
    Ok(view.map(|view| DynamicAttachment {
        view: Arc::clone(view),
        load: info.load_op,
        store: info.store_op,
        clear_value: info.clear_value,
        resolve: resolve_view.map(Arc::clone).zip(mode),
    }))
}
