//! Packets: the commands that a driver gives to the device. A packet is plain data, and holds everything that it needs
//! by [`Arc`](std::sync::Arc).

mod command;
mod decoding;
mod display;
mod draw;
mod rendering;
mod transfer;

pub use command::Packet;
pub use decoding::{Decoding, Decodings, HarmonicsCodes, HarmonicsDecoding, RotationDecoding};
pub use draw::{
    Activations, AttributeStream, DecodingTables, Dispatch, Draw, GaussianAppend, GaussianAttributes, GaussianBegin,
    GaussianFragmentStage, IndexStream, ModelAttributes, PrimitiveBindings,
};
pub use rendering::{
    Attachment, AttachmentClear, AttachmentResolve, ClearAttachments, LoadOp, Multisampled, Rendering, StoreOp,
};
pub use transfer::{
    BlitImage, BufferCopyRegion, BufferImageRegion, ClearImage, CopyBuffer, CopyBufferImage, CopyImage,
    ImageBlitRegion, ImageCopyRegion, ResolveImage, SubresourceLayers, SubresourceRange,
};
