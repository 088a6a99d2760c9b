//! Render passes and framebuffers.

use super::image::ImageView;
use crate::error::Error;
use ash::vk;
use std::sync::Arc;

/// A render pass. Subpasses are rendered one after another; between them attachments are in memory.
#[derive(Debug)]
pub(crate) struct RenderPass {
    /// The attachments.
    pub(crate) attachments: Vec<AttachmentDescription>,
    /// The subpasses; at least one.
    pub(crate) subpasses: Vec<Subpass>,
}

/// An attachment of a render pass.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AttachmentDescription {
    /// The format of the view that the framebuffer gives.
    pub(crate) format: vk::Format,
    /// What its first use does with colour or depth.
    pub(crate) load: vk::AttachmentLoadOp,
    /// What its last use does with them.
    pub(crate) store: vk::AttachmentStoreOp,
    /// What its first use does with stencil.
    pub(crate) stencil_load: vk::AttachmentLoadOp,
    /// What its last use does with it.
    pub(crate) stencil_store: vk::AttachmentStoreOp,
}

/// A subpass: indices of attachments.
#[derive(Clone, Debug, Default)]
pub(crate) struct Subpass {
    /// Colour attachments by location.
    pub(crate) color: Vec<Option<usize>>,
    /// The depth and stencil attachment.
    pub(crate) depth_stencil: Option<usize>,
}

impl Subpass {
    /// Whether it renders to attachment number `index`.
    fn uses(&self, index: usize) -> bool {
        self.color.contains(&Some(index)) || self.depth_stencil == Some(index)
    }
}

crate::objects! {
    vk::RenderPass => RenderPass;
    vk::Framebuffer => Framebuffer;
}

impl RenderPass {
    /// A render pass.
    ///
    /// # Errors
    /// [`Error::Usage`] if there is no subpass or a subpass names an attachment that isn't there.
    pub(crate) fn new(
        attachments: Vec<AttachmentDescription>,
        subpasses: Vec<Subpass>,
    ) -> Result<Self, Error> {
        let exists = |index: &usize| *index < attachments.len();
        let valid = subpasses.iter().all(|subpass| {
            let used = subpass.color.iter().flatten();
            used.chain(&subpass.depth_stencil).all(exists)
        });
        if subpasses.is_empty() || !valid {
            return Err(Error::usage(
                "VUID-VkRenderPassCreateInfo-attachment-00834",
                "a render pass has no subpass, or one that names an attachment that isn't there",
            ));
        }
        Ok(Self {
            attachments,
            subpasses,
        })
    }

    /// Whether `subpass` is the first to use attachment number `index`.
    pub(crate) fn is_first_use(&self, subpass: usize, index: usize) -> bool {
        !self.subpasses[..subpass].iter().any(|s| s.uses(index))
    }

    /// Whether `subpass` is the last to use attachment number `index`.
    pub(crate) fn is_last_use(&self, subpass: usize, index: usize) -> bool {
        !self.subpasses[subpass + 1..].iter().any(|s| s.uses(index))
    }

    /// The formats of a subpass's colour attachments; undefined where unused.
    pub(crate) fn color_formats(&self, subpass: usize) -> Option<Vec<vk::Format>> {
        let subpass = self.subpasses.get(subpass)?;
        let format = |used: &Option<usize>| {
            used.map_or(vk::Format::UNDEFINED, |index| {
                self.attachments[index].format
            })
        };
        Some(subpass.color.iter().map(format).collect())
    }
}

/// A framebuffer.
#[derive(Debug)]
pub(crate) struct Framebuffer {
    /// The views, in the order of the render pass's attachments; `None` for an imageless framebuffer, whose views
    /// come when a pass begins.
    pub(crate) views: Option<Vec<Arc<ImageView>>>,
    /// Its width and height in pixels.
    pub(crate) extent: vk::Extent2D,
    /// Its layers.
    pub(crate) layers: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    const DESCRIPTION: AttachmentDescription = AttachmentDescription {
        format: vk::Format::R8G8B8A8_UNORM,
        load: vk::AttachmentLoadOp::CLEAR,
        store: vk::AttachmentStoreOp::STORE,
        stencil_load: vk::AttachmentLoadOp::DONT_CARE,
        stencil_store: vk::AttachmentStoreOp::DONT_CARE,
    };

    fn subpass(color: &[Option<usize>]) -> Subpass {
        Subpass {
            color: color.to_vec(),
            depth_stencil: None,
        }
    }

    #[test]
    fn attachments_are_loaded_by_their_first_use_and_stored_by_their_last() {
        let subpasses = vec![
            subpass(&[Some(0)]),
            subpass(&[None, Some(1)]),
            subpass(&[Some(0)]),
        ];
        let pass = RenderPass::new(vec![DESCRIPTION; 2], subpasses).unwrap();
        assert!(pass.is_first_use(0, 0) && !pass.is_last_use(0, 0));
        assert!(pass.is_first_use(1, 1) && pass.is_last_use(1, 1));
        assert!(!pass.is_first_use(2, 0) && pass.is_last_use(2, 0));
        assert_eq!(
            pass.color_formats(1).unwrap(),
            [vk::Format::UNDEFINED, vk::Format::R8G8B8A8_UNORM]
        );
        assert!(pass.color_formats(3).is_none());
    }

    #[test]
    fn subpasses_name_attachments_that_exist() {
        assert!(RenderPass::new(vec![DESCRIPTION], vec![subpass(&[Some(1)])]).is_err());
        assert!(RenderPass::new(vec![DESCRIPTION], vec![]).is_err());
    }
}
