//! Packets: the commands that a driver gives to the device. A packet is plain data, and holds everything that it needs
//! by [`Arc`](std::sync::Arc).

mod command;
mod display;
mod draw;
mod gaussian;
mod rendering;
mod streams;
mod transfer;

pub use command::Packet;
pub use devmem::BufferRange;
pub use draw::{Dispatch, Draw};
pub use gaussian::{
    Activations, GaussianAppend, GaussianAttributes, GaussianBegin, GaussianFragmentStage,
    ModelAttributes,
};
pub use rendering::{Attachment, AttachmentClear, ClearAttachments, LoadOp, Rendering, StoreOp};
pub use streams::{AttributeStream, IndexStream};
pub use transfer::{
    BlitImage, BufferCopyRegion, BufferImageRegion, ClearImage, CopyBuffer, CopyBufferImage,
    CopyImage, ImageBlitRegion, ImageCopyRegion, ResolveImage, SubresourceLayers, SubresourceRange,
};
