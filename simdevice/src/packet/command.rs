//! The packet, and its text.

use super::display::{
    By, buffer, clear_attachments, draw, gaussian_append, gaussian_append_draw, gaussian_begin,
    image, layers, rendering,
};
use super::transfer::{
    BlitImage, ClearImage, CopyBuffer, CopyBufferImage, CopyImage, ResolveImage,
};
use super::{
    ClearAttachments, Dispatch, Draw, GaussianAppend, GaussianBegin, GaussianFragmentStage,
    Rendering,
};
use crate::stats::query::QueryPool;
use devmem::BufferRange;
use std::fmt;
use std::fmt::{Display, Formatter};
use std::sync::Arc;

/// One command for the [`CommandProcessor`](crate::CommandProcessor).
#[derive(Clone, Debug)]
pub enum Packet {
    /// Copies regions between two buffers.
    CopyBuffer(CopyBuffer),
    /// Copies regions of a buffer into an image.
    CopyBufferToImage(CopyBufferImage),
    /// Copies regions of an image into a buffer.
    CopyImageToBuffer(CopyBufferImage),
    /// Copies texels between images whose formats have equal texel sizes.
    CopyImage(CopyImage),
    /// Copies texels between images, scaling and converting them.
    BlitImage(BlitImage),
    /// Copies colour texels of several samples to texels of one.
    ResolveImage(ResolveImage),
    /// Fills a buffer range with a repeated 32-bit word.
    FillBuffer {
        /// The range; offset and size are multiples of four.
        target: BufferRange,
        /// The word, in the host's byte order.
        word: u32,
    },
    /// Writes bytes that travelled in the packet to a buffer range.
    UpdateBuffer {
        /// The range; as long as `data`.
        target: BufferRange,
        /// The bytes.
        data: Arc<[u8]>,
    },
    /// Clears subresources of an image outside a render pass.
    ClearImage(ClearImage),
    /// Starts a render pass: attachments are loaded or cleared tile by tile when the pass is flushed.
    BeginRendering(Box<Rendering>),
    /// Clears rectangles of the current pass's attachments, in submission order with its draws.
    ClearAttachments(ClearAttachments),
    /// Starts a sorted set of Gaussians.
    GaussianBegin(Box<GaussianBegin>),
    /// Adds Gaussians to the set.
    GaussianAppend(Box<GaussianAppend>),
    /// Adds the Gaussians that a vertex program projects, one for each vertex: see [`draw::gaussian`]. Of the draw's
    /// state only the first viewport counts, which may be upside down. Where keys are equal, they come after those that
    /// were added with attributes.
    GaussianAppendDraw(Box<Draw>),
    /// Has a fragment program make the colours of the set's fragments.
    GaussianFragmentStage(Box<GaussianFragmentStage>),
    /// Ends the set: it is sorted, binned and becomes one draw of the current pass.
    GaussianEnd,
    /// Runs workgroups of a compute program.
    Dispatch(Box<Dispatch>),
    /// Draws points, lines or triangles in the current pass.
    Draw(Box<Draw>),
    /// Makes everything before visible to everything after; flushes a pass's bins if it is inside one.
    Barrier,
    /// Ends the render pass: its bins are rendered and its attachments stored.
    EndRendering,
    /// Starts query `index` of `pool`.
    BeginQuery {
        /// The pool.
        pool: Arc<QueryPool>,
        /// The query's index in it.
        index: u32,
    },
    /// Ends query `index` of `pool` and makes its result available.
    EndQuery {
        /// The pool.
        pool: Arc<QueryPool>,
        /// The query's index in it.
        index: u32,
    },
    /// Makes `count` queries from `first` on unavailable.
    ResetQueries {
        /// The pool.
        pool: Arc<QueryPool>,
        /// The first query.
        first: u32,
        /// How many.
        count: u32,
    },
    /// Writes the host's monotonic time in nanoseconds once everything before has finished.
    WriteTimestamp {
        /// The pool.
        pool: Arc<QueryPool>,
        /// The query's index in it.
        index: u32,
    },
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
            Self::GaussianFragmentStage(_) => f.write_str("shade the fragments of gaussians"),
            Self::GaussianEnd => f.write_str("end gaussians"),
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
