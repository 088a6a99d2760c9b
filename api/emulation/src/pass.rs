//! The render pass instance that a command buffer is in, which can be broken: ended, and begun again with all that it has stored.

use std::collections::HashMap;
use std::sync::Arc;

use ash::vk;
use gaurast_layer_interface::{find, slice};

use crate::attachments::{self, DepthStencil, View};
use crate::next::Next;
use crate::render_pass::RenderPass;
use crate::work::barrier;

/// A render pass instance.
pub(crate) enum Pass {
    Rendering(Rendering),
    Object(Object),
    /// That of the primary command buffer, in a secondary one.
    Inherited,
}

/// Dynamic rendering.
pub(crate) struct Rendering {
    flags: vk::RenderingFlags,
    area: vk::Rect2D,
    layers: u32,
    view_mask: u32,
    colors: Vec<vk::RenderingAttachmentInfo<'static>>,
    depth: Option<vk::RenderingAttachmentInfo<'static>>,
    stencil: Option<vk::RenderingAttachmentInfo<'static>>,
}

/// An attachment without its chain.
fn copied(attachment: &vk::RenderingAttachmentInfo<'_>) -> vk::RenderingAttachmentInfo<'static> {
    vk::RenderingAttachmentInfo { p_next: std::ptr::null(), _marker: std::marker::PhantomData, ..*attachment }
}

impl Rendering {
    /// Begins rendering of which everything is stored. Parts of suspended rendering become renderings of their own, which load
    /// what the part before has stored, since nothing may come between parts.
    ///
    /// # Safety
    /// The command buffer is being recorded, and the information is valid.
    pub(crate) unsafe fn begin(next: &Next, commands: vk::CommandBuffer, info: &vk::RenderingInfo<'_>) -> Self {
        // SAFETY: the caller's promise.
        let mut own = unsafe {
            Self {
                flags: info.flags,
                area: info.render_area,
                layers: info.layer_count,
                view_mask: info.view_mask,
                colors: slice(info.p_color_attachments, info.color_attachment_count).iter().map(copied).collect(),
                depth: info.p_depth_attachment.as_ref().map(copied),
                stencil: info.p_stencil_attachment.as_ref().map(copied),
            }
        };
        let is_resumed = own.flags.contains(vk::RenderingFlags::RESUMING);
        let is_suspended = own.flags.contains(vk::RenderingFlags::SUSPENDING);
        own.flags &= !(vk::RenderingFlags::RESUMING | vk::RenderingFlags::SUSPENDING);
        for attachment in own.attachments() {
            if attachment.store_op == vk::AttachmentStoreOp::DONT_CARE || is_suspended {
                attachment.store_op = vk::AttachmentStoreOp::STORE;
            }
            if is_suspended {
                attachment.resolve_mode = vk::ResolveModeFlags::NONE;
            }
            if is_resumed {
                attachment.load_op = vk::AttachmentLoadOp::LOAD;
            }
        }
        // SAFETY: as above.
        unsafe {
            if is_resumed {
                barrier(next, commands);
            }
            own.record(next, commands, info.p_next);
        }
        for attachment in own.attachments() {
            attachment.load_op = vk::AttachmentLoadOp::LOAD;
        }
        own
    }

    fn attachments(&mut self) -> impl Iterator<Item = &mut vk::RenderingAttachmentInfo<'static>> {
        self.colors.iter_mut().chain(&mut self.depth).chain(&mut self.stencil)
    }

    /// # Safety
    /// The command buffer is being recorded.
    unsafe fn record(&self, next: &Next, commands: vk::CommandBuffer, chain: *const std::ffi::c_void) {
        let mut info = vk::RenderingInfo::default()
            .flags(self.flags)
            .render_area(self.area)
            .layer_count(self.layers)
            .view_mask(self.view_mask)
            .color_attachments(&self.colors);
        if let Some(depth) = &self.depth {
            info = info.depth_attachment(depth);
        }
        if let Some(stencil) = &self.stencil {
            info = info.stencil_attachment(stencil);
        }
        info.p_next = chain;
        // SAFETY: the caller's promise.
        unsafe { next.cmd_begin_rendering(commands, &info) };
    }
}

/// An instance of a render pass object.
pub(crate) struct Object {
    known: Arc<RenderPass>,
    framebuffer: vk::Framebuffer,
    /// Of an imageless framebuffer.
    views: Vec<vk::ImageView>,
    /// Of the framebuffer, imageless or not.
    attachments: Vec<vk::ImageView>,
    area: vk::Rect2D,
    subpass: u32,
    contents: vk::SubpassContents,
}

impl Object {
    /// # Safety
    /// The information is valid.
    pub(crate) unsafe fn new(
        known: Arc<RenderPass>,
        info: &vk::RenderPassBeginInfo<'_>,
        attachments: Vec<vk::ImageView>,
        contents: vk::SubpassContents,
    ) -> Self {
        // SAFETY: the caller's promise.
        unsafe {
            let views = find::<vk::RenderPassAttachmentBeginInfo<'_>>(info.p_next);
            let views = views.map(|views| slice(views.p_attachments, views.attachment_count).to_vec());
            let views = views.unwrap_or_default();
            Self {
                known,
                framebuffer: info.framebuffer,
                attachments: if views.is_empty() { attachments } else { views.clone() },
                views,
                area: info.render_area,
                subpass: 0,
                contents,
            }
        }
    }

    pub(crate) fn next_subpass(&mut self, contents: vk::SubpassContents) {
        self.subpass += 1;
        self.contents = contents;
    }
}

impl Pass {
    /// The pixels that may be written.
    pub(crate) fn area(&self) -> Option<vk::Rect2D> {
        match self {
            Self::Rendering(rendering) => Some(rendering.area),
            Self::Object(object) => Some(object.area),
            Self::Inherited => None,
        }
    }

    /// The depth and stencil attachment as it is where the instance is interrupted.
    pub(crate) fn depth_stencil(&self, views: &HashMap<vk::ImageView, Arc<View>>) -> Option<DepthStencil> {
        match self {
            Self::Rendering(rendering) => {
                let named = |attachment: &Option<vk::RenderingAttachmentInfo<'static>>| {
                    attachment.filter(|attachment| attachment.image_view != vk::ImageView::null())
                };
                let (depth, stencil) = (named(&rendering.depth), named(&rendering.stencil));
                let one = depth.or(stencil)?;
                let view = Arc::clone(views.get(&one.image_view)?);
                let mut aspects = vk::ImageAspectFlags::empty();
                if depth.is_some() {
                    aspects |= vk::ImageAspectFlags::DEPTH;
                }
                if stencil.is_some() {
                    aspects |= vk::ImageAspectFlags::STENCIL;
                }
                let layouts = match (depth, stencil) {
                    (Some(depth), Some(stencil)) if depth.image_layout != stencil.image_layout => vec![
                        (vk::ImageAspectFlags::DEPTH, depth.image_layout),
                        (vk::ImageAspectFlags::STENCIL, stencil.image_layout),
                    ],
                    _ => vec![(attachments::aspects(view.image.format), one.image_layout)],
                };
                Some(DepthStencil { view, aspects, layouts })
            }
            Self::Object(object) => {
                let (index, layout) = (*object.known.depth_stencil.get(object.subpass as usize)?)?;
                let view = Arc::clone(views.get(object.attachments.get(index as usize)?)?);
                let aspects = attachments::aspects(view.image.format);
                Some(DepthStencil { view, aspects, layouts: vec![(aspects, layout)] })
            }
            Self::Inherited => None,
        }
    }

    /// Ends the instance, for commands that may not be within one.
    ///
    /// # Safety
    /// The command buffer is being recorded, and is in this instance.
    pub(crate) unsafe fn interrupt(&self, next: &Next, commands: vk::CommandBuffer) {
        // SAFETY: the caller's promise.
        unsafe {
            match self {
                Self::Rendering(_) => next.cmd_end_rendering(commands),
                Self::Object(object) => {
                    for _ in object.subpass + 1..object.known.view_masks.len() as u32 {
                        next.cmd_next_subpass(commands, vk::SubpassContents::INLINE);
                    }
                    next.cmd_end_render_pass(commands);
                }
                Self::Inherited => {}
            }
            barrier(next, commands);
        }
    }

    /// Begins the instance again.
    ///
    /// # Safety
    /// The command buffer is being recorded, and the instance was ended.
    pub(crate) unsafe fn resume(&self, next: &Next, commands: vk::CommandBuffer) {
        // SAFETY: the caller's promise.
        unsafe {
            match self {
                Self::Rendering(rendering) => rendering.record(next, commands, std::ptr::null()),
                Self::Object(object) => {
                    let mut views = vk::RenderPassAttachmentBeginInfo::default().attachments(&object.views);
                    let mut info = vk::RenderPassBeginInfo::default()
                        .render_pass(object.known.again)
                        .framebuffer(object.framebuffer)
                        .render_area(object.area);
                    if !object.views.is_empty() {
                        info = info.push_next(&mut views);
                    }
                    let contents = |subpass: u32| {
                        if subpass == object.subpass { object.contents } else { vk::SubpassContents::INLINE }
                    };
                    next.cmd_begin_render_pass(commands, &info, contents(0));
                    for subpass in 1..=object.subpass {
                        next.cmd_next_subpass(commands, contents(subpass));
                    }
                }
                Self::Inherited => {}
            }
        }
    }
}
