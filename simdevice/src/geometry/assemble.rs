//! Primitive assembly: the vertices of each primitive in a run (Vulkan 1.3, "Primitive Topologies").

use crate::state::Topology;

/// A primitive's vertices, each by its place in a run, which is a sequence of vertices without a restart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Corners {
    /// The places of the vertices. For points and lines, the last one is repeated.
    pub places: [u32; 3],
    /// The index in `places` of the provoking vertex.
    pub provoking: usize,
}

/// The number of corners of a primitive: 1 for points, 2 for lines, 3 for triangles.
pub(super) fn corner_count(topology: Topology) -> usize {
    use Topology::*;
    match topology {
        PointList => 1,
        LineList | LineStrip | LineListWithAdjacency | LineStripWithAdjacency => 2,
        TriangleList | TriangleStrip | TriangleFan => 3,
        TriangleListWithAdjacency | TriangleStripWithAdjacency => 3,
        // Tessellation decides.
        PatchList { .. } => 3,
    }
}

/// The number of primitives in a run of vertices.
pub(super) fn primitive_count(topology: Topology, vertices: u32) -> u32 {
    use Topology::*;
    match topology {
        PointList => vertices,
        LineList => vertices / 2,
        LineStrip => vertices.saturating_sub(1),
        TriangleList => vertices / 3,
        TriangleStrip | TriangleFan => vertices.saturating_sub(2),
        LineListWithAdjacency => vertices / 4,
        LineStripWithAdjacency => vertices.saturating_sub(3),
        TriangleListWithAdjacency => vertices / 6,
        TriangleStripWithAdjacency => vertices.saturating_sub(4) / 2,
        PatchList { control_points } => vertices / control_points.max(1),
    }
}

/// The number of vertices of a primitive, adjacent ones and those of a patch included.
pub(super) fn vertex_count(topology: Topology) -> usize {
    use Topology::*;
    match topology {
        PatchList { control_points } => control_points as usize,
        LineListWithAdjacency | LineStripWithAdjacency => 4,
        TriangleListWithAdjacency | TriangleStripWithAdjacency => 6,
        other => corner_count(other),
    }
}

/// The places of all vertices of primitive `number` of a run: its corners with adjacent vertices between, or a patch.
/// `is_last` tells if it is the run's last primitive.
pub(super) fn vertices(topology: Topology, number: u32, is_last: bool, places: &mut Vec<u32>) {
    use Topology::*;
    let i = number;
    places.clear();
    match topology {
        PatchList { control_points } => {
            places.extend((0..control_points).map(|vertex| i * control_points + vertex));
        }
        LineListWithAdjacency => places.extend(4 * i..4 * i + 4),
        LineStripWithAdjacency => places.extend(i..i + 4),
        TriangleListWithAdjacency => places.extend(6 * i..6 * i + 6),
        TriangleStripWithAdjacency => {
            let [a, b, c] = corners(topology, false, i).places;
            let before = if i == 0 { 1 } else { 2 * i - 2 };
            let after = if is_last { 2 * i + 5 } else { 2 * i + 6 };
            let beside = 2 * i + 3;
            places.extend(if i.is_multiple_of(2) {
                [a, before, b, after, c, beside]
            } else {
                [a, beside, b, after, c, before]
            });
        }
        other => places.extend(&corners(other, false, i).places[..corner_count(other)]),
    }
}

/// The corners of primitive `number` of a run.
#[inline]
pub(super) fn corners(topology: Topology, last: bool, number: u32) -> Corners {
    use Topology::*;
    let i = number;
    let odd = i % 2;
    let (places, provoking) = match topology {
        PointList => ([i; 3], [0, 0]),
        LineList => ([2 * i, 2 * i + 1, 2 * i + 1], [0, 1]),
        LineStrip => ([i, i + 1, i + 1], [0, 1]),
        TriangleList => ([3 * i, 3 * i + 1, 3 * i + 2], [0, 2]),
        // The two later vertices of odd triangles are exchanged, so that all triangles have the same winding.
        TriangleStrip => ([i, i + 1 + odd, i + 2 - odd], [0, 2 - odd as usize]),
        TriangleFan => ([i + 1, i + 2, 0], [0, 1]),
        LineListWithAdjacency => ([4 * i + 1, 4 * i + 2, 4 * i + 2], [0, 1]),
        LineStripWithAdjacency => ([i + 1, i + 2, i + 2], [0, 1]),
        TriangleListWithAdjacency => ([6 * i, 6 * i + 2, 6 * i + 4], [0, 2]),
        TriangleStripWithAdjacency => ([2 * i, 2 * i + 2 + 2 * odd, 2 * i + 4 - 2 * odd], [0, 2 - odd as usize]),
        PatchList { control_points } => ([control_points * i; 3], [0, 0]),
    };
    Corners { places, provoking: provoking[usize::from(last)] }
}

/// The range of places that primitives `first..end` use; it may end beyond the run. A fan also uses place 0 ([`uses_pivot`]).
pub(super) fn places(topology: Topology, first: u32, end: u32) -> std::ops::Range<u32> {
    use Topology::*;
    match topology {
        PointList => first..end,
        LineList => 2 * first..2 * end,
        LineStrip => first..end + 1,
        TriangleList => 3 * first..3 * end,
        TriangleStrip => first..end + 2,
        TriangleFan => first + 1..end + 2,
        LineListWithAdjacency => 4 * first..4 * end,
        LineStripWithAdjacency => first..end + 3,
        TriangleListWithAdjacency => 6 * first..6 * end,
        // Both neighbours of a strip's triangles may have vertices beyond the range.
        TriangleStripWithAdjacency => (2 * first).saturating_sub(2)..2 * end + 5,
        PatchList { control_points } => control_points * first..control_points * end,
    }
}

/// True if every primitive uses the run's first vertex.
pub(super) fn uses_pivot(topology: Topology) -> bool {
    topology == Topology::TriangleFan
}
