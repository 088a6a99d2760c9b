//! Primitives as they are rasterized.

/// The varyings of vertices, those that clipping made included: 32-bit scalars, vertex by vertex.
#[derive(Debug, Default)]
pub struct Varyings {
    /// All of them.
    pub values: Vec<u32>,
    /// How many each vertex has.
    pub per_vertex: usize,
}

/// What a primitive was before it became a convex polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PrimitiveKind {
    /// A triangle: corners 0 to 2.
    Triangle,
    /// A line: the parallelogram of corners 0 to 2; corners 0 and 1 are at its first vertex, corner 2 at its second.
    Line,
    /// A point: the axis-aligned square of corners 0 (top left), 1 (top right) and 2 (bottom right).
    Point,
}

/// A convex polygon to be rasterized: a triangle, or the parallelogram whose fourth corner is c0 + c2 - c1. Whatever
/// varies over it is affine in the framebuffer (after division by w where it is perspective-correct), and given at
/// corners 0 to 2, or where those were before snapping.
#[derive(Clone, Copy, Debug)]
pub struct Primitive {
    /// Framebuffer positions in 1/256 pixels, x and y down; ordered so that the signed area
    /// (c1 - c0) x (c2 - c0) is positive, whichever way the primitive faces.
    pub corners: [[i32; 2]; 3],
    /// Where the vertices were before snapping, from the corners, in 2^-24 pixels. Whatever varies has its values
    /// there.
    pub offsets: [[i16; 2]; 3],
    /// Depth at the vertices, viewport-mapped, with depth bias, not clamped.
    pub depth: [f32; 3],
    /// 1 / w at the vertices.
    pub inverse_w: [f32; 3],
    /// The vertices at the corners, in [`PrimitiveSegment::varyings`].
    pub vertices: [u32; 3],
    /// The vertex that flat varyings are taken from.
    pub provoking: u32,
    /// Its number within the instance.
    pub id: u32,
    /// What it is.
    pub kind: PrimitiveKind,
    /// Whether it faces the front; points and lines do.
    pub front: bool,
    /// The viewport, which selects the scissor and the range that depth is clamped to.
    pub viewport: u8,
    /// The layer that it is drawn to.
    pub layer: u16,
}
