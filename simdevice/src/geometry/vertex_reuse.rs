//! The vertices of a draw: consecutive numbers or indices, runs between primitive restarts, and the distinct vertices
//! of a segment of primitives.

use super::assemble::{places, primitive_count, uses_pivot};
use crate::packet::Draw;
use crate::state::Topology;
use devmem::host;

/// A sequence of vertices without a restart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RestartRun {
    /// The place of its first vertex among the draw's vertices.
    pub start: u32,
    /// The number of primitives before it in the instance.
    pub primitives_before: u32,
    /// The number of its primitives.
    pub primitives: u32,
    /// The number of its vertices.
    pub vertices: u32,
}

/// The number of indices that are searched for restarts at a time.
const SCAN: u32 = 1 << 16;

/// The runs of a draw that have primitives, and the number of vertices of all runs.
pub(super) fn runs(draw: &Draw) -> (Vec<RestartRun>, u64) {
    let topology = draw.state.topology;
    let mut runs = Runs { topology, runs: Vec::new(), primitives: 0, vertices: 0 };
    match &draw.indices {
        Some(stream) if draw.state.primitive_restart => {
            let restart = stream.restart_index();
            let (mut start, mut indices) = (0, Vec::new());
            // Indices outside the buffer read as zero.
            let known = stream.len().saturating_sub(u64::from(draw.first));
            let known = known.min(u64::from(draw.count)) as u32;
            for block in (0..known).step_by(SCAN as usize) {
                let len = SCAN.min(known - block);
                stream.read(u64::from(draw.first) + u64::from(block), len, &mut indices);
                for (place, &index) in (block..).zip(&indices) {
                    if index == restart {
                        runs.push(start, place);
                        start = place + 1;
                    }
                }
            }
            runs.push(start, if restart == 0 { known } else { draw.count });
        }
        _ => runs.push(0, draw.count),
    }
    (runs.runs, runs.vertices)
}

struct Runs {
    topology: Topology,
    runs: Vec<RestartRun>,
    primitives: u32,
    vertices: u64,
}

impl Runs {
    fn push(&mut self, start: u32, end: u32) {
        let vertices = end.saturating_sub(start);
        let primitives = primitive_count(self.topology, vertices);
        self.vertices += u64::from(vertices);
        if primitives > 0 {
            let run = RestartRun { start, primitives_before: self.primitives, primitives, vertices };
            host::push(&mut self.runs, run);
            self.primitives += primitives;
        }
    }
}

/// Consecutive primitives of one run and instance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// The number in the run of its first primitive.
    pub first: u32,
    /// The number in the run after its last primitive.
    pub end: u32,
    /// The number of primitives before the run.
    pub primitives_before: u32,
    /// The number of primitives of the run.
    pub run_primitives: u32,
    /// The place in the run of its first element.
    base: u32,
    /// The index of its first element in [`VertexReuse::slots`].
    elements: usize,
    /// The first of its slots.
    first_vertex: usize,
    /// The slot of the run's first vertex, if all primitives use it.
    pivot: u32,
}

/// The distinct vertices of a segment, each in a slot, and the slots of its primitives.
#[derive(Debug, Default)]
pub(super) struct VertexReuse {
    pub pieces: Vec<Piece>,
    /// The vertex number of each slot. An offset may make it negative.
    pub vertices: Vec<i64>,
    /// The instance of each slot, counted from the draw's first.
    pub instances: Vec<u32>,
    /// The slot of each element of each piece, in order.
    slots: Vec<u32>,
    indices: Vec<u32>,
    table: Vec<u32>,
}

impl VertexReuse {
    /// Removes the previous segment.
    pub(super) fn clear(&mut self) {
        self.pieces.clear();
        self.vertices.clear();
        self.instances.clear();
        self.slots.clear();
    }

    /// The number of primitives of the segment.
    pub(super) fn primitives(&self) -> u64 {
        let pieces = self.pieces.iter();
        pieces.map(|piece| u64::from(piece.end - piece.first)).sum()
    }

    /// Adds primitives `first..end` of a run.
    pub(super) fn push(&mut self, draw: &Draw, run: &RestartRun, instance: u32, first: u32, end: u32) {
        let topology = draw.state.topology;
        let range = places(topology, first, end);
        let range = range.start..range.end.min(run.vertices);
        let place = |place: u32| u64::from(draw.first) + u64::from(run.start) + u64::from(place);
        let pivot = uses_pivot(topology);
        let (elements, first_vertex) = (self.slots.len(), self.vertices.len());
        // If an instance repeats the piece before it, the slots are copied.
        if let Some(&before) = self.pieces.last()
            && (before.first, before.end) == (first, end)
            && before.primitives_before == run.primitives_before
        {
            self.repeat(before, instance);
            return;
        }
        match &draw.indices {
            None => {
                let next = self.vertices.len() as u32;
                let len = range.end - range.start;
                self.slots.extend(next..next + len);
                let numbers = place(range.start)..place(range.start) + u64::from(len);
                self.vertices.extend(numbers.map(|number| number as i64));
                if pivot {
                    self.slots.push(next + len);
                    self.vertices.push(place(0) as i64);
                }
            }
            Some(stream) => {
                let mut indices = std::mem::take(&mut self.indices);
                let len = range.end - range.start;
                if pivot {
                    let mut first = Vec::new();
                    stream.read(place(0), 1, &mut first);
                    stream.read(place(range.start), len, &mut indices);
                    indices.extend(first);
                } else {
                    stream.read(place(range.start), len, &mut indices);
                }
                self.place_indices(&indices, stream.vertex_offset.into());
                self.indices = indices;
            }
        }
        self.instances.resize(self.vertices.len(), instance);
        self.pieces.push(Piece {
            first,
            end,
            primitives_before: run.primitives_before,
            run_primitives: run.primitives,
            base: range.start,
            elements,
            first_vertex,
            pivot: if pivot { self.slots.last().copied().unwrap_or(0) } else { 0 },
        });
    }

    /// Adds the primitives of `before`, the last piece, again for another instance.
    fn repeat(&mut self, before: Piece, instance: u32) {
        let elements = self.slots.len();
        // The vertices of `before` are the last ones.
        let first = before.first_vertex;
        let shift = (self.vertices.len() - first) as u32;
        self.slots.extend_from_within(before.elements..);
        for slot in &mut self.slots[elements..] {
            *slot += shift;
        }
        self.vertices.extend_from_within(first..);
        self.instances.resize(self.vertices.len(), instance);
        self.pieces.push(Piece {
            elements,
            first_vertex: first + shift as usize,
            pivot: before.pivot + shift,
            ..before
        });
    }

    /// Assigns a slot to each distinct index, and appends the slot of every index.
    fn place_indices(&mut self, indices: &[u32], offset: i64) {
        let (mut least, mut greatest) = (u32::MAX, 0);
        for &index in indices {
            least = least.min(index);
            greatest = greatest.max(index);
        }
        let range = u64::from(greatest.saturating_sub(least)) + 1;
        if range <= 8 * indices.len() as u64 + 64 {
            self.place_dense(indices, least, range as usize, offset);
        } else {
            self.place_sparse(indices, offset);
        }
    }

    /// Assigns slots with a table of all indices in the range. Slots ascend with indices, so that memory is read in
    /// order.
    fn place_dense(&mut self, indices: &[u32], least: u32, range: usize, offset: i64) {
        self.table.clear();
        host::resize(&mut self.table, range, 0);
        for &index in indices {
            self.table[(index - least) as usize] = 1;
        }
        for (index, entry) in (least..=u32::MAX).zip(&mut self.table) {
            if *entry != 0 {
                *entry = self.vertices.len() as u32;
                self.vertices.push(i64::from(index) + offset);
            }
        }
        let table = &self.table;
        let slots = indices.iter().map(|&index| table[(index - least) as usize]);
        self.slots.extend(slots);
    }

    /// Assigns slots with a hash table with open addressing, in the order of first use.
    fn place_sparse(&mut self, indices: &[u32], offset: i64) {
        const FREE: u32 = u32::MAX;
        let bits = (2 * indices.len()).next_power_of_two().trailing_zeros().max(1);
        self.table.clear();
        host::resize(&mut self.table, 1 << bits, FREE);
        let mask = (1usize << bits) - 1;
        for &index in indices {
            let number = i64::from(index) + offset;
            let mut at = (index.wrapping_mul(0x9E37_79B9) >> (32 - bits)) as usize;
            let slot = loop {
                match self.table[at] {
                    FREE => {
                        let slot = self.vertices.len() as u32;
                        self.table[at] = slot;
                        self.vertices.push(number);
                        break slot;
                    }
                    slot if self.vertices[slot as usize] == number => break slot,
                    _ => at = (at + 1) & mask,
                }
            };
            self.slots.push(slot);
        }
    }

    /// The slot of the vertex at a place of a piece's run.
    #[inline(always)]
    pub(super) fn slot(&self, piece: &Piece, place: u32) -> u32 {
        match place.checked_sub(piece.base) {
            Some(place) => self.slots[piece.elements + place as usize],
            None => piece.pivot,
        }
    }
}
