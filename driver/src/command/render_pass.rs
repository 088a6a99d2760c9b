//! Commands that begin and end render passes and dynamic rendering.

use super::buffer::Recorder;
use super::render_scope::{
    DynamicAttachment, DynamicRendering, RenderPassInstance, RenderScope, ResolveTo, color_formats,
};
use crate::abi::error::Error;
use crate::abi::handle;
use crate::abi::valid;
use crate::convert::{self, rect};
use crate::render_pass;
use ash::vk;
use simdevice::Packet;
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
    let instance = unsafe { render_pass_instance(render_pass_begin)? };
    recorder.require_outside_pass()?;
    enter_subpass(recorder, Box::new(instance), 0)
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
    begin_rendering(recorder, rendering.packet()?)
}

/// The render pass instance that a begin info describes.
///
/// # Safety
/// The info, its chain and its handles are valid.
unsafe fn render_pass_instance(info: &vk::RenderPassBeginInfo<'_>) -> Result<RenderPassInstance, Error> {
    // SAFETY: the caller's promise.
    unsafe {
        let framebuffer = handle::get(info.framebuffer)?;
        let views = match &framebuffer.views {
            Some(views) => views.clone(),
            None => match valid::find_in_chain::<vk::RenderPassAttachmentBeginInfo>(info.p_next) {
                Some(info) => handle::get_all(valid::slice(info.p_attachments, info.attachment_count)?)?,
                None => Vec::new(),
            },
        };
        let whole = Rect { x: 0, y: 0, width: framebuffer.extent.width, height: framebuffer.extent.height };
        Ok(RenderPassInstance {
            render_pass: Arc::clone(handle::get(info.render_pass)?),
            views,
            clear_values: valid::slice(info.p_clear_values, info.clear_value_count)?.to_vec(),
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
    // SAFETY: the caller's promise.
    unsafe {
        let color = valid::slice(info.p_color_attachments, info.color_attachment_count)?;
        let depth_stencil = |pointer| match valid::optional(pointer) {
            Some(info) => attachment(info),
            None => Ok(None),
        };
        let chained = valid::find_in_chain::<vk::MultisampledRenderToSingleSampledInfoEXT<'_>>(info.p_next);
        let samples = chained.map(render_pass::samples).transpose()?.flatten();
        let is_in_parts = vk::RenderingFlags::SUSPENDING | vk::RenderingFlags::RESUMING;
        if samples.is_some() && info.flags.intersects(is_in_parts) {
            return Err(Error::FeatureNotPresent(
                "rendering with several samples to attachments of one, suspended or resumed".into(),
            ));
        }
        Ok(DynamicRendering {
            samples,
            flags: info.flags,
            area: info.render_area,
            layers: info.layer_count,
            view_mask: info.view_mask,
            color: color.iter().map(|info| attachment(info)).collect::<Result<_, _>>()?,
            depth: depth_stencil(info.p_depth_attachment)?,
            stencil: depth_stencil(info.p_stencil_attachment)?,
        })
    }
}

/// An attachment of dynamic rendering; None if it is unused.
///
/// # Safety
/// The info's handles are live.
unsafe fn attachment(info: &vk::RenderingAttachmentInfo<'_>) -> Result<Option<DynamicAttachment>, Error> {
    let mode = convert::resolve_mode(info.resolve_mode)?;
    // SAFETY: the caller's promise. Without a resolve mode the view may be invalid, and is not followed.
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
        mode,
        resolve: resolve_view.zip(mode).map(|(view, mode)| ResolveTo { target: Arc::clone(view), mode }),
    }))
}

#[doc(alias = "vkCmdNextSubpass")]
#[doc(alias = "vkCmdNextSubpass2")]
pub(crate) fn cmd_next_subpass(recorder: &mut Recorder) -> Result<(), Error> {
    recorder.require_no_gaussian_set()?;
    match recorder.pass.take() {
        Some(RenderScope::RenderPass { instance, subpass, .. }) => {
            recorder.packet(Packet::EndRendering);
            enter_subpass(recorder, instance, subpass + 1)
        }
        other => {
            recorder.pass = other;
            Err(not_begun("a render pass"))
        }
    }
}

fn enter_subpass(recorder: &mut Recorder, instance: Box<RenderPassInstance>, subpass: usize) -> Result<(), Error> {
    let packet = instance.subpass(subpass)?;
    for clear in instance.clears_before_reads(subpass)? {
        recorder.packet(clear);
    }
    let formats = color_formats(&packet);
    recorder.packet(packet);
    recorder.pass = Some(RenderScope::RenderPass { instance, subpass, formats });
    Ok(())
}

#[doc(alias = "vkCmdEndRenderPass")]
#[doc(alias = "vkCmdEndRenderPass2")]
pub(crate) fn cmd_end_render_pass(recorder: &mut Recorder) -> Result<(), Error> {
    recorder.require_no_gaussian_set()?;
    match recorder.pass.take() {
        Some(RenderScope::RenderPass { .. }) => {
            recorder.packet(Packet::EndRendering);
            Ok(())
        }
        other => {
            recorder.pass = other;
            Err(not_begun("a render pass"))
        }
    }
}

/// Begins dynamic rendering by its packet.
fn begin_rendering(recorder: &mut Recorder, packet: Packet) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    recorder.pass = Some(RenderScope::Dynamic { formats: color_formats(&packet) });
    recorder.packet(packet);
    Ok(())
}

#[doc(alias = "vkCmdEndRendering")]
pub(crate) fn cmd_end_rendering(recorder: &mut Recorder) -> Result<(), Error> {
    recorder.require_no_gaussian_set()?;
    match recorder.pass.take() {
        Some(RenderScope::Dynamic { .. }) => {
            recorder.packet(Packet::EndRendering);
            Ok(())
        }
        other => {
            recorder.pass = other;
            Err(not_begun("dynamic rendering"))
        }
    }
}

fn not_begun(what: &str) -> Error {
    Error::usage("VUID-vkCmdEndRendering-None-06161", format!("{what} has not begun in this command buffer"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enabled::Enabled;

    #[test]
    fn passes_are_begun_and_ended() {
        let mut recorder = Recorder::new();
        recorder.begin(&Enabled::strict(), Default::default()).unwrap();
        assert!(cmd_end_rendering(&mut recorder).is_err());
        assert!(recorder.require_pass().is_err());
        begin_rendering(&mut recorder, Packet::Barrier).unwrap();
        assert!(recorder.require_outside_pass().is_err());
        assert!(cmd_end_render_pass(&mut recorder).is_err());
        assert!(cmd_next_subpass(&mut recorder).is_err());
        assert!(recorder.color_format(0).unwrap().is_none());
        cmd_end_rendering(&mut recorder).unwrap();
        recorder.require_outside_pass().unwrap();
        begin_rendering(&mut recorder, Packet::Barrier).unwrap();
        assert!(recorder.end().is_err(), "a pass has not ended");
    }
}
