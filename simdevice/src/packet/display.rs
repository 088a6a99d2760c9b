//! Packets for people: a line each, with the state that matters.

use super::draw::{CompareOp, DepthStencil, Draw, LogicOp};
use super::{
    Aspect, Attachment, AttachmentClear, BlendState, BufferRange, ClearAttachments, ClearValue,
    GaussianAppend, GaussianBegin, LoadOp, Packet, Rect, Rendering, SubresourceLayers,
};
use crate::image::{Image, ImageView};
use std::fmt::{self, Display, Formatter};

/// Displays a value by a function.
struct By<F>(F);

impl<F: Fn(&mut Formatter<'_>) -> fmt::Result> Display for By<F> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        (self.0)(f)
    }
}

/// `separator` between the items.
fn joined<T: Display>(items: impl IntoIterator<Item = T> + Clone, separator: &str) -> impl Display {
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

impl Display for Rect {
    /// `widthxheight+x+y`.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self {
            x,
            y,
            width,
            height,
        } = self;
        write!(f, "{width}x{height}{x:+}{y:+}")
    }
}

impl Display for ClearValue {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Float(value) => write!(f, "{value:?}"),
            Self::Int(value) => write!(f, "{value:?}"),
            Self::Uint(value) => write!(f, "{value:?}"),
            Self::DepthStencil { depth, stencil } => write!(f, "depth {depth}, stencil {stencil}"),
        }
    }
}

/// An image's format and size.
fn image(image: &Image) -> impl Display + '_ {
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

fn view(view: &ImageView) -> impl Display + '_ {
    image(&view.image)
}

fn buffer(range: &BufferRange) -> impl Display {
    let (offset, size) = (range.offset, range.size);
    By(move |f: &mut Formatter<'_>| write!(f, "buffer {offset}..{}", offset + size))
}

fn layers(layers: SubresourceLayers) -> impl Display {
    By(move |f: &mut Formatter<'_>| {
        let SubresourceLayers {
            aspect,
            mip_level,
            base_layer,
            layer_count,
        } = layers;
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

fn attachment<'a>(name: &'a str, attachment: &'a Attachment) -> impl Display + 'a {
    By(move |f: &mut Formatter<'_>| {
        write!(f, ", {name} {}", view(&attachment.view))?;
        match attachment.load {
            LoadOp::Load => f.write_str(" loaded")?,
            LoadOp::Clear(value) => write!(f, " cleared to {value}")?,
            LoadOp::DontCare => f.write_str(" undefined")?,
        }
        write!(f, " then {:?}", attachment.store)?;
        if let Some((target, mode)) = &attachment.resolve {
            write!(f, ", resolved by {mode:?} to {}", view(target))?;
        }
        Ok(())
    })
}

fn rendering(rendering: &Rendering) -> impl Display + '_ {
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

fn clear_attachments(clear: &ClearAttachments) -> impl Display + '_ {
    By(|f: &mut Formatter<'_>| {
        let what = clear.clears.iter().map(|clear| {
            By(move |f: &mut Formatter<'_>| match clear {
                AttachmentClear::Color { index, value } => write!(f, "color {index} to {value}"),
                AttachmentClear::Depth(depth) => write!(f, "depth to {depth}"),
                AttachmentClear::Stencil(stencil) => write!(f, "stencil to {stencil}"),
            })
        });
        let rects = clear.rects.iter().map(|(rect, ..)| rect);
        write!(
            f,
            "clear attachments: {} in {}",
            joined(what, ", "),
            joined(rects, ", ")
        )
    })
}

fn compare(op: CompareOp) -> &'static str {
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
fn output<'a>(
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
            write!(
                f,
                ", stencil {} {} & {:#x}",
                compare(front.compare),
                front.reference,
                front.compare_mask
            )?;
        }
        if let Some(logic) = logic {
            write!(f, ", logic {logic:?}")?;
        }
        for blend in blend {
            match blend.equations {
                None => f.write_str(", replaced")?,
                Some((color, alpha)) => {
                    write!(
                        f,
                        ", {:?} {:?} {:?}",
                        color.op, color.source, color.destination
                    )?;
                    if alpha != color {
                        write!(
                            f,
                            ", alpha {:?} {:?} {:?}",
                            alpha.op, alpha.source, alpha.destination
                        )?;
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

fn draw(draw: &Draw) -> impl Display + '_ {
    By(|f: &mut Formatter<'_>| {
        let state = &draw.state;
        write!(f, "draw {:?}", state.topology)?;
        let what = if draw.indices.is_some() {
            "indices"
        } else {
            "vertices"
        };
        write!(
            f,
            " {what} {}..{}",
            draw.first,
            u64::from(draw.first) + u64::from(draw.count)
        )?;
        if [draw.first_instance, draw.instance_count] != [0, 1] {
            let end = u64::from(draw.first_instance) + u64::from(draw.instance_count);
            write!(f, " instances {}..{end}", draw.first_instance)?;
        }
        write!(f, " in {}", joined(&state.scissors, ", "))?;
        write!(
            f,
            "{}",
            output(&state.depth_stencil, state.logic_op, &state.blend)
        )
    })
}

fn gaussian_begin(begin: &GaussianBegin) -> impl Display + '_ {
    By(|f: &mut Formatter<'_>| {
        let state = &begin.state;
        write!(
            f,
            "begin gaussians {:?} degree {} by {:?} in {}",
            begin.camera.model, state.sh_degree, state.order, begin.scissor,
        )?;
        write!(
            f,
            "{}",
            output(&state.depth_stencil, state.logic_op, &state.blend)
        )
    })
}

fn gaussian_append(append: &GaussianAppend) -> impl Display {
    let (vertices, instances) = (
        [append.first, append.count],
        [append.first_instance, append.instance_count],
    );
    appended(append.indices.is_some(), vertices, instances)
}

fn gaussian_append_draw(draw: &Draw) -> impl Display {
    let (vertices, instances) = (
        [draw.first, draw.count],
        [draw.first_instance, draw.instance_count],
    );
    let what = appended(draw.indices.is_some(), vertices, instances);
    By(move |f: &mut Formatter<'_>| write!(f, "{what}, shaded"))
}

/// First and count of vertices and of instances.
fn appended(indexed: bool, [first, count]: [u32; 2], instances: [u32; 2]) -> impl Display {
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

/// A line without its end. What a packet is bound to is named by format, size or place, not by which it is.
impl Display for Packet {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let boxed = |[x, y, z]: [i32; 3], [width, height, depth]: [u32; 3]| {
            By(move |f: &mut Formatter<'_>| write!(f, "{width}x{height}x{depth}{x:+}{y:+}{z:+}"))
        };
        match self {
            Self::CopyBuffer(copy) => write!(
                f,
                "copy {} to {}: {} regions",
                buffer(&copy.source),
                buffer(&copy.target),
                copy.regions.len()
            ),
            Self::CopyBufferToImage(copy) | Self::CopyImageToBuffer(copy) => {
                let (buffer, image) = (buffer(&copy.buffer), image(&copy.image));
                match self {
                    Self::CopyBufferToImage(_) => write!(f, "copy {buffer} to {image}")?,
                    _ => write!(f, "copy {image} to {buffer}")?,
                }
                for region in &copy.regions {
                    let place = boxed(region.image_offset, region.image_extent);
                    write!(
                        f,
                        ", {place} {} at {}",
                        layers(region.subresource),
                        region.buffer_offset
                    )?;
                }
                Ok(())
            }
            Self::CopyImage(copy) => {
                write!(f, "copy {} to {}", image(&copy.source), image(&copy.target))?;
                for region in &copy.regions {
                    let [x, y, z] = region.target_offset;
                    let from = boxed(region.source_offset, region.extent);
                    write!(f, ", {from} {} to {x:+}{y:+}{z:+}", layers(region.source))?;
                }
                Ok(())
            }
            Self::BlitImage(blit) => write!(
                f,
                "blit {} to {} {:?}: {} regions",
                image(&blit.source),
                image(&blit.target),
                blit.filter,
                blit.regions.len()
            ),
            Self::ResolveImage(resolve) => write!(
                f,
                "resolve {} to {} by {:?}: {} regions",
                image(&resolve.source),
                image(&resolve.target),
                resolve.mode,
                resolve.regions.len()
            ),
            Self::FillBuffer { target, word } => {
                write!(f, "fill {} with {word:#010x}", buffer(target))
            }
            Self::UpdateBuffer { target, data } => {
                write!(f, "update {} with {} bytes", buffer(target), data.len())
            }
            Self::ClearImage(clear) => {
                write!(f, "clear {} to {}", image(&clear.image), clear.value)
            }
            Self::BeginRendering(it) => write!(f, "{}", rendering(it)),
            Self::ClearAttachments(clear) => write!(f, "{}", clear_attachments(clear)),
            Self::GaussianBegin(begin) => write!(f, "{}", gaussian_begin(begin)),
            Self::GaussianAppend(append) => write!(f, "{}", gaussian_append(append)),
            Self::GaussianAppendDraw(draw) => write!(f, "{}", gaussian_append_draw(draw)),
            Self::GaussianResolveShader(_) => f.write_str("shade the fragments of gaussians"),
            Self::GaussianResolve => f.write_str("resolve gaussians"),
            Self::Dispatch(dispatch) => {
                let [x, y, z] = dispatch.count;
                write!(f, "dispatch {x}x{y}x{z} workgroups")?;
                if dispatch.base != [0; 3] {
                    write!(f, " from {:?}", dispatch.base)?;
                }
                Ok(())
            }
            Self::Draw(it) => write!(f, "{}", draw(it)),
            Self::Barrier => f.write_str("barrier"),
            Self::EndRendering => f.write_str("end rendering"),
            Self::BeginQuery { index, .. } => write!(f, "begin query {index}"),
            Self::EndQuery { index, .. } => write!(f, "end query {index}"),
            Self::ResetQueries { first, count, .. } => {
                write!(
                    f,
                    "reset queries {first}..{}",
                    u64::from(*first) + u64::from(*count)
                )
            }
            Self::WriteTimestamp { index, .. } => write!(f, "write timestamp {index}"),
        }
    }
}
