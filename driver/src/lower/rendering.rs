//! Lowers render passes and dynamic rendering: attachments, load and store operations, clear values.

#[cfg(test)]
mod tests;

use crate::error::Error;
use crate::object::image::ImageView;
use crate::object::render_pass::{AttachmentDescription, RenderPass};
use ash::vk;
use simdevice::format::{Aspect, Channel, ClearValue, Numeric};
use simdevice::packet::{Attachment, LoadOp, Rendering, StoreOp};
use simdevice::state::{Rect, ResolveMode};
use simdevice::{Format, Packet};
use std::sync::Arc;

/// A rectangle for the device.
pub(crate) fn rect(rect: vk::Rect2D) -> Rect {
    Rect {
        x: rect.offset.x,
        y: rect.offset.y,
        width: rect.extent.width,
        height: rect.extent.height,
    }
}

/// A colour clear value for an image of that format.
pub(crate) fn clear_color(format: Format, value: vk::ClearColorValue) -> ClearValue {
    // SAFETY: every member of the union is sixteen bytes of plain data, and Vulkan has the application write the one
    // that the format calls for.
    unsafe {
        match format.numeric() {
            Numeric::Sint => ClearValue::Int(value.int32),
            Numeric::Uint => ClearValue::Uint(value.uint32),
            _ => ClearValue::Float(value.float32),
        }
    }
}

/// A depth and stencil clear value.
pub(crate) fn clear_depth_stencil(value: vk::ClearDepthStencilValue) -> ClearValue {
    ClearValue::DepthStencil {
        depth: value.depth,
        stencil: value.stencil,
    }
}

/// An attachment's clear value, read as its format calls for.
pub(crate) fn clear_value(format: Format, value: vk::ClearValue) -> ClearValue {
    // SAFETY: both members of the union are plain data, and Vulkan has the application write the one that the format
    // calls for. The union is as large as its largest member, so reading the colour stays inside it.
    unsafe {
        if format.has(Channel::D) || format.has(Channel::S) {
            clear_depth_stencil(value.depth_stencil)
        } else {
            clear_color(format, value.color)
        }
    }
}

/// Checks that a view can be an attachment of `layers` layers for an aspect.
fn check_attachment(view: &ImageView, aspect: Aspect, layers: u32) -> Result<(), Error> {
    let view = &view.view;
    if view.format.aspects().contains(&aspect) && layers <= view.layer_count {
        return Ok(());
    }
    Err(Error::usage(
        "VUID-vkCmdBeginRendering-attachment",
        format!(
            "a view of format {:?} with {} layers is the {aspect:?} attachment of a pass with {layers} layers",
            view.format, view.layer_count
        ),
    ))
}

/// What an attachment does at the beginning of a pass.
fn load(op: vk::AttachmentLoadOp, clear: impl FnOnce() -> ClearValue) -> Result<LoadOp, Error> {
    match op {
        vk::AttachmentLoadOp::LOAD => Ok(LoadOp::Load),
        vk::AttachmentLoadOp::CLEAR => Ok(LoadOp::Clear(clear())),
        vk::AttachmentLoadOp::DONT_CARE | vk::AttachmentLoadOp::NONE_KHR => Ok(LoadOp::DontCare),
        other => Err(Error::usage(
            "VUID-VkRenderingAttachmentInfo-loadOp-parameter",
            format!("{other:?} is not a VkAttachmentLoadOp"),
        )),
    }
}

/// What an attachment does at the end of a pass.
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

/// How samples become one, if they do.
///
/// # Errors
/// [`Error::Usage`] for modes that Vulkan does not have.
pub(crate) fn resolve_mode(mode: vk::ResolveModeFlags) -> Result<Option<ResolveMode>, Error> {
    match mode {
        vk::ResolveModeFlags::NONE => Ok(None),
        vk::ResolveModeFlags::SAMPLE_ZERO => Ok(Some(ResolveMode::SampleZero)),
        vk::ResolveModeFlags::AVERAGE => Ok(Some(ResolveMode::Average)),
        vk::ResolveModeFlags::MIN => Ok(Some(ResolveMode::Min)),
        vk::ResolveModeFlags::MAX => Ok(Some(ResolveMode::Max)),
        other => Err(Error::usage(
            "VUID-VkRenderingAttachmentInfo-resolveMode-parameter",
            format!("{other:?} is not a VkResolveModeFlagBits"),
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

/// The packet that begins rendering, once its attachments are known to have as many samples as one another: the device
/// would be lost over them, too late to say which command was wrong.
fn begin(rendering: Rendering) -> Result<Packet, Error> {
    let single = [&rendering.depth, &rendering.stencil];
    let attachments = rendering.color.iter().chain(single).flatten();
    let samples = attachments.map(|attachment| attachment.view.image.desc.samples);
    let samples: Vec<_> = samples.collect();
    if let Some(pair) = samples.windows(2).find(|pair| pair[0] != pair[1]) {
        return Err(Error::usage(
            "VUID-VkRenderingInfo-multisampledRenderToSingleSampled-06857",
            format!("an attachment has {} samples, another {}", pair[0], pair[1]),
        ));
    }
    Ok(Packet::BeginRendering(Box::new(rendering)))
}

/// A render pass that has begun, with what it renders to.
#[derive(Clone)]
pub(crate) struct BegunPass {
    /// The render pass.
    pub(crate) render_pass: Arc<RenderPass>,
    /// A view for each attachment.
    pub(crate) views: Vec<Arc<ImageView>>,
    /// What attachments that are cleared become, by attachment; may be short.
    pub(crate) clear_values: Vec<vk::ClearValue>,
    /// The pixels rendered.
    pub(crate) area: Rect,
    /// The layers rendered.
    pub(crate) layers: u32,
}

impl BegunPass {
    /// The packet that begins a subpass.
    ///
    /// # Errors
    /// [`Error::Usage`] if the pass has no such subpass, a view is missing, or views cannot be attachments of one subpass.
    pub(crate) fn subpass(&self, index: usize) -> Result<Packet, Error> {
        let Some(subpass) = self.render_pass.subpasses.get(index) else {
            return Err(Error::usage(
                "VUID-vkCmdNextSubpass-None-00909",
                format!("the render pass has no subpass {index}"),
            ));
        };
        let resolved = subpass
            .resolve
            .iter()
            .copied()
            .chain(std::iter::repeat(None));
        let color = subpass.color.iter().zip(resolved).map(|(used, resolved)| {
            let ops = AttachmentDescription::main;
            let resolve = resolved.map(|number| (number, ResolveMode::Average));
            used.map(|number| self.attachment(index, number, Aspect::Color, ops, resolve))
                .transpose()
        });
        let depth_stencil = |aspect, ops| {
            let has_aspect = |format: Format| format.aspects().contains(&aspect);
            let number = subpass
                .depth_stencil
                .filter(|&number| self.format(number).is_some_and(has_aspect));
            let resolve = subpass.depth_stencil_resolve.and_then(|resolve| {
                let mode = match aspect {
                    Aspect::Stencil => resolve.stencil,
                    Aspect::Color | Aspect::Depth => resolve.depth,
                };
                mode.map(|mode| (resolve.attachment, mode))
            });
            number
                .map(|number| self.attachment(index, number, aspect, ops, resolve))
                .transpose()
        };
        begin(Rendering {
            area: self.area,
            layer_count: self.layers,
            color: color.collect::<Result<_, _>>()?,
            depth: depth_stencil(Aspect::Depth, AttachmentDescription::main)?,
            stencil: depth_stencil(Aspect::Stencil, AttachmentDescription::stencil)?,
        })
    }

    /// The packets that clear what a subpass reads before anything was rendered to it.
    ///
    /// # Errors
    /// [`Error::Usage`] if a view is missing.
    pub(crate) fn clears_before_reads(&self, index: usize) -> Result<Vec<Packet>, Error> {
        let mut packets = Vec::new();
        for number in self.render_pass.first_read(index) {
            let Some(format) = self.format(number) else {
                continue;
            };
            let cleared = |aspect, ops: fn(&AttachmentDescription) -> Ops| {
                let (load, _) = ops(&self.render_pass.attachments[number]);
                let is_cleared =
                    format.aspects().contains(&aspect) && load == vk::AttachmentLoadOp::CLEAR;
                is_cleared
                    .then(|| self.attachment(index, number, aspect, ops, None))
                    .transpose()
            };
            let color = cleared(Aspect::Color, AttachmentDescription::main)?;
            let depth = cleared(Aspect::Depth, AttachmentDescription::main)?;
            let stencil = cleared(Aspect::Stencil, AttachmentDescription::stencil)?;
            let mut attachments = [color, depth, stencil];
            if attachments.iter().all(Option::is_none) {
                continue;
            }
            for attachment in attachments.iter_mut().flatten() {
                attachment.store = StoreOp::Store;
            }
            let [color, depth, stencil] = attachments;
            packets.push(Packet::BeginRendering(Box::new(Rendering {
                area: self.area,
                layer_count: self.layers,
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

    /// An attachment and, if it is resolved, the attachment that it is resolved to and how.
    fn attachment(
        &self,
        subpass: usize,
        number: usize,
        aspect: Aspect,
        ops: fn(&AttachmentDescription) -> Ops,
        resolve: Option<(usize, ResolveMode)>,
    ) -> Result<Attachment, Error> {
        let view = self.view(number)?;
        check_attachment(view, aspect, self.layers)?;
        let resolve = resolve.map(|(number, mode)| {
            let to = self.view(number)?;
            check_attachment(to, aspect, self.layers)?;
            check_resolve(view, to)?;
            Ok::<_, Error>((to.view.clone(), mode))
        });
        let (load_op, store_op) = ops(&self.render_pass.attachments[number]);
        // A clear value that is missing is the application's error; zero is as good as any.
        let clear = || {
            let value = self.clear_values.get(number).copied().unwrap_or_default();
            clear_value(view.view.format, value)
        };
        Ok(Attachment {
            view: view.view.clone(),
            load: if self.render_pass.is_first_use(subpass, number) {
                load(load_op, clear)?
            } else {
                LoadOp::Load
            },
            store: if self.render_pass.is_last_use(subpass, number) {
                store(store_op)?
            } else {
                StoreOp::Store
            },
            resolve: resolve.transpose()?,
        })
    }
}

type Ops = (vk::AttachmentLoadOp, vk::AttachmentStoreOp);

impl AttachmentDescription {
    /// The operations of colour and depth.
    fn main(&self) -> Ops {
        (self.load, self.store)
    }

    /// The operations of stencil.
    fn stencil(&self) -> Ops {
        (self.stencil_load, self.stencil_store)
    }
}

/// An attachment of dynamic rendering.
#[derive(Clone)]
pub(crate) struct DynamicAttachment {
    /// What is rendered to.
    pub(crate) view: Arc<ImageView>,
    /// What happens at the beginning.
    pub(crate) load: vk::AttachmentLoadOp,
    /// What happens at the end.
    pub(crate) store: vk::AttachmentStoreOp,
    /// What it is cleared to.
    pub(crate) clear_value: vk::ClearValue,
    /// Where it is resolved to, and how.
    pub(crate) resolve: Option<(Arc<ImageView>, ResolveMode)>,
}

/// Dynamic rendering.
#[derive(Clone, Default)]
pub(crate) struct DynamicRendering {
    /// Whether it suspends or resumes.
    pub(crate) flags: vk::RenderingFlags,
    /// The pixels rendered.
    pub(crate) area: vk::Rect2D,
    /// The layers rendered.
    pub(crate) layers: u32,
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
    /// [`Error::Usage`] for operations that Vulkan does not have and for views that cannot be attachments together.
    pub(crate) fn packet(&self) -> Result<Packet, Error> {
        let optional = |attachment: &Option<DynamicAttachment>, aspect| {
            attachment
                .as_ref()
                .map(|attachment| self.attachment(attachment, aspect))
                .transpose()
        };
        begin(Rendering {
            area: rect(self.area),
            layer_count: self.layers,
            color: self
                .color
                .iter()
                .map(|attachment| optional(attachment, Aspect::Color))
                .collect::<Result<_, _>>()?,
            depth: optional(&self.depth, Aspect::Depth)?,
            stencil: optional(&self.stencil, Aspect::Stencil)?,
        })
    }

    /// Between suspension and resumption attachments are in memory.
    fn attachment(
        &self,
        attachment: &DynamicAttachment,
        aspect: Aspect,
    ) -> Result<Attachment, Error> {
        check_attachment(&attachment.view, aspect, self.layers)?;
        // What is suspended is resolved where it ends.
        let suspends = self.flags.contains(vk::RenderingFlags::SUSPENDING);
        let resolve = attachment.resolve.as_ref().filter(|_| !suspends);
        let resolve = resolve.map(|(view, mode)| {
            check_attachment(view, aspect, self.layers)?;
            check_resolve(&attachment.view, view)?;
            Ok::<_, Error>((view.view.clone(), *mode))
        });
        let format = attachment.view.view.format;
        Ok(Attachment {
            view: attachment.view.view.clone(),
            load: if self.flags.contains(vk::RenderingFlags::RESUMING) {
                LoadOp::Load
            } else {
                load(attachment.load, || {
                    clear_value(format, attachment.clear_value)
                })?
            },
            store: if suspends {
                StoreOp::Store
            } else {
                store(attachment.store)?
            },
            resolve: resolve.transpose()?,
        })
    }
}
