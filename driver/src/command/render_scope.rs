//! Render passes and dynamic rendering that have begun, and the packets that begin them: attachments, load and store
//! operations, clear values.

#[cfg(test)]
mod tests;

use crate::abi::error::Error;
use crate::convert::{clear_value, rect};
use crate::render_pass::{AttachmentDescription, RenderPass, Subpass, layers};
use crate::resource::image::ImageView;
use ash::vk;
use simdevice::format::{Aspect, ClearValue};
use simdevice::packet::{Attachment, AttachmentResolve, LoadOp, Multisampled, Rendering, StoreOp};
use simdevice::state::{Rect, ResolveMode};
use simdevice::{Format, Packet};
use std::sync::Arc;

/// Checks that a view can be an attachment of `layers` layers with an aspect.
fn check_attachment(view: &ImageView, aspect: Aspect, layers: u32) -> Result<(), Error> {
    let view = &view.view;
    let vuid = if layers > view.layer_count {
        // For dynamic rendering, Vulkan has no rule of its own with an id.
        "VUID-VkFramebufferCreateInfo-flags-04535"
    } else if view.format.aspects().contains(&aspect) {
        return Ok(());
    } else {
        match aspect {
            Aspect::Color => "VUID-VkRenderingInfo-colorAttachmentCount-06087",
            Aspect::Depth => "VUID-VkRenderingInfo-pDepthAttachment-06547",
            Aspect::Stencil => "VUID-VkRenderingInfo-pStencilAttachment-06548",
        }
    };
    Err(Error::usage(
        vuid,
        format!(
            "a view of format {:?} with {} layers is the {aspect:?} attachment of a pass with {layers} layers",
            view.format, view.layer_count
        ),
    ))
}

/// The load operation of an attachment at the beginning of a pass.
fn load(op: vk::AttachmentLoadOp, clear: impl FnOnce() -> ClearValue) -> Result<LoadOp, Error> {
    match op {
        // An attachment with undefined contents may keep them.
        vk::AttachmentLoadOp::LOAD | vk::AttachmentLoadOp::NONE_KHR => Ok(LoadOp::Load),
        vk::AttachmentLoadOp::CLEAR => Ok(LoadOp::Clear(clear())),
        vk::AttachmentLoadOp::DONT_CARE => Ok(LoadOp::DontCare),
        other => Err(Error::usage(
            "VUID-VkRenderingAttachmentInfo-loadOp-parameter",
            format!("{other:?} is not a VkAttachmentLoadOp"),
        )),
    }
}

/// The store operation of an attachment at the end of a pass.
fn store(op: vk::AttachmentStoreOp) -> Result<StoreOp, Error> {
    match op {
        vk::AttachmentStoreOp::STORE => Ok(StoreOp::Store),
        vk::AttachmentStoreOp::DONT_CARE => Ok(StoreOp::DontCare),
        vk::AttachmentStoreOp::NONE => Ok(StoreOp::None),
        other => Err(Error::usage(
            "VUID-VkRenderingAttachmentInfo-storeOp-parameter",
            format!("{other:?} is not a VkAttachmentStoreOp"),
        )),
    }
}

/// Checks that an attachment's samples can be resolved to a view.
fn check_resolve(attachment: &ImageView, view: &ImageView) -> Result<(), Error> {
    let (from, to) = (&attachment.view, &view.view);
    let samples = to.image.desc.samples;
    if from.format == to.format && samples == 1 {
        return Ok(());
    }
    Err(Error::usage(
        "VUID-VkRenderingAttachmentInfo-imageView-06865",
        format!(
            "an attachment of format {:?} is resolved to one of format {:?} with {samples} samples",
            from.format, to.format
        ),
    ))
}

/// The packet that begins rendering, after a check that all attachments have the same number of samples. The device
/// would be lost otherwise, without naming the command.
fn begin(rendering: Rendering) -> Result<Packet, Error> {
    let single = [&rendering.depth, &rendering.stencil];
    let attachments = rendering.color.iter().chain(single).flatten();
    let samples = attachments.map(|attachment| match attachment.multisampled {
        Some(multisampled) => multisampled.samples,
        None => attachment.view.image.desc.samples,
    });
    let samples: Vec<_> = samples.collect();
    if let Some(pair) = samples.windows(2).find(|pair| pair[0] != pair[1]) {
        return Err(Error::usage(
            "VUID-VkRenderingInfo-multisampledRenderToSingleSampled-06857",
            format!("an attachment has {} samples, another {}", pair[0], pair[1]),
        ));
    }
    Ok(Packet::BeginRendering(Box::new(rendering)))
}

/// The samples with which a view is rendered to in a pass that renders with `samples` to attachments of one sample.
fn multisampled(view: &ImageView, samples: Option<u32>, mode: ResolveMode) -> Option<Multisampled> {
    let samples = samples.filter(|_| view.view.image.desc.samples == 1)?;
    Some(Multisampled { samples, mode })
}

/// A render pass that has begun, with its attachments.
#[derive(Clone)]
pub(crate) struct RenderPassInstance {
    /// The render pass.
    pub(crate) render_pass: Arc<RenderPass>,
    /// A view for each attachment.
    pub(crate) views: Vec<Arc<ImageView>>,
    /// The clear values, by attachment; there may be fewer than attachments.
    pub(crate) clear_values: Vec<vk::ClearValue>,
    /// The pixels rendered.
    pub(crate) area: Rect,
    /// The layers rendered.
    pub(crate) layers: u32,
}

impl RenderPassInstance {
    /// The packet that begins a subpass.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if the pass has no such subpass, a view is missing, or views cannot be attachments of
    /// one subpass.
    pub(crate) fn subpass(&self, index: usize) -> Result<Packet, Error> {
        let Some(subpass) = self.render_pass.subpasses.get(index) else {
            return Err(Error::usage(
                "VUID-vkCmdNextSubpass-None-00909",
                format!("the render pass has no subpass {index}"),
            ));
        };
        let resolved = subpass.resolve.iter().copied().chain(std::iter::repeat(None));
        let color = subpass.color.iter().zip(resolved).map(|(used, resolved)| {
            let ops = main_ops;
            let resolve = resolved.map(|target| ResolveTo { target, mode: ResolveMode::Average });
            used.map(|number| self.attachment(index, number, Aspect::Color, ops, resolve)).transpose()
        });
        let depth_stencil = |aspect, ops| {
            let has_aspect = |format: Format| format.aspects().contains(&aspect);
            let number = subpass.depth_stencil.filter(|&number| self.format(number).is_some_and(has_aspect));
            let resolve = subpass.depth_stencil_resolve.and_then(|resolve| {
                let mode = match aspect {
                    Aspect::Stencil => resolve.stencil,
                    Aspect::Color | Aspect::Depth => resolve.depth,
                };
                mode.map(|mode| ResolveTo { target: resolve.attachment, mode })
            });
            number.map(|number| self.attachment(index, number, aspect, ops, resolve)).transpose()
        };
        begin(Rendering {
            area: self.area,
            layer_count: subpass.layers(self.layers),
            view_mask: subpass.view_mask,
            color: color.collect::<Result<_, _>>()?,
            depth: depth_stencil(Aspect::Depth, main_ops)?,
            stencil: depth_stencil(Aspect::Stencil, stencil_ops)?,
        })
    }

    /// The packets that clear attachments before a subpass: those that it reads before any rendering, and those that it
    /// is the first to use in only some of its views.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if a view is missing.
    pub(crate) fn clears_before_reads(&self, index: usize) -> Result<Vec<Packet>, Error> {
        let mut packets = Vec::new();
        let Some(subpass) = self.render_pass.subpasses.get(index) else {
            return Ok(packets);
        };
        for number in self.render_pass.loaded_before(index) {
            let Some(format) = self.format(number) else {
                continue;
            };
            let cleared = |aspect, ops: fn(&AttachmentDescription) -> Ops| {
                let (load, _) = ops(&self.render_pass.attachments[number]);
                let is_cleared = format.aspects().contains(&aspect) && load == vk::AttachmentLoadOp::CLEAR;
                is_cleared.then(|| self.attachment(index, number, aspect, ops, None)).transpose()
            };
            let color = cleared(Aspect::Color, main_ops)?;
            let depth = cleared(Aspect::Depth, main_ops)?;
            let stencil = cleared(Aspect::Stencil, stencil_ops)?;
            let mut attachments = [color, depth, stencil];
            if attachments.iter().all(Option::is_none) {
                continue;
            }
            let value = self.clear_value(self.view(number)?, number);
            for attachment in attachments.iter_mut().flatten() {
                attachment.load = LoadOp::Clear(value);
                attachment.store = StoreOp::Store;
            }
            let [color, depth, stencil] = attachments;
            packets.push(Packet::BeginRendering(Box::new(Rendering {
                area: self.area,
                layer_count: subpass.layers(self.layers),
                view_mask: match subpass.view_mask {
                    0 => 0,
                    _ => self.render_pass.first_views(index, number),
                },
                color: vec![color],
                depth,
                stencil,
            })));
            packets.push(Packet::EndRendering);
        }
        Ok(packets)
    }

    fn format(&self, number: usize) -> Option<Format> {
        self.views.get(number).map(|view| view.view.format)
    }

    fn view(&self, number: usize) -> Result<&ImageView, Error> {
        let view = self.views.get(number).map(Arc::as_ref);
        view.ok_or_else(|| {
            Error::usage(
                "VUID-VkFramebufferCreateInfo-attachmentCount-00876",
                format!("the framebuffer has no attachment {number}"),
            )
        })
    }

    /// The clear value of an attachment. A missing one is the application's error; zero is used.
    fn clear_value(&self, view: &ImageView, number: usize) -> ClearValue {
        let value = self.clear_values.get(number).copied().unwrap_or_default();
        clear_value(view.view.format, value)
    }

    /// An attachment of a subpass; `resolve` names the attachment that it is resolved to.
    fn attachment(
        &self,
        subpass: usize,
        number: usize,
        aspect: Aspect,
        ops: fn(&AttachmentDescription) -> Ops,
        resolve: Option<ResolveTo<usize>>,
    ) -> Result<Attachment, Error> {
        let view = self.view(number)?;
        let layers = self.render_pass.subpasses[subpass].layers(self.layers);
        check_attachment(view, aspect, layers)?;
        let resolve = resolve.map(|ResolveTo { target, mode }| {
            let to = self.view(target)?;
            check_attachment(to, aspect, layers)?;
            check_resolve(view, to)?;
            Ok::<_, Error>(AttachmentResolve { view: to.view.clone(), mode })
        });
        let (load_op, store_op) = ops(&self.render_pass.attachments[number]);
        let clear = || self.clear_value(view, number);
        let Subpass { samples, own_modes, .. } = self.render_pass.subpasses[subpass];
        let mode = match aspect {
            Aspect::Color => ResolveMode::Average,
            Aspect::Depth => own_modes[0],
            Aspect::Stencil => own_modes[1],
        };
        Ok(Attachment {
            multisampled: multisampled(view, samples, mode),
            view: view.view.clone(),
            load: if self.render_pass.is_first_use(subpass, number) { load(load_op, clear)? } else { LoadOp::Load },
            store: if self.render_pass.is_last_use(subpass, number) { store(store_op)? } else { StoreOp::Store },
            resolve: resolve.transpose()?,
        })
    }
}

type Ops = (vk::AttachmentLoadOp, vk::AttachmentStoreOp);

/// The operations of colour and depth.
fn main_ops(attachment: &AttachmentDescription) -> Ops {
    (attachment.load, attachment.store)
}

/// The operations of stencil.
fn stencil_ops(attachment: &AttachmentDescription) -> Ops {
    (attachment.stencil_load, attachment.stencil_store)
}

/// The resolve of an attachment, to another attachment or to a view.
#[derive(Clone)]
pub(crate) struct ResolveTo<T> {
    pub(crate) target: T,
    pub(crate) mode: ResolveMode,
}

/// An attachment of dynamic rendering.
#[derive(Clone)]
pub(crate) struct DynamicAttachment {
    /// The view that is rendered to.
    pub(crate) view: Arc<ImageView>,
    /// The operation at the beginning.
    pub(crate) load: vk::AttachmentLoadOp,
    /// The operation at the end.
    pub(crate) store: vk::AttachmentStoreOp,
    /// The value that it is cleared to.
    pub(crate) clear_value: vk::ClearValue,
    /// The resolve at the end, to a view.
    pub(crate) resolve: Option<ResolveTo<Arc<ImageView>>>,
    /// The combination of samples, if it is given.
    pub(crate) mode: Option<ResolveMode>,
}

/// Dynamic rendering.
#[derive(Clone, Default)]
pub(crate) struct DynamicRendering {
    /// The flags of suspension and resumption.
    pub(crate) flags: vk::RenderingFlags,
    /// The pixels rendered.
    pub(crate) area: vk::Rect2D,
    /// The layers rendered.
    pub(crate) layers: u32,
    /// The views that draws render to, a bit each; 0 without views.
    pub(crate) view_mask: u32,
    /// The samples with which attachments of one sample are rendered to, if there are several.
    pub(crate) samples: Option<u32>,
    /// Colour attachments by location.
    pub(crate) color: Vec<Option<DynamicAttachment>>,
    /// The depth attachment.
    pub(crate) depth: Option<DynamicAttachment>,
    /// The stencil attachment.
    pub(crate) stencil: Option<DynamicAttachment>,
}

impl DynamicRendering {
    /// The packet that begins it.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] for operations that Vulkan does not have and for views that cannot be attachments
    /// together.
    pub(crate) fn packet(&self) -> Result<Packet, Error> {
        let optional = |attachment: &Option<DynamicAttachment>, aspect| {
            attachment.as_ref().map(|attachment| self.attachment(attachment, aspect)).transpose()
        };
        begin(Rendering {
            area: rect(self.area),
            layer_count: layers(self.view_mask, self.layers),
            view_mask: self.view_mask,
            color: self.color.iter().map(|attachment| optional(attachment, Aspect::Color)).collect::<Result<_, _>>()?,
            depth: optional(&self.depth, Aspect::Depth)?,
            stencil: optional(&self.stencil, Aspect::Stencil)?,
        })
    }

    /// An attachment. Between suspension and resumption attachments are in memory.
    fn attachment(&self, attachment: &DynamicAttachment, aspect: Aspect) -> Result<Attachment, Error> {
        let layers = layers(self.view_mask, self.layers);
        check_attachment(&attachment.view, aspect, layers)?;
        // Rendering that is suspended is resolved where it ends.
        let suspends = self.flags.contains(vk::RenderingFlags::SUSPENDING);
        let resolve = attachment.resolve.as_ref().filter(|_| !suspends);
        let resolve = resolve.map(|ResolveTo { target, mode }| {
            check_attachment(target, aspect, layers)?;
            check_resolve(&attachment.view, target)?;
            Ok::<_, Error>(AttachmentResolve { view: target.view.clone(), mode: *mode })
        });
        let format = attachment.view.view.format;
        let usual = if aspect == Aspect::Color { ResolveMode::Average } else { ResolveMode::SampleZero };
        Ok(Attachment {
            multisampled: multisampled(&attachment.view, self.samples, attachment.mode.unwrap_or(usual)),
            view: attachment.view.view.clone(),
            load: if self.flags.contains(vk::RenderingFlags::RESUMING) {
                LoadOp::Load
            } else {
                load(attachment.load, || clear_value(format, attachment.clear_value))?
            },
            store: if suspends { StoreOp::Store } else { store(attachment.store)? },
            resolve: resolve.transpose()?,
        })
    }
}

/// The render pass, or dynamic rendering, within which commands are recorded.
pub(crate) enum RenderScope {
    /// A render pass, in one of its subpasses.
    RenderPass { instance: Box<RenderPassInstance>, subpass: usize, formats: Vec<Option<Format>> },
    /// Dynamic rendering.
    Dynamic { formats: Vec<Option<Format>> },
    /// The pass of the primary command buffer.
    Inherited { formats: Vec<Option<Format>> },
}

impl RenderScope {
    /// The formats of colour attachments; `None` for an unused one.
    pub(crate) fn color_formats(&self) -> &[Option<Format>] {
        let (Self::RenderPass { formats, .. } | Self::Dynamic { formats } | Self::Inherited { formats }) = self;
        formats
    }
}

/// The formats of the colour attachments of a [`Packet::BeginRendering`].
pub(super) fn color_formats(packet: &Packet) -> Vec<Option<Format>> {
    let Packet::BeginRendering(rendering) = packet else {
        return Vec::new();
    };
    let format = |attachment: &Option<Attachment>| attachment.as_ref().map(|attachment| attachment.view.format);
    rendering.color.iter().map(format).collect()
}
