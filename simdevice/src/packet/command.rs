//! Packets, and their representation as text.

use super::display::{
    By, buffer, clear_attachments, draw, gaussian_append, gaussian_append_draw, gaussian_begin, image, layers,
    rendering,
};
use super::transfer::{BlitImage, ClearImage, CopyBuffer, CopyBufferImage, CopyImage, ResolveImage};
use super::{ClearAttachments, Dispatch, Draw, GaussianAppend, GaussianBegin, GaussianFragmentStage, Rendering};
use crate::stats::query::QueryPool;
use crate::transform_feedback::{CounterBuffers, TransformFeedback};
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
    /// Resolves texels of several samples to texels of one sample.
    ResolveImage(ResolveImage),
    /// Fills a buffer range with a repeated 32-bit word.
    FillBuffer {
        /// The range; offset and size are multiples of four.
        target: BufferRange,
        /// The word, in the host's byte order.
        word: u32,
    },
    /// Writes bytes that the packet holds to a buffer range.
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
    /// Begins a set of Gaussians that are sorted together.
    GaussianBegin(Box<GaussianBegin>),
    /// Adds Gaussians to the set.
    GaussianAppend(Box<GaussianAppend>),
    /// Adds the Gaussians that a vertex program projects, one for each vertex: see
    /// [`gaussian`](crate::program::interface::gaussian). Of the draw's state only the first viewport is used, whose
    /// height may be negative. Gaussians whose keys are equal to those of Gaussians that were added with attributes
    /// come after them.
    GaussianAppendDraw(Box<Draw>),
    /// Sets the fragment program that computes the colours of the set's fragments.
    GaussianFragmentStage(Box<GaussianFragmentStage>),
    /// Ends the set. It is sorted and binned, and becomes one draw of the current pass.
    GaussianEnd,
    /// Runs workgroups of a compute program.
    Dispatch(Box<Dispatch>),
    /// Draws points, lines or triangles in the current pass.
    Draw(Box<Draw>),
    /// Makes all earlier work visible to all later work. Inside a pass, it flushes the bins.
    Barrier,
    /// Ends the render pass: renders its bins and stores its attachments.
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
    /// Makes transform feedback active, for the draws that name it.
    BeginTransformFeedback {
        /// The transform feedback.
        feedback: Arc<TransformFeedback>,
        /// The words from which the numbers of bytes that are written already are read, by buffer. Without one, a buffer
        /// is written from its beginning.
        counters: CounterBuffers,
    },
    /// Ends transform feedback.
    EndTransformFeedback {
        /// The transform feedback.
        feedback: Arc<TransformFeedback>,
        /// The words to which the numbers of bytes that have been written are stored, by buffer.
        counters: CounterBuffers,
    },
    /// Makes `count` queries from `first` on unavailable.
    ResetQueries {
        /// The pool.
        pool: Arc<QueryPool>,
        /// The first query.
        first: u32,
        /// The number of queries.
        count: u32,
    },
    /// Writes the time in nanoseconds once all earlier work has finished: the host's monotonic time, or the simulated
    /// hardware's if the device is configured so.
    WriteTimestamp {
        /// The pool.
        pool: Arc<QueryPool>,
        /// The query's index in it.
        index: u32,
    },
}

/// One line of text without its end. Images are named by format and size, and buffers by their ranges.
impl Display for Packet {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let boxed = |[x, y, z]: [i32; 3], [width, height, depth]: [u32; 3]| {
            By(move |f: &mut Formatter<'_>| write!(f, "{width}x{height}x{depth}{x:+}{y:+}{z:+}"))
        };
        match self {
            Self::CopyBuffer(copy) => {
                write!(f, "copy {} to {}: {} regions", buffer(&copy.source), buffer(&copy.target), copy.regions.len())
            }
            Self::CopyBufferToImage(copy) | Self::CopyImageToBuffer(copy) => {
                let (buffer, image) = (buffer(&copy.buffer), image(&copy.image));
                match self {
                    Self::CopyBufferToImage(_) => write!(f, "copy {buffer} to {image}")?,
                    _ => write!(f, "copy {image} to {buffer}")?,
                }
                for region in &copy.regions {
                    let place = boxed(region.image_offset, region.image_extent);
                    write!(f, ", {place} {} at {}", layers(region.subresource), region.buffer_offset)?;
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
            Self::BeginTransformFeedback { .. } => f.write_str("begin transform feedback"),
            Self::EndTransformFeedback { .. } => f.write_str("end transform feedback"),
            Self::BeginQuery { index, .. } => write!(f, "begin query {index}"),
            Self::EndQuery { index, .. } => write!(f, "end query {index}"),
            Self::ResetQueries { first, count, .. } => {
                write!(f, "reset queries {first}..{}", u64::from(*first) + u64::from(*count))
            }
            Self::WriteTimestamp { index, .. } => write!(f, "write timestamp {index}"),
        }
    }
}
