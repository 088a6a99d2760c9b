//! What the front end hands to the rasterizer.

use super::Bins;
use crate::packet::Draw;
use crate::program::bindings::Bindings;
use crate::program::vertex::DrawPipeline;
use crate::state::{DrawState, Rect};
use crate::stats::recorder::DrawRecord;
use std::sync::Arc;

/// A draw that was shaded, assembled, clipped, set up and binned.
#[derive(Debug)]
pub struct PrimitiveDraw {
    /// The programs.
    pub pipeline: Arc<DrawPipeline>,
    /// The state.
    pub state: Arc<DrawState>,
    /// What the fragment program is bound to.
    pub bindings: Bindings,
    /// The primitives, in order.
    pub chunks: Vec<PrimitiveChunk>,
    /// The pixels that they may touch, by viewport: those of the pass's area that lie in the scissor and in the
    /// viewport. Primitives may reach farther.
    pub regions: Vec<Rect>,
    /// Where the work of its tiles goes, if anybody wants to know.
    pub(crate) record: Option<Arc<DrawRecord>>,
}

/// Consecutive primitives of a draw that were set up together.
#[derive(Debug, Default)]
pub struct PrimitiveChunk {
    /// The primitives, in the order in which macro-tiles look at them where there are many.
    pub primitives: Vec<Primitive>,
    /// The varyings of their vertices.
    pub varyings: Varyings,
    /// Which of them each macro-tile has to look at.
    pub bins: Bins,
}

/// The varyings of vertices, those that clipping made included: 32-bit scalars, vertex by vertex.
#[derive(Debug, Default)]
pub struct Varyings {
    /// All of them.
    pub values: Vec<u32>,
    /// How many each vertex has.
    pub per_vertex: usize,
}

/// What a primitive was before it became a convex polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PrimitiveKind {
    /// A triangle: corners 0 to 2.
    Triangle,
    /// A line: the parallelogram of corners 0 to 2; corners 0 and 1 are at its first vertex, corner 2 at its second.
    Line,
    /// A point: the axis-aligned square of corners 0 (top left), 1 (top right) and 2 (bottom right).
    Point,
}

/// A convex polygon to be rasterized: a triangle, or the parallelogram whose fourth corner is c0 + c2 - c1. Whatever
/// varies over it is affine in the framebuffer (after division by w where it is perspective-correct), and given at
/// corners 0 to 2, or where those were before snapping.
#[derive(Clone, Copy, Debug)]
pub struct Primitive {
    /// Framebuffer positions in 1/256 pixels, x and y down; ordered so that the signed area
    /// (c1 - c0) x (c2 - c0) is positive, whichever way the primitive faces.
    pub corners: [[i32; 2]; 3],
    /// Where the vertices were before snapping, from the corners, in 2^-24 pixels. Whatever varies has its values
    /// there.
    pub offsets: [[i16; 2]; 3],
    /// Depth at the vertices, viewport-mapped, with depth bias, not clamped.
    pub depth: [f32; 3],
    /// 1 / w at the vertices.
    pub inverse_w: [f32; 3],
    /// The vertices at the corners, in [`PrimitiveChunk::varyings`].
    pub vertices: [u32; 3],
    /// The vertex that flat varyings are taken from.
    pub provoking: u32,
    /// Its number within the instance.
    pub id: u32,
    /// What it is.
    pub kind: PrimitiveKind,
    /// Whether it faces the front; points and lines do.
    pub front: bool,
    /// The viewport, which selects the scissor and the range that depth is clamped to.
    pub viewport: u8,
    /// The layer that it is drawn to.
    pub layer: u16,
}

impl PrimitiveDraw {
    /// How many varyings each vertex has.
    pub(crate) fn varyings_per_vertex(&self) -> usize {
        let first = self.chunks.first();
        first.map_or(0, |chunk| chunk.varyings.per_vertex)
    }

    /// A draw without primitives.
    pub(crate) fn empty(draw: &Draw) -> Self {
        Self {
            pipeline: Arc::clone(&draw.pipeline),
            state: Arc::clone(&draw.state),
            bindings: draw.fragment_bindings.clone(),
            chunks: Vec::new(),
            regions: Vec::new(),
            record: None,
        }
    }

    /// Bytes of host memory that it holds while it waits.
    pub(crate) fn memory_bytes(&self) -> u64 {
        self.chunks.iter().map(PrimitiveChunk::memory_bytes).sum()
    }
}

impl PrimitiveChunk {
    fn memory_bytes(&self) -> u64 {
        let primitives = size_of_val(&*self.primitives);
        let varyings = size_of_val(&*self.varyings.values);
        (primitives + varyings + self.bins.memory_bytes()) as u64
    }
}
