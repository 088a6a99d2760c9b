//! Transform feedback: the buffers that the vertices of primitives are written to before rasterization.

use crate::limits::MAX_TRANSFORM_FEEDBACK_BUFFERS;
use crate::program::interface::{CapturedOutputs, CapturedVertex};
use devmem::BufferRange;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// The counter buffers: for each buffer that has one, the word in memory that keeps how many bytes of it are written.
pub type CounterBuffers = [Option<BufferRange>; MAX_TRANSFORM_FEEDBACK_BUFFERS];

/// The buffers of transform feedback, from its beginning to its end.
#[derive(Debug)]
pub struct TransformFeedback {
    /// The buffers; values for others are dropped.
    buffers: [Option<BufferRange>; MAX_TRANSFORM_FEEDBACK_BUFFERS],
    /// The number of bytes of each that are written.
    written: [AtomicU64; MAX_TRANSFORM_FEEDBACK_BUFFERS],
}

/// Captured primitives of one vertex stream.
#[derive(Clone, Copy)]
pub(crate) struct StreamPrimitives<'a> {
    /// The stream.
    pub stream: u32,
    /// The number of primitives.
    pub count: u64,
    /// The number of vertices of each.
    pub corners: u64,
    /// The values of their vertices for each buffer, as [`CapturedVertex::values`] orders them.
    pub values: &'a [Vec<u32>; MAX_TRANSFORM_FEEDBACK_BUFFERS],
}

impl TransformFeedback {
    /// Transform feedback to buffers that are empty so far.
    pub fn new(buffers: [Option<BufferRange>; MAX_TRANSFORM_FEEDBACK_BUFFERS]) -> Self {
        Self { buffers, written: Default::default() }
    }

    /// Reads how many bytes of each buffer are written already.
    pub(crate) fn begin(&self, counters: &CounterBuffers) {
        for (written, counter) in self.written.iter().zip(counters) {
            let mut word = [0u32];
            if let Some(counter) = counter {
                // A counter outside its memory is 0.
                let _ = counter.memory.read(counter.offset, &mut word);
            }
            written.store(word[0].into(), Relaxed);
        }
    }

    /// Stores how many bytes of each buffer are written.
    pub(crate) fn end(&self, counters: &CounterBuffers) {
        for (written, counter) in self.written.iter().zip(counters) {
            if let Some(counter) = counter {
                let word = [written.load(Relaxed) as u32];
                if counter.memory.write(counter.offset, &word).is_err() {
                    log::warn!("left out a counter of transform feedback that lies outside");
                }
                counter.memory.bump_generation();
            }
        }
    }

    /// Appends primitives to the buffers of their stream, as many as fit into all of these. Returns their number.
    pub(crate) fn append(&self, outputs: &CapturedOutputs, primitives: StreamPrimitives<'_>) -> u64 {
        let of_stream =
            |(_, vertex): &(usize, &CapturedVertex)| vertex.stride > 0 && vertex.stream == primitives.stream;
        let vertices = outputs.buffers.iter().enumerate().filter(of_stream);
        let targets = vertices.filter_map(|(number, vertex)| {
            let buffer = self.buffers[number].as_ref()?;
            Some((number, vertex, buffer))
        });
        let bytes = |vertex: &CapturedVertex| u64::from(vertex.stride) * primitives.corners;
        let fitting = targets.clone().map(|(number, vertex, buffer)| {
            let written = self.written[number].load(Relaxed);
            buffer.size.saturating_sub(written) / bytes(vertex)
        });
        let count = fitting.min().unwrap_or(0).min(primitives.count);
        for (number, vertex, buffer) in targets {
            let start = self.written[number].fetch_add(count * bytes(vertex), Relaxed);
            let words = vertex.values.len() * (count * primitives.corners) as usize;
            let values = &primitives.values[number][..words];
            if write_vertices(vertex, buffer, start, values).is_none() {
                log::warn!("left out vertices of transform feedback that lie outside");
            }
            buffer.memory.bump_generation();
        }
        count
    }
}

/// Writes the values of consecutive vertices from byte `start` of a buffer on. `None` if the memory ends before.
fn write_vertices(vertex: &CapturedVertex, buffer: &BufferRange, start: u64, values: &[u32]) -> Option<()> {
    let start = buffer.offset.checked_add(start)?;
    if vertex.values.len() * 4 == vertex.stride as usize {
        return buffer.memory.write(start, values).ok();
    }
    for (number, values) in (0..).zip(values.chunks_exact(vertex.values.len().max(1))) {
        let first = start.checked_add(number * u64::from(vertex.stride))?;
        let mut done = 0;
        // Values that lie side by side are written together.
        for side_by_side in vertex.values.chunk_by(|a, b| b.offset == a.offset + 4) {
            let offset = first + u64::from(side_by_side[0].offset);
            let values = &values[done..][..side_by_side.len()];
            buffer.memory.write(offset, values).ok()?;
            done += side_by_side.len();
        }
    }
    Some(())
}
