//! Render passes: their attachments, and clears of attachments within a pass.

use crate::format::ClearValue;
use crate::image::ImageView;
use crate::state::{Rect, ResolveMode};

/// The treatment of an attachment's contents when a pass begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoadOp {
    /// Reads the contents.
    Load,
    /// Replaces the contents by a value.
    Clear(ClearValue),
    /// Leaves the contents undefined. This device keeps them.
    DontCare,
}

/// The treatment of an attachment's contents when a pass ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreOp {
    /// Writes the contents to memory.
    Store,
    /// Leaves the memory undefined. This device may write the contents or not.
    DontCare,
    /// Leaves the memory as it is, because the pass does not write the attachment.
    None,
}

/// An attachment of a pass.
#[derive(Clone, Debug)]
pub struct Attachment {
    /// The view of the image that is rendered to.
    pub view: ImageView,
    /// The operation at the beginning of the pass.
    pub load: LoadOp,
    /// The operation at the end of the pass.
    pub store: StoreOp,
    /// The resolve of the pass's area at the end, if there is one. `store` does not apply to it.
    pub resolve: Option<AttachmentResolve>,
    /// The samples with which an attachment of one sample per texel is rendered to, if there are several.
    pub multisampled: Option<Multisampled>,
}

/// Samples that an attachment has during a pass alone. Each begins as the view's texel, and the view receives their
/// combination at the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Multisampled {
    /// The number of samples per texel.
    pub samples: u32,
    /// The combination of samples.
    pub mode: ResolveMode,
}

/// The resolve of an attachment.
#[derive(Clone, Debug)]
pub struct AttachmentResolve {
    /// The view that is written. It has one sample per texel, and is as large as the attachment.
    pub view: ImageView,
    /// The combination of samples.
    pub mode: ResolveMode,
}

/// A render pass: see [`Packet::BeginRendering`](crate::Packet::BeginRendering).
#[derive(Clone, Debug)]
pub struct Rendering {
    /// The pixels that the pass may touch.
    pub area: Rect,
    /// The number of layers of each attachment that are rendered.
    pub layer_count: u32,
    /// The layers that are views, one bit each. Every draw is then rendered to all of these layers, and the pass does
    /// not change other layers. If no bit is set, the vertices of a draw name the layer.
    pub view_mask: u32,
    /// Colour attachments by location; unused ones are `None`.
    pub color: Vec<Option<Attachment>>,
    /// The depth attachment.
    pub depth: Option<Attachment>,
    /// The stencil attachment.
    pub stencil: Option<Attachment>,
}

/// Clears within a pass: see [`Packet::ClearAttachments`](crate::Packet::ClearAttachments).
#[derive(Clone, Debug)]
pub struct ClearAttachments {
    /// The attachments to clear, with their values.
    pub clears: Vec<AttachmentClear>,
    /// The rectangles to clear in framebuffer pixels, each with its first layer and number of layers.
    pub rects: Vec<(Rect, u32, u32)>,
}

/// The clear of one attachment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AttachmentClear {
    /// A colour attachment.
    Color {
        /// The attachment's index.
        index: usize,
        /// Its new value.
        value: ClearValue,
    },
    /// The depth attachment, with its new depth.
    Depth(f32),
    /// The stencil attachment, with its new value.
    Stencil(u32),
}
