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
        _ => 3,
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
        TriangleStripWithAdjacency => (
            [2 * i, 2 * i + 2 + 2 * odd, 2 * i + 4 - 2 * odd],
            [0, 2 - odd as usize],
        ),
    };
    Corners {
        places,
        provoking: provoking[usize::from(last)],
    }
}

/// The range of places that primitives `first..end` use. A fan also uses place 0 ([`uses_pivot`]).
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
        TriangleStripWithAdjacency => 2 * first..2 * end + 4,
    }
}

/// True if every primitive uses the run's first vertex.
pub(super) fn uses_pivot(topology: Topology) -> bool {
    topology == Topology::TriangleFan
}
