//! Render passes and framebuffers.

use super::image::ImageView;
use crate::error::Error;
use ash::vk;
use simdevice::state::ResolveMode;
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
    /// What colour attachments are resolved to, by location; may be short.
    pub(crate) resolve: Vec<Option<usize>>,
    /// The depth and stencil attachment.
    pub(crate) depth_stencil: Option<usize>,
    /// What it is resolved to, and how.
    pub(crate) depth_stencil_resolve: Option<DepthStencilResolve>,
    /// Attachments that shaders read. Between subpasses they are in memory, so that they are images like any other.
    pub(crate) input: Vec<Option<usize>>,
}

/// How a subpass resolves its depth and stencil attachment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DepthStencilResolve {
    /// The attachment that it is resolved to.
    pub(crate) attachment: usize,
    /// How depth is resolved, if it is.
    pub(crate) depth: Option<ResolveMode>,
    /// How stencil is resolved, if it is.
    pub(crate) stencil: Option<ResolveMode>,
}

impl Subpass {
    /// The attachments that it uses.
    fn attachments(&self) -> Vec<usize> {
        let lists = [&self.color, &self.resolve, &self.input];
        let mut all: Vec<_> = lists.into_iter().flatten().copied().flatten().collect();
        all.extend(self.depth_stencil);
        all.extend(self.depth_stencil_resolve.map(|resolve| resolve.attachment));
        all
    }

    /// Whether it uses attachment number `index`.
    fn uses(&self, index: usize) -> bool {
        self.attachments().contains(&index)
    }

    /// Whether it renders to attachment number `index`, or resolves to it.
    fn writes(&self, index: usize) -> bool {
        let resolved = self.depth_stencil_resolve.map(|resolve| resolve.attachment);
        let lists = [&self.color, &self.resolve];
        lists.iter().any(|list| list.contains(&Some(index)))
            || [self.depth_stencil, resolved].contains(&Some(index))
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
        let exists = |index: usize| index < attachments.len();
        let valid = subpasses
            .iter()
            .all(|subpass| subpass.attachments().into_iter().all(exists));
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

    /// The attachments that `subpass` is the first to use, and only reads.
    pub(crate) fn first_read(&self, subpass: usize) -> Vec<usize> {
        let Some(used) = self.subpasses.get(subpass) else {
            return Vec::new();
        };
        (0..self.attachments.len())
            .filter(|&index| used.uses(index) && !used.writes(index))
            .filter(|&index| self.is_first_use(subpass, index))
            .collect()
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
            ..Subpass::default()
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
    fn input_and_resolve_attachments_are_used_too() {
        let subpasses = vec![
            Subpass {
                resolve: vec![None, Some(2)],
                ..subpass(&[Some(0)])
            },
            Subpass {
                input: vec![Some(2), None, Some(3)],
                ..subpass(&[Some(1)])
            },
            Subpass {
                depth_stencil_resolve: Some(DepthStencilResolve {
                    attachment: 0,
                    depth: Some(ResolveMode::SampleZero),
                    stencil: None,
                }),
                ..subpass(&[])
            },
        ];
        let pass = RenderPass::new(vec![DESCRIPTION; 4], subpasses).unwrap();
        assert!(pass.is_first_use(0, 2) && !pass.is_last_use(0, 2));
        assert!(!pass.is_first_use(1, 2) && pass.is_last_use(1, 2));
        assert!(!pass.is_last_use(0, 0) && pass.is_last_use(2, 0));
        let read: Vec<_> = (0..4).map(|subpass| pass.first_read(subpass)).collect();
        assert_eq!(read, [vec![], vec![3], vec![], vec![]]);
        let outside = Subpass {
            input: vec![Some(1)],
            ..subpass(&[])
        };
        assert!(RenderPass::new(vec![DESCRIPTION], vec![outside]).is_err());
    }

    #[test]
    fn subpasses_name_attachments_that_exist() {
        assert!(RenderPass::new(vec![DESCRIPTION], vec![subpass(&[Some(1)])]).is_err());
        assert!(RenderPass::new(vec![DESCRIPTION], vec![]).is_err());
    }
}
