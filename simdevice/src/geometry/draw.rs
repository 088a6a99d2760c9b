//! Draws after the front end: segments of binned primitives, which are the input of the rasterizer.

use crate::geometry::Bins;
use crate::geometry::line::StyledLine;
use crate::geometry::primitive::{Primitive, Varyings};
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
    /// The bindings of the fragment program.
    pub bindings: Bindings,
    /// The primitives, in order.
    pub segments: Vec<PrimitiveSegment>,
    /// The pixels that they may touch, by viewport: the pass's area, cut to the scissor and the viewport. Primitives
    /// may extend beyond them.
    pub regions: Vec<Rect>,
    /// True if a query counts its fragments, so that hidden ones are shaded too.
    pub(crate) counts_fragments: bool,
    /// The record to which the work of its tiles is added, if there is a recorder.
    pub(crate) record: Option<Arc<DrawRecord>>,
}

/// Consecutive primitives of a draw that were set up together.
#[derive(Debug, Default)]
pub struct PrimitiveSegment {
    /// The primitives. If there are many, they are in the order in which macro-tiles read them.
    pub primitives: Vec<Primitive>,
    /// The varyings of their vertices.
    pub varyings: Varyings,
    /// The list of primitives of each macro-tile.
    pub bins: Bins,
    /// The lines that are no plain rectangles, in the order of the draw. Those that have no primitive stand before the next one
    /// that has, with its number.
    pub lines: Vec<StyledLine>,
}

impl PrimitiveDraw {
    /// The number of varyings of each vertex.
    pub(crate) fn varyings_per_vertex(&self) -> usize {
        let first = self.segments.first();
        first.map_or(0, |segment| segment.varyings.per_vertex)
    }

    /// A draw without primitives.
    pub(crate) fn empty(draw: &Draw) -> Self {
        Self {
            pipeline: Arc::clone(&draw.pipeline),
            state: Arc::clone(&draw.state),
            bindings: draw.fragment_bindings.clone(),
            segments: Vec::new(),
            regions: Vec::new(),
            counts_fragments: false,
            record: None,
        }
    }

    /// The bytes of host memory that it holds until it is rendered.
    pub(crate) fn memory_bytes(&self) -> u64 {
        self.segments.iter().map(PrimitiveSegment::memory_bytes).sum()
    }
}

impl PrimitiveSegment {
    pub(super) fn memory_bytes(&self) -> u64 {
        let primitives = size_of_val(&*self.primitives);
        let varyings = size_of_val(&*self.varyings.values);
        let lines = size_of_val(&*self.lines);
        (primitives + varyings + self.bins.memory_bytes() + lines) as u64
    }

    /// The place among the lines of a primitive that is one.
    pub(crate) fn line(&self, primitive: u32) -> Option<usize> {
        let end = self.lines.partition_point(|line| line.primitive <= primitive);
        end.checked_sub(1).filter(|place| self.lines[*place].primitive == primitive)
    }
}
