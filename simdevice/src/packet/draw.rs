//! Draws of points, lines and triangles, and dispatches.

use super::streams::{AttributeStream, IndexStream};
use crate::program::bindings::Bindings;
use crate::program::compute::ComputeProgram;
use crate::program::vertex::DrawPipeline;
use crate::state::DrawState;
use std::sync::Arc;

/// See [`Packet::Draw`](crate::Packet::Draw) and [`Packet::GaussianAppendDraw`](crate::Packet::GaussianAppendDraw).
#[derive(Clone, Debug)]
pub struct Draw {
    /// The programs.
    pub pipeline: Arc<DrawPipeline>,
    /// The state in effect.
    pub state: Arc<DrawState>,
    /// What [`VertexInput::Attribute`] counts in.
    pub attributes: Vec<AttributeStream>,
    /// What the vertex program is bound to.
    pub vertex_bindings: Bindings,
    /// What the fragment program is bound to.
    pub fragment_bindings: Bindings,
    /// The index buffer; without one vertices are consecutive.
    pub indices: Option<IndexStream>,
    /// The first vertex, or the first index.
    pub first: u32,
    /// How many vertices or indices.
    pub count: u32,
    /// The first instance.
    pub first_instance: u32,
    /// How many instances.
    pub instance_count: u32,
    /// The draw's number within an indirect command.
    pub draw_index: u32,
}

/// See [`Packet::Dispatch`](crate::Packet::Dispatch).
#[derive(Clone, Debug)]
pub struct Dispatch {
    /// What each workgroup runs.
    pub program: Arc<ComputeProgram>,
    /// The first workgroup's number in x, y and z.
    pub base: [u32; 3],
    /// How many workgroups there are in x, y and z.
    pub count: [u32; 3],
    /// What the program is bound to.
    pub bindings: Bindings,
}
