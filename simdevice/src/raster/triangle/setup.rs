//! Triangle set-up for tiles: edges as exact integer functions, and interpolated values as planes.

use crate::geometry::{Primitive, PrimitiveKind, StyledLine};
use crate::raster::tile::{LANE_X, LANE_Y};
use crate::simd::{both, three};
use crate::state::Rect;
use fearless_simd::{Simd, f32x16, i32x16, prelude::*};

/// The greatest distance of a primitive from the framebuffer's corner, in 1/256 pixels, for which edge functions fit
/// into 64 bits. Larger primitives are not drawn.
pub const MAX_COORDINATE: i32 = 1 << 29;

/// The number of sub-pixel positions in a pixel.
const ONE: i64 = 256;

/// The number of units of [`Primitive::offsets`] in 1/256 pixel.
const OFFSETS_IN_SUB_PIXEL: f64 = 65_536.0;

/// An edge function: a sample of pixel (x, y) is inside if `a x + b y + c[sample] >= 0`. It is the edge function in
/// 1/256 pixels, divided by 256 and rounded down. That changes no sign, since `a x + b y` is an integer.
#[derive(Clone, Copy, Debug, Default)]
pub struct Edge {
    pub a: i64,
    pub b: i64,
    pub c: [i64; 4],
    /// The values of `a x + b y` for the lanes of a block, if they fit into 32 bits.
    pub lanes: [i32; 16],
}

/// The data of a primitive that do not depend on the tile.
#[derive(Clone, Debug, Default)]
pub struct TriangleSetup {
    edges: [Edge; 4],
    edge_count: usize,
    /// The pixels that may have covered samples.
    pub bounds: Rect,
    origin: [i64; 2],
    /// The gradients by x and y, per 1/256 pixel, of the barycentrics' numerators of corners 1 and 2, without the
    /// correction for snapping.
    numerators: [[i64; 2]; 2],
    correction: SnapCorrection,
    inverse_area: f64,
    /// The differences of the barycentrics from a block's first pixel to each lane.
    pub lane_barycentrics: [[f32; 16]; 2],
    /// The barycentrics' derivatives by x and y in pixels.
    pub slopes: [[f32; 2]; 2],
    depth: [f64; 3],
    /// The differences of depth from a block's first pixel to each lane.
    pub lane_depth: [f32; 16],
    /// The derivatives of depth by x and y in pixels.
    pub depth_slopes: [f32; 2],
    inverse_w: [f64; 3],
    /// The differences of 1 / w from a block's first pixel to each lane.
    pub lane_w: [f32; 16],
    /// The derivatives of 1 / w by x and y in pixels.
    pub w_slopes: [f32; 2],
    /// The values of 1 / w at corners 1 and 2, in units of `scale`.
    pub weights: [f32; 2],
    /// True if 1 / w is known to be the same at all corners.
    pub affine: bool,
    /// The unit of 1 / w: its value if it is the same at all corners, so that no digits are lost; otherwise 1.
    pub scale: f32,
}

/// The correction of barycentrics for snapping. Corners are snapped, but the vertices' values apply at their positions
/// before snapping.
#[derive(Clone, Copy, Debug, Default)]
struct SnapCorrection {
    /// The correction that is added to [`TriangleSetup::numerators`].
    numerators: [[f64; 2]; 2],
    /// The barycentrics' numerators at corner 0.
    at_origin: [f64; 2],
    /// Twice the area of the triangle of the vertices.
    area: f64,
}

impl SnapCorrection {
    /// The correction for vertices at their corners, which enclose half of `area`.
    fn nowhere(area: i64) -> Self {
        Self { area: area as f64, ..Self::default() }
    }

    /// The correction for vertices at `offsets` from the corners. `None` for very thin triangles that snapping has
    /// turned over or made much wider, because their samples may lie far outside of the original triangle.
    #[inline(always)]
    fn new(numerators: [[i64; 2]; 2], area: i64, offsets: [[i16; 2]; 3]) -> Option<Self> {
        let [o0, o1, o2] = three(offsets, |offset| both(offset, |offset| f64::from(offset) / OFFSETS_IN_SUB_PIXEL));
        let by = [[o2[1] - o0[1], o0[0] - o2[0]], [o0[1] - o1[1], o1[0] - o0[0]]];
        let [[a1, b1], [a2, b2]] = both(numerators, |n| both(n, |n| n as f64));
        let [[c1, d1], [c2, d2]] = by;
        // The large part of the sum is exact.
        let larger = a1 * d2 + c1 * (b2 + d2) - b1 * c2 - d1 * (a2 + c2);
        let snapped = area as f64;
        (snapped + larger >= 0.25 * snapped).then(|| Self {
            numerators: by,
            at_origin: [-(a1 + c1) * o0[0] - (b1 + d1) * o0[1], -(a2 + c2) * o0[0] - (b2 + d2) * o0[1]],
            area: snapped + larger,
        })
    }
}

/// The pixels, as `first..end`, that may have samples between two coordinates of 1/256 pixels.
fn pixels(low: i32, high: i32, samples: usize) -> (i32, i32) {
    if samples == 1 { ((low + 127) >> 8, ((high - 128) >> 8) + 1) } else { (low >> 8, (high >> 8) + 1) }
}

impl TriangleSetup {
    /// Sets up a primitive. Returns false, and leaves the value undefined, if none of its samples lies in `clip`.
    /// Differences for lanes are computed only as far as `needs` says.
    #[inline(always)]
    pub fn prepare<S: Simd>(
        &mut self,
        simd: S,
        primitive: &Primitive,
        positions: &[[i32; 2]],
        clip: Rect,
        needs: Needs,
    ) -> bool {
        self.set_edges(simd, primitive, positions, clip) && self.set_planes(simd, primitive, needs)
    }

    /// Sets up a line within the outline that is its primitive's. The values are those of its rectangle.
    #[cold]
    pub fn prepare_line<S: Simd>(
        &mut self,
        simd: S,
        primitive: &Primitive,
        line: &StyledLine,
        positions: &[[i32; 2]],
        clip: Rect,
        needs: Needs,
    ) -> bool {
        let of_rectangle = Primitive { corners: line.rectangle, ..*primitive };
        self.set_edges(simd, primitive, positions, clip) && self.set_planes(simd, &of_rectangle, needs)
    }

    /// Sets the edges and the bounds. Returns false if no sample lies in `clip`.
    #[inline(always)]
    fn set_edges<S: Simd>(&mut self, simd: S, primitive: &Primitive, positions: &[[i32; 2]], clip: Rect) -> bool {
        let [p0, p1, p2] = primitive.corners;
        let parallelogram = primitive.kind != PrimitiveKind::Triangle;
        let mut corners = [p0, p1, p2, p2];
        let edge_count = if parallelogram { 4 } else { 3 };
        if parallelogram {
            corners[3] = both([0, 1], |axis| p0[axis].saturating_add(p2[axis]).saturating_sub(p1[axis]));
        }
        let extent = |axis: usize| {
            let [a, b, c, d] = corners;
            let [a, b, c, d] = [a[axis], b[axis], c[axis], d[axis]];
            (a.min(b).min(c).min(d), a.max(b).max(c).max(d))
        };
        let ((left, right), (top, bottom)) = (extent(0), extent(1));
        if left.min(top) < -MAX_COORDINATE || right.max(bottom) > MAX_COORDINATE {
            return false;
        }
        let (columns, rows) = (pixels(left, right, positions.len()), pixels(top, bottom, positions.len()));
        let span = |(first, end): (i32, i32)| (end - first).max(0) as u32;
        let bounds = clip.intersect(Rect { x: columns.0, y: rows.0, width: span(columns), height: span(rows) });
        if bounds.is_empty() {
            return false;
        }
        let wide = |p: [i32; 2]| both(p, i64::from);
        for (index, edge) in self.edges.iter_mut().enumerate().take(edge_count) {
            let next = if index + 1 == edge_count { 0 } else { index + 1 };
            *edge = Edge::new(simd, wide(corners[index]), wide(corners[next]), positions);
        }
        self.edge_count = edge_count;
        self.bounds = bounds;
        true
    }

    /// Sets the interpolated values. Returns false if the primitive has no area.
    #[inline(always)]
    fn set_planes<S: Simd>(&mut self, simd: S, primitive: &Primitive, needs: Needs) -> bool {
        let [w0, w1, w2] = three(primitive.corners, |corner| both(corner, i64::from));
        let area = (w1[0] - w0[0]) * (w2[1] - w0[1]) - (w1[1] - w0[1]) * (w2[0] - w0[0]);
        if area <= 0 {
            return false;
        }
        let numerators = [[w2[1] - w0[1], w0[0] - w2[0]], [w0[1] - w1[1], w1[0] - w0[0]]];
        let correction =
            SnapCorrection::new(numerators, area, primitive.offsets).unwrap_or_else(|| SnapCorrection::nowhere(area));
        let inverse_area = 1.0 / correction.area;
        let sums = both([0, 1], |corner: usize| {
            let ([a, b], [c, d]) = (numerators[corner], correction.numerators[corner]);
            [a as f64 + c, b as f64 + d]
        });
        let slopes = both(sums, |n| both(n, |n| n * ONE as f64 * inverse_area));
        let depth = three(primitive.depth, f64::from);
        let (d1, d2) = (depth[1] - depth[0], depth[2] - depth[0]);
        let along = |axis: usize| (d1 * slopes[0][axis] + d2 * slopes[1][axis]) as f32;
        let depth_slopes = [along(0), along(1)];
        let [iw0, iw1, iw2] = primitive.inverse_w;
        let is_constant = iw0 == iw1 && iw0 == iw2;
        let scale = if is_constant { iw0 } else { 1.0 };
        let weights = if is_constant { [1.0; 3] } else { [iw0, iw1, iw2] };
        let affine = is_constant && needs.detects_affine;
        let inverse_w = three(weights, f64::from);
        let (d1, d2) = (inverse_w[1] - inverse_w[0], inverse_w[2] - inverse_w[0]);
        let along = |axis: usize| (d1 * slopes[0][axis] + d2 * slopes[1][axis]) as f32;
        let w_slopes = [along(0), along(1)];
        let slopes = both(slopes, |slope| both(slope, |slope| slope as f32));
        let lanes = |[dx, dy]: [f32; 2]| lane_offsets(simd, dx, dy);
        self.origin = w0;
        self.numerators = numerators;
        self.correction = correction;
        self.inverse_area = inverse_area;
        if needs.barycentrics {
            self.lane_barycentrics = [lanes(slopes[0]), lanes(slopes[1])];
        }
        self.slopes = slopes;
        self.depth = depth;
        if needs.depth {
            self.lane_depth = lanes(depth_slopes);
        }
        self.depth_slopes = depth_slopes;
        self.inverse_w = inverse_w;
        if needs.inverse_w && !affine {
            self.lane_w = lanes(w_slopes);
        }
        self.w_slopes = w_slopes;
        self.weights = [weights[1], weights[2]];
        self.affine = affine;
        self.scale = scale;
        true
    }

    /// The edge functions of the primitive.
    #[inline(always)]
    pub fn edges(&self) -> &[Edge] {
        &self.edges[..self.edge_count]
    }

    /// The barycentrics of corners 1 and 2 at the centre of pixel (x, y).
    #[inline(always)]
    pub fn barycentrics(&self, x: i32, y: i32) -> [f64; 2] {
        let dx = i64::from(x) * ONE + ONE / 2 - self.origin[0];
        let dy = i64::from(y) * ONE + ONE / 2 - self.origin[1];
        // The large part of the sum is exact.
        let numerator = |corner: usize| {
            let ([a, b], [c, d]) = (self.numerators[corner], self.correction.numerators[corner]);
            let small = c * dx as f64 + d * dy as f64 + self.correction.at_origin[corner];
            ((a * dx + b * dy) as f64 + small) * self.inverse_area
        };
        [numerator(0), numerator(1)]
    }

    /// The depth at these barycentrics.
    #[inline(always)]
    pub fn depth(&self, [b1, b2]: [f64; 2]) -> f32 {
        let [z0, z1, z2] = self.depth;
        (z0 + b1 * (z1 - z0) + b2 * (z2 - z0)) as f32
    }

    /// The least and the greatest depth at its samples in the tile at pixel (x, y), with a margin for rounding.
    #[inline(always)]
    pub fn depth_bounds(&self, x: i32, y: i32) -> [f32; 2] {
        let half = crate::raster::tile::SIDE as i32 / 2;
        let middle = self.depth(self.barycentrics(x + half, y + half));
        let [dx, dy] = both(self.depth_slopes, f32::abs);
        // Samples are at most 8.5 pixels from the centre of the pixel next to the tile's middle.
        let reach = 8.6 * (dx + dy);
        let margin = 1e-5 * (middle.abs() + reach) + f32::MIN_POSITIVE;
        [middle - reach - margin, middle + reach + margin]
    }

    /// The value of 1 / w at these barycentrics, in units of [`TriangleSetup::scale`].
    #[inline(always)]
    pub fn inverse_w(&self, [b1, b2]: [f64; 2]) -> f32 {
        let [w0, w1, w2] = self.inverse_w;
        (w0 + b1 * (w1 - w0) + b2 * (w2 - w0)) as f32
    }
}

/// The columns of lanes as floats; `FLOAT_Y` has the rows.
const FLOAT_X: [f32; 16] = as_floats(LANE_X);
const FLOAT_Y: [f32; 16] = as_floats(LANE_Y);

const fn as_floats(of: [i32; 16]) -> [f32; 16] {
    let mut out = [0.0; 16];
    let mut lane = 0;
    while lane < 16 {
        out[lane] = of[lane] as f32;
        lane += 1;
    }
    out
}

/// The values of `dx x + dy y` for the lanes of a block.
#[inline(always)]
fn lane_offsets<S: Simd>(simd: S, dx: f32, dy: f32) -> [f32; 16] {
    let x = f32x16::simd_from(simd, FLOAT_X);
    let y = f32x16::simd_from(simd, FLOAT_Y);
    (x * dx + y * dy).into()
}

impl Edge {
    /// The edge from `p` to `q`, both in 1/256 pixels. The polygon is to the right of it (clockwise, y down).
    #[inline(always)]
    fn new<S: Simd>(simd: S, p: [i64; 2], q: [i64; 2], positions: &[[i32; 2]]) -> Self {
        let [dx, dy] = [q[0] - p[0], q[1] - p[1]];
        let (a, b) = (-dy, dx);
        // Samples on an edge belong to the polygon if it is a left or a top edge.
        let inclusive = dy < 0 || dy == 0 && dx > 0;
        let constant = -(a * p[0] + b * p[1]) - i64::from(!inclusive);
        let mut c = [0; 4];
        for (c, &[x, y]) in c.iter_mut().zip(positions) {
            *c = (constant + a * i64::from(x) + b * i64::from(y)) >> 8;
        }
        let x = i32x16::simd_from(simd, LANE_X) * a as i32;
        let y = i32x16::simd_from(simd, LANE_Y) * b as i32;
        Self { a, b, c, lanes: (x + y).into() }
    }
}

/// The interpolated values that fragments need.
#[derive(Clone, Copy, Debug, Default)]
pub struct Needs {
    pub barycentrics: bool,
    /// True if depth is needed after the early tests.
    pub depth: bool,
    /// True if 1 / w is needed.
    pub inverse_w: bool,
    /// True if set-up tests whether 1 / w is the same at all corners, so that it need not be interpolated.
    pub detects_affine: bool,
}
