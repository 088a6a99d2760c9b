//! Lists of primitives: those that tessellation and geometry programs take, and those that are set up.

use super::assemble;
use super::vertex_reuse::VertexReuse;
use crate::state::Topology;
use devmem::host;

/// Primitives or patches that a program takes.
#[derive(Debug, Default)]
pub(super) struct PrimitiveList {
    /// The slots of their vertices, adjacent ones included.
    pub vertices: Vec<u32>,
    /// The number of vertices of each.
    pub per_primitive: usize,
    /// The number of each within the instance.
    pub ids: Vec<u32>,
}

/// A primitive to be set up, after the programs.
#[derive(Clone, Copy, Debug)]
pub(super) struct ListedPrimitive {
    /// The slots of its corners. For points and lines, the last one is repeated.
    pub slots: [u32; 3],
    /// The slot of the provoking vertex.
    pub provoking: u32,
    /// Its number.
    pub id: u32,
    /// The vertex stream that it belongs to.
    pub stream: u32,
}

/// Lists the primitives of a segment for set-up, if there are no programs that take them.
pub(super) fn list_corners(
    topology: Topology,
    provoking_last: bool,
    reuse: &VertexReuse,
    into: &mut Vec<ListedPrimitive>,
) {
    into.clear();
    for piece in &reuse.pieces {
        for number in piece.first..piece.end {
            let found = assemble::corners(topology, provoking_last, number);
            let slots = found.places.map(|place| reuse.slot(piece, place));
            let primitive = ListedPrimitive {
                slots,
                provoking: slots[found.provoking],
                id: piece.primitives_before.wrapping_add(number),
                stream: 0,
            };
            host::push(into, primitive);
        }
    }
}

impl PrimitiveList {
    /// Removes all primitives.
    pub(super) fn clear(&mut self, per_primitive: usize) {
        self.vertices.clear();
        self.ids.clear();
        self.per_primitive = per_primitive;
    }

    /// The number of primitives.
    pub(super) fn len(&self) -> usize {
        self.ids.len()
    }

    /// The slots of a primitive's vertices.
    pub(super) fn vertices_of(&self, number: usize) -> &[u32] {
        &self.vertices[number * self.per_primitive..][..self.per_primitive]
    }

    /// Lists the primitives of a segment, with their adjacent vertices.
    pub(super) fn assemble(&mut self, topology: Topology, reuse: &VertexReuse) {
        self.clear(assemble::vertex_count(topology));
        let mut places = Vec::with_capacity(self.per_primitive);
        for piece in &reuse.pieces {
            for number in piece.first..piece.end {
                let is_last = number + 1 == piece.run_primitives;
                assemble::vertices(topology, number, is_last, &mut places);
                for &place in &places {
                    host::push(&mut self.vertices, reuse.slot(piece, place));
                }
                host::push(&mut self.ids, piece.primitives_before.wrapping_add(number));
            }
        }
    }

    /// The primitives for set-up, if no further program takes them.
    pub(super) fn list(&self, provoking_last: bool, into: &mut Vec<ListedPrimitive>) {
        into.clear();
        for (vertices, &id) in self.vertices.chunks_exact(self.per_primitive.max(1)).zip(&self.ids) {
            let (first, last) = (vertices[0], vertices[vertices.len() - 1]);
            let corner = |number: usize| vertices.get(number).copied().unwrap_or(last);
            let primitive = ListedPrimitive {
                slots: [first, corner(1), corner(2)],
                provoking: if provoking_last { last } else { first },
                id,
                stream: 0,
            };
            host::push(into, primitive);
        }
    }
}
