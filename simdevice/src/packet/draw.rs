//! Draws of points, lines and triangles, and dispatches.

use super::streams::{AttributeStream, IndexStream};
use crate::program::bindings::Bindings;
use crate::program::compute::ComputeProgram;
use crate::program::vertex::DrawPipeline;
use crate::state::DrawState;
use std::sync::Arc;

/// A draw: see [`Packet::Draw`](crate::Packet::Draw) and
/// [`Packet::GaussianAppendDraw`](crate::Packet::GaussianAppendDraw).
#[derive(Clone, Debug)]
pub struct Draw {
    /// The programs.
    pub pipeline: Arc<DrawPipeline>,
    /// The state in effect.
    pub state: Arc<DrawState>,
    /// The streams of vertex attributes, numbered as
    /// [`VertexInput::Attribute`](crate::program::interface::VertexInput::Attribute) does.
    pub attributes: Vec<AttributeStream>,
    /// The bindings of the vertex program.
    pub vertex_bindings: Bindings,
    /// The bindings of the fragment program.
    pub fragment_bindings: Bindings,
    /// The index buffer; without one vertices are consecutive.
    pub indices: Option<IndexStream>,
    /// The first vertex, or the first index.
    pub first: u32,
    /// The number of vertices or indices.
    pub count: u32,
    /// The first instance.
    pub first_instance: u32,
    /// The number of instances.
    pub instance_count: u32,
    /// The draw's number within an indirect command.
    pub draw_index: u32,
}

/// A dispatch: see [`Packet::Dispatch`](crate::Packet::Dispatch).
#[derive(Clone, Debug)]
pub struct Dispatch {
    /// The program that each workgroup runs.
    pub program: Arc<ComputeProgram>,
    /// The first workgroup's number in x, y and z.
    pub base: [u32; 3],
    /// The number of workgroups in x, y and z.
    pub count: [u32; 3],
    /// The bindings of the program.
    pub bindings: Bindings,
}
