//! The contents of command buffers: plain data that is recorded, and that a queue replays as packets.
//!
//! Everything that the application passed by pointer is copied, and every object that a command names is held by an
//! [`Arc`]. [`buffer`] has command buffers and their [`Recorder`](buffer::Recorder), the other modules the commands,
//! chapter by chapter. [`replay`] walks a recording through one exhaustive match, with the bound state that draws need;
//! [`submit`] runs the replay on queues.

pub(crate) mod bind;
pub(crate) mod buffer;
pub(crate) mod camera;
pub(crate) mod conditional;
pub(crate) mod draw;
pub(crate) mod dynamic_state;
pub(crate) mod gaussian_decoding;
pub(crate) mod gaussian_harmonics;
pub(crate) mod gaussian_set;
pub(crate) mod gaussian_state;
pub(crate) mod host_image_copy;
pub(crate) mod query;
pub(crate) mod render_pass;
mod render_scope;
mod replay;
pub(crate) mod submit;
pub(crate) mod sync;
pub(crate) mod transfer;
pub(crate) mod transform_feedback;

use crate::abi::error::Error;
use crate::descriptor::layout::DescriptorSetLayout;
use crate::descriptor::set::{Descriptor, DescriptorSet, Write};
use crate::pipeline::GraphicsPipeline;
use crate::pipeline::compute::ComputePipeline;
use crate::pipeline::dynamic_state::DynamicState;
use crate::pipeline::parts::VertexInput;
use crate::query_pool::QueryPool;
use crate::sync::Event;
use ash::vk;
use simdevice::BufferRange;
use simdevice::packet::AttributeStream;
use simdevice::state::gaussian::Camera;
use simdevice::state::{Rect, Viewport};
use simdevice::transform_feedback::CounterBuffers;
use simdevice::{Format, Packet};
use std::sync::Arc;

/// A bound buffer of spherical harmonics.
#[derive(Clone, Debug)]
pub(crate) struct HarmonicsBuffer {
    /// The bytes that may be read.
    pub(crate) range: BufferRange,
    /// The format of a coefficient.
    pub(crate) format: Format,
    /// Bytes from a Gaussian to the next.
    pub(crate) stride: u32,
    /// Bytes from a coefficient to the next.
    pub(crate) coefficient_stride: u64,
}

impl HarmonicsBuffer {
    /// The stream of a coefficient.
    pub(crate) fn coefficient(&self, number: u64) -> AttributeStream {
        let range = &self.range;
        let start = number.saturating_mul(self.coefficient_stride);
        // Streams that begin at the same place are read together.
        let (moved, offset) = match u32::try_from(start) {
            Ok(offset) => (0, offset),
            Err(_) => (start.min(range.size), 0),
        };
        AttributeStream {
            buffer: BufferRange {
                memory: Arc::clone(&range.memory),
                offset: range.offset + moved,
                size: range.size - moved,
            },
            stride: self.stride,
            offset,
            format: self.format,
            instance_divisor: None,
        }
    }
}

/// A bound table of bounds or values, by which an attribute is decoded.
#[derive(Clone, Debug)]
pub(crate) struct DecodingTable {
    /// The bytes that may be read, if there are any.
    pub(crate) range: Option<BufferRange>,
    /// True if numbers are binary64, false if they are binary32.
    pub(crate) is_binary64: bool,
    /// Bytes from a chunk to the next.
    pub(crate) stride: u32,
    /// The Gaussians of a chunk.
    pub(crate) chunk_size: u32,
}

/// The bound codes of spherical harmonics.
#[derive(Clone, Debug)]
pub(crate) struct HarmonicsCodes {
    /// The bytes that may be read, if there are any.
    pub(crate) range: Option<BufferRange>,
    /// Bytes from a Gaussian, or an entry of a palette, to the next.
    pub(crate) stride: u32,
    /// Bytes from a coefficient to the next.
    pub(crate) coefficient_stride: u32,
    /// Bytes from a component to the next.
    pub(crate) component_stride: u32,
}

/// The bound labels of a palette.
#[derive(Clone, Debug)]
pub(crate) struct HarmonicsLabels {
    /// The bytes that may be read, if there are any.
    pub(crate) range: Option<BufferRange>,
    /// Bytes from a Gaussian to the next.
    pub(crate) stride: u32,
}

/// The bound tables by which attributes are decoded.
#[derive(Clone, Debug)]
pub(crate) struct DecodingTables {
    /// That of positions.
    pub(crate) position: DecodingTable,
    /// That of scales.
    pub(crate) scale: DecodingTable,
    /// That of opacities.
    pub(crate) opacity: DecodingTable,
    /// That of coefficient 0 of the spherical harmonics.
    pub(crate) color: DecodingTable,
    /// That of the other coefficients.
    pub(crate) harmonics: DecodingTable,
    /// The codes of the other coefficients.
    pub(crate) codes: HarmonicsCodes,
    /// The labels of a palette.
    pub(crate) labels: HarmonicsLabels,
}

/// A recorded command.
#[derive(Clone, Debug)]
pub(crate) enum Command {
    /// A command that depends on no bound state, already a packet: copies, clears, barriers, begin and end of passes,
    /// queries.
    Packet(Packet),
    /// `vkCmdBindPipeline` at the graphics bind point.
    BindPipeline(Arc<GraphicsPipeline>),
    /// `vkCmdBindVertexBuffers` and `vkCmdBindVertexBuffers2`, for each binding.
    BindVertexBuffer {
        /// The binding.
        binding: u32,
        /// The buffer.
        buffer: VertexBuffer,
    },
    /// `vkCmdBindIndexBuffer`.
    BindIndexBuffer(IndexBuffer),
    /// `vkCmdSetPrimitiveRestartIndexEXT`.
    SetPrimitiveRestartIndex(u32),
    /// `vkCmdSetViewport` and `vkCmdSetViewportWithCount`, for each viewport.
    SetViewport {
        /// The viewport's number.
        index: u32,
        /// The viewport.
        viewport: Viewport,
    },
    /// The count of `vkCmdSetViewportWithCount`.
    SetViewportCount(u32),
    /// `vkCmdSetScissor` and `vkCmdSetScissorWithCount`, for each scissor.
    SetScissor {
        /// The number of the scissor's viewport.
        index: u32,
        /// The scissor.
        scissor: Rect,
    },
    /// The count of `vkCmdSetScissorWithCount`.
    SetScissorCount(u32),
    /// Any other `vkCmdSet...` of fixed-function state.
    SetDynamicState(DynamicState),
    /// `vkCmdSetGaussianCamerasGAURAST`.
    SetCameras(Box<[Camera]>),
    /// `vkCmdBindGaussianSphericalHarmonicsGAURAST`.
    BindHarmonics(Box<HarmonicsBuffer>),
    /// `vkCmdBindGaussianDecodingTablesGAURAST`.
    BindDecodingTables(Box<DecodingTables>),
    /// `vkCmdBeginGaussianSetGAURAST`.
    BeginGaussianSet,
    /// `vkCmdEndGaussianSetGAURAST`.
    EndGaussianSet,
    /// `vkCmdDraw` and `vkCmdDrawIndexed`.
    Draw(DrawParameters),
    /// `vkCmdDrawMultiEXT` and `vkCmdDrawMultiIndexedEXT`.
    DrawMulti(Vec<DrawParameters>),
    /// `vkCmdSetVertexInputEXT`.
    SetVertexInput(Arc<VertexInput>),
    /// `vkCmdDrawIndirect`, `vkCmdDrawIndexedIndirect` and their forms with a count: the draws are read when they
    /// execute.
    DrawIndirect(DrawIndirect),
    /// `vkCmdBindPipeline` at the compute bind point.
    BindComputePipeline(Arc<ComputePipeline>),
    /// `vkCmdBindDescriptorSets`.
    BindSets(Box<BindSets>),
    /// `vkCmdPushDescriptorSetKHR` and its form with a template.
    PushDescriptors(Box<PushDescriptors>),
    /// `vkCmdPushConstants`. All stages share one memory.
    PushConstants {
        /// The first byte.
        offset: u32,
        /// The bytes.
        bytes: Box<[u8]>,
    },
    /// `vkCmdDispatch` and `vkCmdDispatchBase`.
    Dispatch {
        /// The first workgroup in x, y and z.
        base: [u32; 3],
        /// The number of workgroups in x, y and z.
        count: [u32; 3],
    },
    /// `vkCmdDispatchIndirect`: the number of workgroups is read when it executes.
    DispatchIndirect(BufferRange),
    /// `vkCmdBeginConditionalRenderingEXT`: the word is read when it executes.
    BeginConditional {
        /// The four bytes of the word.
        predicate: BufferRange,
        /// True if what follows is executed where the word is zero, not where it isn't.
        is_inverted: bool,
    },
    /// `vkCmdEndConditionalRenderingEXT`.
    EndConditional,
    /// `vkCmdBindTransformFeedbackBuffersEXT`, for each binding.
    BindTransformFeedbackBuffer {
        /// The binding.
        binding: u32,
        /// The bytes that may be written.
        buffer: BufferRange,
    },
    /// `vkCmdBeginTransformFeedbackEXT`: the counters are read when it executes.
    BeginTransformFeedback(Box<CounterBuffers>),
    /// `vkCmdEndTransformFeedbackEXT`.
    EndTransformFeedback(Box<CounterBuffers>),
    /// `vkCmdDrawIndirectByteCountEXT`: the number of vertices is computed when it executes.
    DrawByteCount(DrawByteCount),
    /// `vkCmdBeginQuery` and `vkCmdBeginQueryIndexedEXT` of a query that counts primitives of a vertex stream.
    BeginStreamQuery {
        /// The pool.
        pool: Arc<QueryPool>,
        /// The query.
        query: u32,
        /// The stream.
        stream: u32,
    },
    /// `vkCmdSetEvent` (true) and `vkCmdResetEvent` (false).
    SetEvent(Arc<Event>, bool),
    /// `vkCmdWaitEvents`.
    WaitEvents(Vec<Arc<Event>>),
    /// `vkCmdCopyQueryPoolResults`: the results are read when it executes.
    CopyQueryResults(CopyQueryResults),
    /// `vkCmdExecuteCommands`: the contents of the secondary command buffers when this was recorded.
    Execute(Vec<Arc<Vec<Command>>>),
}

/// Descriptor sets to be bound.
#[derive(Clone, Debug)]
pub(crate) struct BindSets {
    /// The bind point.
    pub(crate) bind_point: BindPoint,
    /// The first set's number.
    pub(crate) first: u32,
    /// The sets; `None` for one that pipeline layouts with independent sets lack.
    pub(crate) sets: Vec<Option<BoundSet>>,
}

/// Descriptors to be pushed.
#[derive(Clone, Debug)]
pub(crate) struct PushDescriptors {
    /// The bind point.
    pub(crate) bind_point: BindPoint,
    /// The set's number.
    pub(crate) set: u32,
    /// The set's layout.
    pub(crate) layout: Arc<DescriptorSetLayout>,
    /// The changes.
    pub(crate) writes: Vec<Write>,
}

/// A vertex buffer binding.
#[derive(Clone, Debug)]
pub(crate) struct VertexBuffer {
    /// The bytes that vertices are read from.
    pub(crate) range: BufferRange,
    /// The stride, if `vkCmdBindVertexBuffers2` gave one.
    pub(crate) stride: Option<u32>,
}

/// An index buffer binding.
#[derive(Clone, Debug)]
pub(crate) struct IndexBuffer {
    /// The bytes that indices are read from.
    pub(crate) range: BufferRange,
    /// Bytes per index: 1, 2 or 4.
    pub(crate) index_size: u32,
    /// The index that restarts a primitive, if it isn't the greatest.
    pub(crate) restart: Option<u32>,
}

/// A draw's parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct DrawParameters {
    /// The value added to each index, or `None` for a draw without an index buffer.
    pub(crate) vertex_offset: Option<i32>,
    /// The first vertex or index.
    pub(crate) first: u32,
    /// The number of vertices or indices.
    pub(crate) count: u32,
    /// The first instance.
    pub(crate) first_instance: u32,
    /// The number of instances.
    pub(crate) instance_count: u32,
}

/// Draws whose parameters are in a buffer.
#[derive(Clone, Debug)]
pub(crate) struct DrawIndirect {
    /// The bytes from the first draw's parameters to the end of the buffer.
    pub(crate) parameters: BufferRange,
    /// The greatest number of draws.
    pub(crate) draw_count: u32,
    /// The four bytes from which the number of draws is read, if it is in a buffer.
    pub(crate) count: Option<BufferRange>,
    /// Bytes from one draw's parameters to the next.
    pub(crate) stride: u32,
    /// True for parameters of indexed draws.
    pub(crate) indexed: bool,
}

/// A draw of the vertices that transform feedback has written.
#[derive(Clone, Debug)]
pub(crate) struct DrawByteCount {
    /// The word with the number of bytes.
    pub(crate) counter: BufferRange,
    /// The bytes before the first vertex that is drawn.
    pub(crate) counter_offset: u32,
    /// The bytes of a vertex.
    pub(crate) vertex_stride: u32,
    /// The first instance.
    pub(crate) first_instance: u32,
    /// The number of instances.
    pub(crate) instance_count: u32,
}

/// A copy of query results to a buffer.
#[derive(Clone, Debug)]
pub(crate) struct CopyQueryResults {
    /// The pool.
    pub(crate) pool: Arc<QueryPool>,
    /// The first query.
    pub(crate) first: u32,
    /// The number of queries.
    pub(crate) count: u32,
    /// The bytes from the first one written to the end of the buffer.
    pub(crate) target: BufferRange,
    /// Bytes from one query's results to the next.
    pub(crate) stride: u64,
    /// The flags: the values written for each query, and whether the copy waits for them.
    pub(crate) flags: vk::QueryResultFlags,
}

/// A bind point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BindPoint {
    /// Used by draws.
    Graphics,
    /// Used by dispatches.
    Compute,
}

impl BindPoint {
    /// Vulkan's bind point.
    ///
    /// # Errors
    /// [`Error::FeatureNotPresent`] for those of extensions.
    pub(crate) fn from_vk(bind_point: vk::PipelineBindPoint) -> Result<Self, Error> {
        match bind_point {
            vk::PipelineBindPoint::GRAPHICS => Ok(Self::Graphics),
            vk::PipelineBindPoint::COMPUTE => Ok(Self::Compute),
            other => Err(Error::FeatureNotPresent(format!("bind point {other:?}"))),
        }
    }
}

/// A bound descriptor set.
#[derive(Clone, Debug)]
pub(crate) struct BoundSet {
    /// The set; read when a command uses it.
    pub(crate) set: Arc<DescriptorSet>,
    /// The dynamic offsets, as many as the set's layout has.
    pub(crate) dynamic_offsets: Vec<u32>,
}

impl BoundSet {
    /// The bytes of the uniform or storage buffer that the first descriptor of a binding holds.
    pub(crate) fn buffer(&self, binding: u32) -> Option<BufferRange> {
        let binding = self.set.layout().binding(binding)?;
        let held = self.set.lock();
        let Descriptor::Buffer(descriptor) = held.get(binding.first)? else {
            return None;
        };
        let offset = binding.first_dynamic.and_then(|index| self.dynamic_offsets.get(index));
        Some(descriptor.range(offset.copied().unwrap_or(0)))
    }
}
