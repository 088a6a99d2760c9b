//! Render pass objects that can be broken: everything is stored, and a second object loads everything again.

use std::sync::Arc;

use ash::vk;
use gaurast_layer_interface::{find, slice};

use crate::next::Next;

/// A render pass object.
pub(crate) struct RenderPass {
    next: Arc<Next>,
    /// The compatible object that loads all attachments and leaves them as the application's does.
    pub(crate) again: vk::RenderPass,
    /// The view mask of each subpass.
    pub(crate) view_masks: Vec<u32>,
    /// The depth and stencil attachment of each subpass, and the layout that the instance leaves it in.
    pub(crate) depth_stencil: Vec<Option<(u32, vk::ImageLayout)>>,
}

impl Drop for RenderPass {
    fn drop(&mut self) {
        // SAFETY: no command buffer that uses it is executed any more.
        unsafe { self.next.destroy_render_pass(self.again, None) };
    }
}

/// Store operations so that nothing is lost where the pass is broken.
fn stored(op: vk::AttachmentStoreOp) -> vk::AttachmentStoreOp {
    if op == vk::AttachmentStoreOp::DONT_CARE { vk::AttachmentStoreOp::STORE } else { op }
}

/// The attachments that a subpass does not use, all of which it has to preserve where the pass may be broken.
fn preserved(count: u32, used: &[u32]) -> Vec<u32> {
    (0..count).filter(|index| !used.contains(index)).collect()
}

macro_rules! creation {
    ($create:ident, $info:ident, $call:ident, $masks:expr) => {
        /// Creates a render pass, and the one that goes on where it is broken.
        ///
        /// # Safety
        /// The creation info is valid.
        pub(crate) unsafe fn $create(
            next: &Arc<Next>,
            info: &vk::$info<'_>,
            allocator: Option<&vk::AllocationCallbacks<'_>>,
        ) -> Result<(vk::RenderPass, RenderPass), vk::Result> {
            let masks = $masks;
            // SAFETY: the caller's promise.
            unsafe {
                let mut attachments = slice(info.p_attachments, info.attachment_count).to_vec();
                for attachment in &mut attachments {
                    attachment.store_op = stored(attachment.store_op);
                    attachment.stencil_store_op = stored(attachment.stencil_store_op);
                }
                let subpasses = slice(info.p_subpasses, info.subpass_count);
                let kept: Vec<Vec<u32>> = subpasses
                    .iter()
                    .map(|subpass| {
                        let resolves =
                            if subpass.p_resolve_attachments.is_null() { 0 } else { subpass.color_attachment_count };
                        let mut used: Vec<u32> = slice(subpass.p_input_attachments, subpass.input_attachment_count)
                            .iter()
                            .map(|one| one.attachment)
                            .collect();
                        used.extend(
                            slice(subpass.p_color_attachments, subpass.color_attachment_count)
                                .iter()
                                .map(|one| one.attachment),
                        );
                        used.extend(slice(subpass.p_resolve_attachments, resolves).iter().map(|one| one.attachment));
                        used.extend(subpass.p_depth_stencil_attachment.as_ref().map(|one| one.attachment));
                        preserved(info.attachment_count, &used)
                    })
                    .collect();
                let depth_stencil = subpasses.iter().map(|subpass| {
                    let index = subpass.p_depth_stencil_attachment.as_ref()?.attachment;
                    Some((index, attachments.get(index as usize)?.final_layout))
                });
                let depth_stencil: Vec<Option<(u32, vk::ImageLayout)>> = depth_stencil.collect();
                let is_one = subpasses.len() == 1;
                let mut subpasses = subpasses.to_vec();
                for (subpass, kept) in subpasses.iter_mut().zip(&kept) {
                    // An attachment of one subpass that it does not use has no other to be kept for.
                    let kept: &[u32] = if is_one { &[] } else { kept };
                    subpass.preserve_attachment_count = kept.len() as u32;
                    subpass.p_preserve_attachments = kept.as_ptr();
                }
                let mut info = *info;
                info.p_subpasses = subpasses.as_ptr();
                info.p_attachments = attachments.as_ptr();
                let created = next.$call(&info, allocator)?;
                let mut again = attachments.clone();
                for attachment in &mut again {
                    attachment.load_op = vk::AttachmentLoadOp::LOAD;
                    attachment.stencil_load_op = vk::AttachmentLoadOp::LOAD;
                    attachment.initial_layout = attachment.final_layout;
                }
                info.p_attachments = again.as_ptr();
                let view_masks: Vec<u32> = masks(&info, subpasses.len());
                match next.$call(&info, None) {
                    Ok(again) => Ok((created, RenderPass { next: Arc::clone(next), again, view_masks, depth_stencil })),
                    Err(error) => {
                        next.destroy_render_pass(created, allocator);
                        Err(error)
                    }
                }
            }
        }
    };
}

creation!(create, RenderPassCreateInfo, create_render_pass, |info: &vk::RenderPassCreateInfo<'_>, count: usize| {
    // SAFETY: the chain is that of a valid creation info.
    let views = unsafe { find::<vk::RenderPassMultiviewCreateInfo<'_>>(info.p_next) };
    // SAFETY: as above.
    let masks = views.map(|views| unsafe { slice(views.p_view_masks, views.subpass_count) }).unwrap_or_default();
    (0..count).map(|index| masks.get(index).copied().unwrap_or(0)).collect()
});
creation!(create2, RenderPassCreateInfo2, create_render_pass2, |info: &vk::RenderPassCreateInfo2<'_>, count: usize| {
    // SAFETY: the array is that of a valid creation info.
    unsafe { slice(info.p_subpasses, count as u32) }.iter().map(|subpass| subpass.view_mask).collect()
});
