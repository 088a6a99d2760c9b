//! Packets as text for people: one line each, with the most important state.

use super::{
    Attachment, AttachmentClear, ClearAttachments, GaussianAppend, GaussianBegin, LoadOp, Rendering, SubresourceLayers,
};
use crate::format::Aspect;
use crate::image::{Image, ImageView};
use crate::packet::Draw;
use crate::state::{BlendEquations, BlendState, CompareOp, DepthStencil, LogicOp};
use devmem::BufferRange;
use std::fmt::{self, Display, Formatter};

/// Displays a value by a function.
pub(super) struct By<F>(pub(super) F);

impl<F: Fn(&mut Formatter<'_>) -> fmt::Result> Display for By<F> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        (self.0)(f)
    }
}

/// The items with `separator` between them.
pub(super) fn joined<T: Display>(items: impl IntoIterator<Item = T> + Clone, separator: &str) -> impl Display {
    By(move |f: &mut Formatter<'_>| {
        for (index, item) in items.clone().into_iter().enumerate() {
            if index > 0 {
                f.write_str(separator)?;
            }
            write!(f, "{item}")?;
        }
        Ok(())
    })
}

/// An image's format and size.
pub(super) fn image(image: &Image) -> impl Display + '_ {
    By(|f: &mut Formatter<'_>| {
        let desc = &image.desc;
        let [width, height, _] = desc.extent;
        write!(f, "{:?} {width}x{height}", desc.format)?;
        if desc.samples > 1 {
            write!(f, " of {} samples", desc.samples)?;
        }
        Ok(())
    })
}

pub(super) fn view(view: &ImageView) -> impl Display + '_ {
    image(&view.image)
}

pub(super) fn buffer(range: &BufferRange) -> impl Display {
    let (offset, size) = (range.offset, range.size);
    By(move |f: &mut Formatter<'_>| write!(f, "buffer {offset}..{}", offset + size))
}

pub(super) fn layers(layers: SubresourceLayers) -> impl Display {
    By(move |f: &mut Formatter<'_>| {
        let SubresourceLayers { aspect, mip_level, base_layer, layer_count } = layers;
        if aspect != Aspect::Color {
            write!(f, "{aspect:?} ")?;
        }
        write!(f, "level {mip_level} layer {base_layer}")?;
        if layer_count > 1 {
            write!(f, "..{}", base_layer + layer_count)?;
        }
        Ok(())
    })
}

pub(super) fn attachment<'a>(name: &'a str, attachment: &'a Attachment) -> impl Display + 'a {
    By(move |f: &mut Formatter<'_>| {
        write!(f, ", {name} {}", view(&attachment.view))?;
        match attachment.load {
            LoadOp::Load => f.write_str(" loaded")?,
            LoadOp::Clear(value) => write!(f, " cleared to {value}")?,
            LoadOp::DontCare => f.write_str(" undefined")?,
        }
        write!(f, " then {:?}", attachment.store)?;
        if let Some(resolve) = &attachment.resolve {
            write!(f, ", resolved by {:?} to {}", resolve.mode, view(&resolve.view))?;
        }
        Ok(())
    })
}

pub(super) fn rendering(rendering: &Rendering) -> impl Display + '_ {
    By(|f: &mut Formatter<'_>| {
        write!(f, "begin rendering {}", rendering.area)?;
        if rendering.layer_count > 1 {
            write!(f, " of {} layers", rendering.layer_count)?;
        }
        for (index, color) in rendering.color.iter().enumerate() {
            if let Some(color) = color {
                write!(f, "{}", attachment(&format!("color {index}"), color))?;
            }
        }
        for (name, aspect) in [("depth", &rendering.depth), ("stencil", &rendering.stencil)] {
            if let Some(aspect) = aspect {
                write!(f, "{}", attachment(name, aspect))?;
            }
        }
        Ok(())
    })
}

pub(super) fn clear_attachments(clear: &ClearAttachments) -> impl Display + '_ {
    By(|f: &mut Formatter<'_>| {
        let what = clear.clears.iter().map(|clear| {
            By(move |f: &mut Formatter<'_>| match clear {
                AttachmentClear::Color { index, value } => write!(f, "color {index} to {value}"),
                AttachmentClear::Depth(depth) => write!(f, "depth to {depth}"),
                AttachmentClear::Stencil(stencil) => write!(f, "stencil to {stencil}"),
            })
        });
        let rects = clear.rects.iter().map(|(rect, ..)| rect);
        write!(f, "clear attachments: {} in {}", joined(what, ", "), joined(rects, ", "))
    })
}

pub(super) fn compare(op: CompareOp) -> &'static str {
    match op {
        CompareOp::Never => "never",
        CompareOp::Less => "<",
        CompareOp::Equal => "==",
        CompareOp::LessOrEqual => "<=",
        CompareOp::Greater => ">",
        CompareOp::NotEqual => "!=",
        CompareOp::GreaterOrEqual => ">=",
        CompareOp::Always => "always",
    }
}

/// The fixed-function state of fragments.
pub(super) fn output<'a>(
    tests: &'a DepthStencil,
    logic: Option<LogicOp>,
    blend: &'a [BlendState],
) -> impl Display + 'a {
    By(move |f: &mut Formatter<'_>| {
        if let Some(depth) = tests.depth {
            write!(f, ", depth {}", compare(depth.compare))?;
            f.write_str(if depth.write { " written" } else { "" })?;
        }
        if let Some((least, greatest)) = tests.bounds {
            write!(f, ", depth within {least}..{greatest}")?;
        }
        if let Some([front, _]) = tests.stencil {
            write!(f, ", stencil {} {} & {:#x}", compare(front.compare), front.reference, front.compare_mask)?;
        }
        if let Some(logic) = logic {
            write!(f, ", logic {logic:?}")?;
        }
        for blend in blend {
            match blend.equations {
                None => f.write_str(", replaced")?,
                Some(BlendEquations { color, alpha }) => {
                    write!(f, ", {:?} {:?} {:?}", color.op, color.source, color.destination)?;
                    if alpha != color {
                        write!(f, ", alpha {:?} {:?} {:?}", alpha.op, alpha.source, alpha.destination)?;
                    }
                }
            }
            if blend.write_mask != 0xF {
                write!(f, " masked by {:04b}", blend.write_mask)?;
            }
        }
        Ok(())
    })
}

pub(super) fn draw(draw: &Draw) -> impl Display + '_ {
    By(|f: &mut Formatter<'_>| {
        let state = &draw.state;
        write!(f, "draw {:?}", state.topology)?;
        let what = if draw.indices.is_some() { "indices" } else { "vertices" };
        write!(f, " {what} {}..{}", draw.first, u64::from(draw.first) + u64::from(draw.count))?;
        if [draw.first_instance, draw.instance_count] != [0, 1] {
            let end = u64::from(draw.first_instance) + u64::from(draw.instance_count);
            write!(f, " instances {}..{end}", draw.first_instance)?;
        }
        write!(f, " in {}", joined(&state.scissors, ", "))?;
        write!(f, "{}", output(&state.depth_stencil, state.logic_op, &state.blend))
    })
}

pub(super) fn gaussian_begin(begin: &GaussianBegin) -> impl Display + '_ {
    By(|f: &mut Formatter<'_>| {
        let state = &begin.state;
        write!(
            f,
            "begin gaussians {:?} degree {} by {:?} in {}",
            begin.camera.model, state.sh_degree, state.order, begin.scissor,
        )?;
        write!(f, "{}", output(&state.depth_stencil, state.logic_op, &state.blend))
    })
}

pub(super) fn gaussian_append(append: &GaussianAppend) -> impl Display {
    let (vertices, instances) = ([append.first, append.count], [append.first_instance, append.instance_count]);
    appended(append.indices.is_some(), vertices, instances)
}

pub(super) fn gaussian_append_draw(draw: &Draw) -> impl Display {
    let (vertices, instances) = ([draw.first, draw.count], [draw.first_instance, draw.instance_count]);
    let what = appended(draw.indices.is_some(), vertices, instances);
    By(move |f: &mut Formatter<'_>| write!(f, "{what}, shaded"))
}

/// The text of appended Gaussians. Vertices and instances are each given by their first number and their count.
pub(super) fn appended(indexed: bool, [first, count]: [u32; 2], instances: [u32; 2]) -> impl Display {
    By(move |f: &mut Formatter<'_>| {
        let what = if indexed { "indices" } else { "gaussians" };
        let end = u64::from(first) + u64::from(count);
        write!(f, "append {what} {first}..{end}")?;
        if instances != [0, 1] {
            let [first, count] = instances;
            let end = u64::from(first) + u64::from(count);
            write!(f, " instances {first}..{end}")?;
        }
        Ok(())
    })
}
