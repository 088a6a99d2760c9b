//! Render passes and framebuffers.

use crate::abi::error::Error;
use crate::abi::handle::{self, objects};
use crate::abi::valid;
use crate::convert;
use crate::physical_device::limits;
use crate::resource::image::ImageView;
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
    /// The format of the framebuffer's view.
    pub(crate) format: vk::Format,
    /// The operation of its first use on colour or depth.
    pub(crate) load: vk::AttachmentLoadOp,
    /// The operation of its last use on colour or depth.
    pub(crate) store: vk::AttachmentStoreOp,
    /// The operation of its first use on stencil.
    pub(crate) stencil_load: vk::AttachmentLoadOp,
    /// The operation of its last use on stencil.
    pub(crate) stencil_store: vk::AttachmentStoreOp,
}

/// A subpass: indices of attachments.
#[derive(Clone, Debug)]
pub(crate) struct Subpass {
    /// Colour attachments by location.
    pub(crate) color: Vec<Option<usize>>,
    /// The resolve attachments of colour attachments, by location; there may be fewer.
    pub(crate) resolve: Vec<Option<usize>>,
    /// The depth and stencil attachment.
    pub(crate) depth_stencil: Option<usize>,
    /// The resolve of the depth and stencil attachment, if there is one.
    pub(crate) depth_stencil_resolve: Option<DepthStencilResolve>,
    /// Input attachments. Between subpasses they are in memory, so shaders read them like other images.
    pub(crate) input: Vec<Option<usize>>,
    /// The views that draws render to, a bit each; 0 in a pass without views.
    pub(crate) view_mask: u32,
    /// The samples with which attachments of one sample are rendered to, if there are several.
    pub(crate) samples: Option<u32>,
    /// The combinations of these samples for depth and for stencil.
    pub(crate) own_modes: [ResolveMode; 2],
}

impl Default for Subpass {
    fn default() -> Self {
        Self {
            color: Vec::new(),
            resolve: Vec::new(),
            depth_stencil: None,
            depth_stencil_resolve: None,
            input: Vec::new(),
            view_mask: 0,
            samples: None,
            own_modes: [ResolveMode::SampleZero; 2],
        }
    }
}

/// The resolve of a subpass's depth and stencil attachment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DepthStencilResolve {
    /// The resolve attachment.
    pub(crate) attachment: usize,
    /// The resolve mode of depth, if it is resolved.
    pub(crate) depth: Option<ResolveMode>,
    /// The resolve mode of stencil, if it is resolved.
    pub(crate) stencil: Option<ResolveMode>,
}

impl Subpass {
    /// The attachments that the subpass uses.
    fn attachments(&self) -> Vec<usize> {
        let lists = [&self.color, &self.resolve, &self.input];
        let mut all: Vec<_> = lists.into_iter().flatten().copied().flatten().collect();
        all.extend(self.depth_stencil);
        all.extend(self.depth_stencil_resolve.map(|resolve| resolve.attachment));
        all
    }

    /// The views that draws render to, a bit each; the first one in a pass without views.
    fn views(&self) -> u32 {
        match self.view_mask {
            0 => 1,
            mask => mask,
        }
    }

    /// The number of attachment layers that it renders to, in a framebuffer of `framebuffer` layers.
    pub(crate) fn layers(&self, framebuffer: u32) -> u32 {
        layers(self.view_mask, framebuffer)
    }

    /// Reports whether it uses attachment number `index`.
    fn uses(&self, index: usize) -> bool {
        self.attachments().contains(&index)
    }

    /// Reports whether it renders to attachment number `index`, or resolves to it. A resolve of one aspect leaves the
    /// other as the attachment's load operation makes it.
    fn writes(&self, index: usize) -> bool {
        let resolve = self.depth_stencil_resolve;
        let whole = resolve.filter(|it| it.depth.is_some() && it.stencil.is_some());
        let resolved = whole.map(|resolve| resolve.attachment);
        let lists = [&self.color, &self.resolve];
        lists.iter().any(|list| list.contains(&Some(index))) || [self.depth_stencil, resolved].contains(&Some(index))
    }
}

objects! {
    vk::RenderPass => RenderPass;
    vk::Framebuffer => Framebuffer;
}

impl RenderPass {
    /// A render pass.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if there is no subpass or a subpass names an attachment that doesn't exist.
    pub(crate) fn new(attachments: Vec<AttachmentDescription>, subpasses: Vec<Subpass>) -> Result<Self, Error> {
        let exists = |index: usize| index < attachments.len();
        let valid = subpasses.iter().all(|subpass| subpass.attachments().into_iter().all(exists));
        if subpasses.is_empty() || !valid {
            return Err(Error::usage(
                "VUID-VkRenderPassCreateInfo-attachment-00834",
                "a render pass has no subpass, or one that names an attachment that isn't there",
            ));
        }
        Ok(Self { attachments, subpasses })
    }

    /// The views, a bit each, for which `subpass` is the first to use attachment number `index`. A pass without views
    /// counts as one with one view.
    pub(crate) fn first_views(&self, subpass: usize, index: usize) -> u32 {
        let earlier = self.subpasses[..subpass].iter();
        let used = earlier.filter(|s| s.uses(index)).fold(0, |used, s| used | s.views());
        self.subpasses[subpass].views() & !used
    }

    /// Reports whether `subpass` is the first to use attachment number `index`, in all of its views.
    pub(crate) fn is_first_use(&self, subpass: usize, index: usize) -> bool {
        self.first_views(subpass, index) == self.subpasses[subpass].views()
    }

    /// Reports whether `subpass` is the last to use attachment number `index`.
    pub(crate) fn is_last_use(&self, subpass: usize, index: usize) -> bool {
        !self.subpasses[subpass + 1..].iter().any(|s| s.uses(index))
    }

    /// The attachments that must be loaded before `subpass` begins: those that it is the first to use and only reads,
    /// or the first to use in only some of its views.
    pub(crate) fn loaded_before(&self, subpass: usize) -> Vec<usize> {
        let Some(used) = self.subpasses.get(subpass) else {
            return Vec::new();
        };
        (0..self.attachments.len())
            .filter(|&index| used.uses(index) && self.first_views(subpass, index) != 0)
            .filter(|&index| !used.writes(index) || !self.is_first_use(subpass, index))
            .collect()
    }

    /// The formats of a subpass's colour attachments; undefined if unused.
    pub(crate) fn color_formats(&self, subpass: usize) -> Option<Vec<vk::Format>> {
        let subpass = self.subpasses.get(subpass)?;
        let format = |used: &Option<usize>| used.map_or(vk::Format::UNDEFINED, |index| self.attachments[index].format);
        Some(subpass.color.iter().map(format).collect())
    }
}

/// A framebuffer.
#[derive(Debug)]
pub(crate) struct Framebuffer {
    /// The views, in the order of the render pass's attachments; `None` for an imageless framebuffer, whose views are
    /// given when a pass begins.
    pub(crate) views: Option<Vec<Arc<ImageView>>>,
    /// Its width and height in pixels.
    pub(crate) extent: vk::Extent2D,
    /// Its layers.
    pub(crate) layers: u32,
}

/// The index of a reference's attachment; None if it is unused.
fn used(attachment: u32) -> Option<usize> {
    (attachment != vk::ATTACHMENT_UNUSED).then_some(attachment as usize)
}

/// The number of layers that attachments need for views; without views, `layers`.
pub(crate) fn layers(view_mask: u32, layers: u32) -> u32 {
    match view_mask {
        0 => layers,
        mask => u32::BITS - mask.leading_zeros(),
    }
}

/// Converts a subpass description of either version, without a resolve of depth and stencil. The description's pointers
/// are valid.
macro_rules! subpass {
    ($description:expr) => {{
        let description = $description;
        let count = description.color_attachment_count;
        let has_resolve = !description.p_resolve_attachments.is_null();
        let resolve_count = if has_resolve { count } else { 0 };
        let color = valid::slice(description.p_color_attachments, count)?;
        let resolve = valid::slice(description.p_resolve_attachments, resolve_count)?;
        let input = valid::slice(description.p_input_attachments, description.input_attachment_count)?;
        let depth_stencil = valid::optional(description.p_depth_stencil_attachment);
        Subpass {
            color: color.iter().map(|r| used(r.attachment)).collect(),
            resolve: resolve.iter().map(|r| used(r.attachment)).collect(),
            depth_stencil: depth_stencil.and_then(|r| used(r.attachment)),
            depth_stencil_resolve: None,
            input: input.iter().map(|r| used(r.attachment)).collect(),
            ..Subpass::default()
        }
    }};
}

/// Converts a render pass's create info of either version, with the macro `subpass` for its subpasses. The info's
/// pointers are valid.
macro_rules! render_pass {
    ($info:expr, $subpass:expr) => {{
        let info = $info;
        let attachments = valid::slice(info.p_attachments, info.attachment_count)?;
        let attachments = attachments.iter().map(|attachment| AttachmentDescription {
            format: attachment.format,
            load: attachment.load_op,
            store: attachment.store_op,
            stencil_load: attachment.stencil_load_op,
            stencil_store: attachment.stencil_store_op,
        });
        let mut subpasses = simdevice::host::with_capacity(info.subpass_count as usize);
        for description in valid::slice(info.p_subpasses, info.subpass_count)? {
            subpasses.push($subpass(description)?);
        }
        RenderPass::new(attachments.collect(), subpasses).map(Arc::new)
    }};
}

/// The samples with which attachments of one sample are rendered to, if there are several.
///
/// # Errors
/// [`Error::FeatureNotPresent`] for a number of samples that attachments don't have.
pub(crate) fn samples(info: &vk::MultisampledRenderToSingleSampledInfoEXT<'_>) -> Result<Option<u32>, Error> {
    let count = info.rasterization_samples;
    if info.multisampled_render_to_single_sampled_enable == vk::FALSE || count == vk::SampleCountFlags::TYPE_1 {
        return Ok(None);
    }
    if !limits::SAMPLE_COUNTS.contains(count) || count.is_empty() {
        return Err(Error::FeatureNotPresent(format!("rendering with samples {count:?}")));
    }
    Ok(Some(count.as_raw()))
}

/// The resolve of a subpass's depth and stencil, if it has one.
///
/// # Safety
/// The structure's pointers are valid.
unsafe fn new_depth_stencil_resolve(
    info: &vk::SubpassDescriptionDepthStencilResolve<'_>,
) -> Result<Option<DepthStencilResolve>, Error> {
    // SAFETY: the caller's promise.
    let reference = unsafe { valid::optional(info.p_depth_stencil_resolve_attachment) };
    let Some(attachment) = reference.and_then(|r| used(r.attachment)) else {
        return Ok(None);
    };
    Ok(Some(DepthStencilResolve {
        attachment,
        depth: convert::resolve_mode(info.depth_resolve_mode)?,
        stencil: convert::resolve_mode(info.stencil_resolve_mode)?,
    }))
}

/// # Safety
/// The create info and its chain are valid.
#[doc(alias = "vkCreateRenderPass")]
pub(crate) unsafe fn create_render_pass(
    create_info: &vk::RenderPassCreateInfo<'_>,
    multiview: Option<&vk::RenderPassMultiviewCreateInfo<'_>>,
) -> Result<Arc<RenderPass>, Error> {
    // SAFETY: the caller's promise.
    unsafe {
        let masks = match multiview {
            Some(multiview) => valid::slice(multiview.p_view_masks, multiview.subpass_count)?,
            None => &[],
        };
        let mut masks = masks.iter();
        let mut subpass = |description: &vk::SubpassDescription<'_>| {
            Ok::<_, Error>(Subpass { view_mask: masks.next().copied().unwrap_or(0), ..subpass!(description) })
        };
        render_pass!(create_info, subpass)
    }
}

/// # Safety
/// The create info and its chain are valid.
#[doc(alias = "vkCreateRenderPass2")]
pub(crate) unsafe fn create_render_pass2(
    create_info: &vk::RenderPassCreateInfo2<'_>,
) -> Result<Arc<RenderPass>, Error> {
    // SAFETY: the caller's promise.
    unsafe {
        let subpass = |description: &vk::SubpassDescription2<'_>| {
            let mut own_modes = Subpass::default().own_modes;
            let resolve =
                match valid::find_in_chain::<vk::SubpassDescriptionDepthStencilResolve<'_>>(description.p_next) {
                    Some(info) => {
                        for (own, mode) in
                            own_modes.iter_mut().zip([info.depth_resolve_mode, info.stencil_resolve_mode])
                        {
                            *own = convert::resolve_mode(mode)?.unwrap_or(*own);
                        }
                        new_depth_stencil_resolve(info)?
                    }
                    None => None,
                };
            let multisampled =
                valid::find_in_chain::<vk::MultisampledRenderToSingleSampledInfoEXT<'_>>(description.p_next);
            Ok::<_, Error>(Subpass {
                samples: multisampled.map(samples).transpose()?.flatten(),
                own_modes,
                depth_stencil_resolve: resolve,
                view_mask: description.view_mask,
                ..subpass!(description)
            })
        };
        render_pass!(create_info, subpass)
    }
}

/// Returns a granularity of one pixel: no area is faster than another.
#[doc(alias = "vkGetRenderAreaGranularity")]
#[doc(alias = "vkGetRenderingAreaGranularityKHR")]
pub(crate) fn get_render_area_granularity() -> Result<vk::Extent2D, Error> {
    Ok(vk::Extent2D { width: 1, height: 1 })
}

/// # Safety
/// The create info and its handles are valid.
#[doc(alias = "vkCreateFramebuffer")]
pub(crate) unsafe fn create_framebuffer(
    create_info: &vk::FramebufferCreateInfo<'_>,
) -> Result<Arc<Framebuffer>, Error> {
    let info = create_info;
    let views = if info.flags.contains(vk::FramebufferCreateFlags::IMAGELESS) {
        None
    } else {
        // SAFETY: the caller's promise.
        let views = unsafe { handle::get_all(valid::slice(info.p_attachments, info.attachment_count)?)? };
        Some(views)
    };
    Ok(Arc::new(Framebuffer {
        views,
        extent: vk::Extent2D { width: info.width, height: info.height },
        layers: info.layers,
    }))
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
        Subpass { color: color.to_vec(), ..Subpass::default() }
    }

    #[test]
    fn attachments_are_loaded_by_their_first_use_and_stored_by_their_last() {
        let subpasses = vec![subpass(&[Some(0)]), subpass(&[None, Some(1)]), subpass(&[Some(0)])];
        let pass = RenderPass::new(vec![DESCRIPTION; 2], subpasses).unwrap();
        assert!(pass.is_first_use(0, 0) && !pass.is_last_use(0, 0));
        assert!(pass.is_first_use(1, 1) && pass.is_last_use(1, 1));
        assert!(!pass.is_first_use(2, 0) && pass.is_last_use(2, 0));
        assert_eq!(pass.color_formats(1).unwrap(), [vk::Format::UNDEFINED, vk::Format::R8G8B8A8_UNORM]);
        assert!(pass.color_formats(3).is_none());
    }

    #[test]
    fn input_and_resolve_attachments_are_used_too() {
        let subpasses = vec![
            Subpass { resolve: vec![None, Some(2)], ..subpass(&[Some(0)]) },
            Subpass { input: vec![Some(2), None, Some(3)], ..subpass(&[Some(1)]) },
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
        let read: Vec<_> = (0..4).map(|subpass| pass.loaded_before(subpass)).collect();
        assert_eq!(read, [vec![], vec![3], vec![], vec![]]);
        let outside = Subpass { input: vec![Some(1)], ..subpass(&[]) };
        assert!(RenderPass::new(vec![DESCRIPTION], vec![outside]).is_err());
    }

    #[test]
    fn subpasses_name_attachments_that_exist() {
        assert!(RenderPass::new(vec![DESCRIPTION], vec![subpass(&[Some(1)])]).is_err());
        assert!(RenderPass::new(vec![DESCRIPTION], vec![]).is_err());
    }
}
