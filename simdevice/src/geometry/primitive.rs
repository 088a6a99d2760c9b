//! Primitives as they are rasterized.

/// The varyings of vertices, including those that clipping made: 32-bit scalars, vertex by vertex.
#[derive(Debug, Default)]
pub struct Varyings {
    /// The values of all vertices.
    pub values: Vec<u32>,
    /// The number of varyings of each vertex.
    pub per_vertex: usize,
}

/// The kind of primitive from which a convex polygon was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PrimitiveKind {
    /// A triangle: corners 0 to 2.
    Triangle,
    /// A line: the parallelogram of corners 0 to 2; corners 0 and 1 are at its first vertex, corner 2 at its second.
    Line,
    /// A line whose pixels a [`StyledLine`](super::StyledLine) decides, of which this parallelogram has all samples.
    StyledLine,
    /// A point: the axis-aligned square of corners 0 (top left), 1 (top right) and 2 (bottom right).
    Point,
}

/// A convex polygon to be rasterized: a triangle, or the parallelogram whose fourth corner is c0 + c2 - c1. Everything
/// interpolated over it is affine in the framebuffer (after division by w for perspective-correct varyings). The values
/// are given at the vertices of corners 0 to 2, at their positions before snapping.
#[derive(Clone, Copy, Debug)]
pub struct Primitive {
    /// Framebuffer positions in 1/256 pixels, x and y down; ordered so that the signed area
    /// (c1 - c0) x (c2 - c0) is positive, whichever way the primitive faces.
    pub corners: [[i32; 2]; 3],
    /// The positions of the vertices before snapping, relative to the corners, in 2^-24 pixels. Interpolated values
    /// apply there.
    pub offsets: [[i16; 2]; 3],
    /// Depth at the vertices, viewport-mapped, with depth bias, not clamped.
    pub depth: [f32; 3],
    /// 1 / w at the vertices.
    pub inverse_w: [f32; 3],
    /// The vertices at the corners, as numbers in [`PrimitiveSegment::varyings`](super::PrimitiveSegment::varyings).
    pub vertices: [u32; 3],
    /// The vertex whose values flat varyings take.
    pub provoking: u32,
    /// The number of its primitive within the instance.
    pub id: u32,
    /// The kind of primitive that it was made from.
    pub kind: PrimitiveKind,
    /// True if it faces the front, as all points and lines do.
    pub front: bool,
    /// The viewport, which selects the scissor and the range to which depth is clamped.
    pub viewport: u8,
    /// The layer to which it is drawn.
    pub layer: u16,
}

/// Twice the signed area of a triangle.
#[inline(always)]
pub(super) fn cross([a, b, c]: [[i32; 2]; 3]) -> i64 {
    let along = |to: [i32; 2], axis: usize| i64::from(to[axis]) - i64::from(a[axis]);
    along(b, 0) * along(c, 1) - along(b, 1) * along(c, 0)
}
