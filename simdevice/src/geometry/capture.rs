//! The capture of primitives by transform feedback, before they are clipped.

use super::primitive_list::ListedPrimitive;
use super::shade::Shaded;
use crate::limits::{MAX_TRANSFORM_FEEDBACK_BUFFERS, MAX_VERTEX_STREAMS};
use crate::packet::Draw;
use crate::program::interface::CapturedOutputs;
use crate::stats::counters::{Counter, Counters};
use crate::transform_feedback::{StreamPrimitives, TransformFeedback};
use devmem::host;

/// The capture of a draw's primitives.
#[derive(Clone, Copy)]
pub(super) struct Capture<'a> {
    outputs: &'a CapturedOutputs,
    feedback: &'a TransformFeedback,
    corners: usize,
    provoking_last: bool,
}

/// Primitives that were captured and not written yet.
#[derive(Debug, Default)]
pub(super) struct CapturedPrimitives {
    /// The number of primitives of each vertex stream.
    counts: [u64; MAX_VERTEX_STREAMS],
    /// The values of their vertices for each buffer.
    values: [Vec<u32>; MAX_TRANSFORM_FEEDBACK_BUFFERS],
}

impl<'a> Capture<'a> {
    /// The capture of a draw whose primitives have `corners` corners; `None` if nothing is captured.
    pub(super) fn new(draw: &'a Draw, corners: usize) -> Option<Self> {
        Some(Self {
            outputs: draw.pipeline.captured.as_ref()?,
            feedback: draw.transform_feedback.as_deref()?,
            corners,
            provoking_last: draw.state.provoking_last,
        })
    }

    /// The bytes that are captured of a vertex.
    pub(super) fn vertex_bytes(&self) -> u64 {
        4 * u64::from(self.outputs.varyings)
    }

    /// Captures primitives, in order.
    pub(super) fn take(&self, shaded: &Shaded, primitives: &[ListedPrimitive]) -> CapturedPrimitives {
        let mut captured = CapturedPrimitives::default();
        for primitive in primitives {
            captured.counts[primitive.stream as usize] += 1;
            let slots = self.vertices(primitive);
            for (vertex, into) in self.outputs.buffers.iter().zip(&mut captured.values) {
                if vertex.stream != primitive.stream {
                    continue;
                }
                host::reserve(into, self.corners * vertex.values.len());
                for &slot in &slots[..self.corners] {
                    let values = shaded.values().vertex(slot);
                    let written = vertex.values.iter();
                    into.extend(written.map(|value| values[value.varying as usize]));
                }
            }
        }
        captured
    }

    /// The slots of a primitive's vertices in the order in which they are written: the provoking vertex is the first, or
    /// the last where it is that of the topology.
    fn vertices(&self, primitive: &ListedPrimitive) -> [u32; 3] {
        let mut slots = primitive.slots;
        if self.provoking_last && self.corners == 3 {
            let provoking = slots.iter().rposition(|&slot| slot == primitive.provoking);
            slots.rotate_left((provoking.unwrap_or(2) + 1) % 3);
        }
        slots
    }

    /// Writes captured primitives to the buffers.
    pub(super) fn write(&self, captured: &CapturedPrimitives, counters: &mut Counters) {
        for (stream, &count) in captured.counts.iter().enumerate() {
            if count == 0 {
                continue;
            }
            let primitives = StreamPrimitives {
                stream: stream as u32,
                count,
                corners: self.corners as u64,
                values: &captured.values,
            };
            let written = self.feedback.append(self.outputs, primitives);
            counters.add(Counter::CAPTURE_NEEDED[stream], count);
            counters.add(Counter::CAPTURED[stream], written);
        }
    }
}
