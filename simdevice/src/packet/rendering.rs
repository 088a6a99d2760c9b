//! Render passes: their attachments, and what is cleared within them.

use crate::format::ClearValue;
use crate::image::ImageView;
use crate::state::{Rect, ResolveMode};

/// What a pass does with an attachment's contents when it begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoadOp {
    /// Reads them.
    Load,
    /// Replaces them.
    Clear(ClearValue),
    /// Leaves them undefined (the device leaves what was there).
    DontCare,
}

/// What a pass does with an attachment's contents when it ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreOp {
    /// Writes them to memory.
    Store,
    /// Drops them (they may be written all the same).
    DontCare,
    /// The attachment was not written.
    None,
}

/// An attachment of a pass.
#[derive(Clone, Debug)]
pub struct Attachment {
    /// What is rendered to.
    pub view: ImageView,
    /// What happens at the beginning.
    pub load: LoadOp,
    /// What happens at the end.
    pub store: StoreOp,
    /// Where the pass leaves one sample for each texel of its area when it ends, if anywhere: a view of an image of
    /// one sample, as large as `view`. What `store` says doesn't matter to it.
    pub resolve: Option<(ImageView, ResolveMode)>,
}

/// See [`Packet::BeginRendering`].
#[derive(Clone, Debug)]
pub struct Rendering {
    /// The pixels that the pass may touch.
    pub area: Rect,
    /// How many layers of each attachment are rendered.
    pub layer_count: u32,
    /// The layers that are views, a bit each: every draw is for all of them and for no other layer, which the pass leaves
    /// alone. Without any, draws say their layers.
    pub view_mask: u32,
    /// Colour attachments by location; unused ones are `None`.
    pub color: Vec<Option<Attachment>>,
    /// The depth attachment.
    pub depth: Option<Attachment>,
    /// The stencil attachment.
    pub stencil: Option<Attachment>,
}

/// See [`Packet::ClearAttachments`].
#[derive(Clone, Debug)]
pub struct ClearAttachments {
    /// What is cleared to which value.
    pub clears: Vec<AttachmentClear>,
    /// Where, in framebuffer pixels and layers (first, count).
    pub rects: Vec<(Rect, u32, u32)>,
}

/// One attachment's clear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AttachmentClear {
    /// Colour attachment number `index`.
    Color {
        /// The attachment's index.
        index: usize,
        /// Its new value.
        value: ClearValue,
    },
    /// The depth attachment.
    Depth(f32),
    /// The stencil attachment.
    Stencil(u32),
}
