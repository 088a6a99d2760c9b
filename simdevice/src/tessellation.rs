//! The fixed-function tessellator.

/// The greatest level to which an edge is divided.
pub const MAX_LEVEL: u32 = 64;

/// The domain of a tessellated patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are Vulkan's")]
pub enum Domain {
    Triangles,
    Quads,
    Isolines,
}

/// The spacing of the vertices of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are Vulkan's")]
pub enum Spacing {
    Equal,
    FractionalEven,
    FractionalOdd,
}

/// The way in which patches are divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tessellation {
    /// The domain.
    pub domain: Domain,
    /// The spacing.
    pub spacing: Spacing,
    /// True if triangles are clockwise.
    pub clockwise: bool,
    /// True if vertices become points.
    pub point_mode: bool,
}

/// A divided patch.
#[derive(Debug, Default)]
pub struct TessellatedPatch {
    /// The vertices' coordinates u, v and w.
    pub points: Vec<[f32; 3]>,
    /// The vertices of the primitives, 1 to 3 each.
    pub indices: Vec<u32>,
}

impl Tessellation {
    /// The number of vertices of a primitive.
    pub fn corners(&self) -> usize {
        match self.domain {
            _ if self.point_mode => 1,
            Domain::Isolines => 2,
            Domain::Triangles | Domain::Quads => 3,
        }
    }

    /// Divides a patch.
    pub fn tessellate(&self, _outer: [f32; 4], _inner: [f32; 2], out: &mut TessellatedPatch) {
        out.points.clear();
        out.indices.clear();
    }
}
