//! What a command buffer holds. Everything that the application passed by pointer has been copied, and every
//! object that a command names is held by [`Arc`].

use super::bound::{BindPoint, BoundSet};
use crate::object::descriptor::layout::DescriptorSetLayout;
use crate::object::descriptor::set::Write;
use crate::object::event::Event;
use crate::object::pipeline::GraphicsPipeline;
use crate::object::pipeline::compute::ComputePipeline;
use crate::object::pipeline::setting::Setting;
use crate::object::query_pool::QueryPool;
use simdevice::Packet;
use simdevice::packet::BufferRange;
use simdevice::state::gaussian::Camera;
use simdevice::state::{Rect, Viewport};
use std::sync::Arc;

/// A recorded command.
#[derive(Clone, Debug)]
pub(crate) enum Command {
    /// A command whose meaning depends on no bound state, already lowered: copies, clears, barriers, the
    /// beginning and end of passes, queries.
    Packet(Packet),
    /// `vkCmdBindPipeline` at the graphics bind point.
    BindPipeline(Arc<GraphicsPipeline>),
    /// `vkCmdBindVertexBuffers` and `vkCmdBindVertexBuffers2`.
    BindVertexBuffers {
        /// The first binding.
        first: u32,
        /// One for each binding.
        buffers: Vec<VertexBuffer>,
    },
    /// `vkCmdBindIndexBuffer`.
    BindIndexBuffer(IndexBuffer),
    /// `vkCmdSetViewport` and `vkCmdSetViewportWithCount`.
    SetViewports {
        /// The first viewport.
        first: u32,
        /// One for each viewport.
        viewports: Vec<Viewport>,
        /// Whether there are no more than these.
        with_count: bool,
    },
    /// `vkCmdSetScissor` and `vkCmdSetScissorWithCount`.
    SetScissors {
        /// The first scissor.
        first: u32,
        /// One for each viewport.
        scissors: Vec<Rect>,
        /// Whether there are no more than these.
        with_count: bool,
    },
    /// Any other `vkCmdSet...` of fixed-function state.
    Set(Setting),
    /// `vkCmdSetGaussianCameraGAURAST`.
    SetCamera(Box<Camera>),
    /// `vkCmdDraw` and `vkCmdDrawIndexed`.
    Draw(Draw),
    /// `vkCmdDrawIndirect`, `vkCmdDrawIndexedIndirect` and their forms with a count: the draws are read when they
    /// execute.
    DrawIndirect(DrawIndirect),
    /// `vkCmdBindPipeline` at the compute bind point.
    BindComputePipeline(Arc<ComputePipeline>),
    /// `vkCmdBindDescriptorSets`.
    BindSets(Box<BindSets>),
    /// `vkCmdPushDescriptorSetKHR` and its form with a template.
    PushDescriptors(Box<PushDescriptors>),
    /// `vkCmdPushConstants`. Whatever stages they are for, they have one memory.
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
        /// How many workgroups in x, y and z.
        count: [u32; 3],
    },
    /// `vkCmdDispatchIndirect`: the workgroups are counted when it executes.
    DispatchIndirect(BufferRange),
    /// `vkCmdSetEvent` (true) and `vkCmdResetEvent` (false).
    SetEvent(Arc<Event>, bool),
    /// `vkCmdWaitEvents`.
    WaitEvents(Vec<Arc<Event>>),
    /// `vkCmdCopyQueryPoolResults`: the results are read when it executes.
    CopyQueryResults(CopyQueryResults),
    /// `vkCmdExecuteCommands`: what the secondary command buffers held when this was recorded.
    Execute(Vec<Arc<Vec<Command>>>),
}

/// Descriptor sets to be bound.
#[derive(Clone, Debug)]
pub(crate) struct BindSets {
    /// Where.
    pub(crate) bind_point: BindPoint,
    /// The first set's number.
    pub(crate) first: u32,
    /// The sets.
    pub(crate) sets: Vec<BoundSet>,
}

/// Descriptors that are pushed.
#[derive(Clone, Debug)]
pub(crate) struct PushDescriptors {
    /// Where.
    pub(crate) bind_point: BindPoint,
    /// The set's number.
    pub(crate) set: u32,
    /// The set's layout.
    pub(crate) layout: Arc<DescriptorSetLayout>,
    /// What changes.
    pub(crate) writes: Vec<Write>,
}

/// A vertex buffer binding.
#[derive(Clone, Debug)]
pub(crate) struct VertexBuffer {
    /// The bytes that vertices are read from.
    pub(crate) range: BufferRange,
    /// The stride, where `vkCmdBindVertexBuffers2` gave one.
    pub(crate) stride: Option<u32>,
}

/// An index buffer binding.
#[derive(Clone, Debug)]
pub(crate) struct IndexBuffer {
    /// The bytes that indices are read from.
    pub(crate) range: BufferRange,
    /// Bytes per index: 1, 2 or 4.
    pub(crate) index_size: u32,
}

/// A draw's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Draw {
    /// The value added to each index, or `None` for a draw without an index buffer.
    pub(crate) vertex_offset: Option<i32>,
    /// The first vertex or index.
    pub(crate) first: u32,
    /// How many vertices or indices.
    pub(crate) count: u32,
    /// The first instance.
    pub(crate) first_instance: u32,
    /// How many instances.
    pub(crate) instance_count: u32,
}

/// Draws whose numbers lie in a buffer.
#[derive(Clone, Debug)]
pub(crate) struct DrawIndirect {
    /// The bytes from the first draw's numbers to the end of the buffer.
    pub(crate) parameters: BufferRange,
    /// How many draws, at most.
    pub(crate) draw_count: u32,
    /// Where the number of draws is read from, if it lies in a buffer: four bytes.
    pub(crate) count: Option<BufferRange>,
    /// Bytes from one draw's numbers to the next.
    pub(crate) stride: u32,
    /// Whether they are those of indexed draws.
    pub(crate) indexed: bool,
}

/// A copy of query results to a buffer.
#[derive(Clone, Debug)]
pub(crate) struct CopyQueryResults {
    /// The pool.
    pub(crate) pool: Arc<QueryPool>,
    /// The first query.
    pub(crate) first: u32,
    /// How many queries.
    pub(crate) count: u32,
    /// The bytes from the first one written to the end of the buffer.
    pub(crate) target: BufferRange,
    /// Bytes from one query's results to the next.
    pub(crate) stride: u64,
    /// What is written for each query, and whether the copy waits for it.
    pub(crate) flags: ash::vk::QueryResultFlags,
}
