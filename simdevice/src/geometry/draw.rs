//! What the front end hands to the rasterizer: a draw as segments of primitives that are binned.

use crate::geometry::Bins;
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
    /// What the fragment program is bound to.
    pub bindings: Bindings,
    /// The primitives, in order.
    pub segments: Vec<PrimitiveSegment>,
    /// The pixels that they may touch, by viewport: those of the pass's area that lie in the scissor and in the
    /// viewport. Primitives may reach farther.
    pub regions: Vec<Rect>,
    /// Where the work of its tiles goes, if anybody wants to know.
    pub(crate) record: Option<Arc<DrawRecord>>,
}

/// Consecutive primitives of a draw that were set up together.
#[derive(Debug, Default)]
pub struct PrimitiveSegment {
    /// The primitives, in the order in which macro-tiles look at them where there are many.
    pub primitives: Vec<Primitive>,
    /// The varyings of their vertices.
    pub varyings: Varyings,
    /// Which of them each macro-tile has to look at.
    pub bins: Bins,
}

impl PrimitiveDraw {
    /// How many varyings each vertex has.
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
            record: None,
        }
    }

    /// Bytes of host memory that it holds while it waits.
    pub(crate) fn memory_bytes(&self) -> u64 {
        self.segments
            .iter()
            .map(PrimitiveSegment::memory_bytes)
            .sum()
    }
}

impl PrimitiveSegment {
    fn memory_bytes(&self) -> u64 {
        let primitives = size_of_val(&*self.primitives);
        let varyings = size_of_val(&*self.varyings.values);
        (primitives + varyings + self.bins.memory_bytes()) as u64
    }
}
