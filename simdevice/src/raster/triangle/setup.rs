//! A primitive made ready for tiles: its edges as exact integers, and what varies over it as planes.

use crate::geometry::{Primitive, PrimitiveKind};
use crate::raster::tile::{LANE_X, LANE_Y};
use crate::simd::{both, three};
use crate::state::Rect;
use fearless_simd::{Simd, f32x16, i32x16, prelude::*};

/// Primitives reach at most this far from the framebuffer's corner, in 1/256 pixels, so that edge functions fit 64 bits;
/// others are not drawn.
pub const MAX_COORDINATE: i32 = 1 << 29;

/// Sub-pixel positions of a pixel.
const ONE: i64 = 256;

/// Units of [`Primitive::offsets`] in 1/256 pixel.
const OFFSETS_IN_SUB_PIXEL: f64 = 65_536.0;

/// An edge: a sample of pixel (x, y) is inside if `a x + b y + c[sample] >= 0`. Dividing the edge function of 1/256
/// pixels by 256 and rounding down changes no sign, since `a x + b y` is an integer.
#[derive(Clone, Copy, Debug, Default)]
pub struct Edge {
    pub a: i64,
    pub b: i64,
    pub c: [i64; 4],
    /// `a x + b y` of the lanes of a block, if they fit.
    pub lanes: [i32; 16],
}

/// What of a primitive does not depend on tiles.
#[derive(Clone, Debug, Default)]
pub struct TriangleSetup {
    edges: [Edge; 4],
    edge_count: usize,
    /// The pixels that may have samples in it.
    pub bounds: Rect,
    origin: [i64; 2],
    /// How the barycentrics' numerators of corners 1 and 2 grow with x and y, per 1/256 pixel, were the vertices at the
    /// corners.
    numerators: [[i64; 2]; 2],
    correction: SnapCorrection,
    inverse_area: f64,
    /// What the barycentrics add at each lane of a block.
    pub lane_barycentrics: [[f32; 16]; 2],
    /// The barycentrics' derivatives by x and y in pixels.
    pub slopes: [[f32; 2]; 2],
    depth: [f64; 3],
    /// What depth adds at each lane of a block.
    pub lane_depth: [f32; 16],
    /// Depth's derivatives.
    pub depth_slopes: [f32; 2],
    inverse_w: [f64; 3],
    /// What 1 / w adds at each lane of a block.
    pub lane_w: [f32; 16],
    /// The derivatives of 1 / w.
    pub w_slopes: [f32; 2],
    /// 1 / w at corners 1 and 2, in units of `scale`.
    pub weights: [f32; 2],
    /// Whether 1 / w is the same at all corners.
    pub affine: bool,
    /// What 1 / w is in units of: its value if it is the same at all corners, so that nothing is lost.
    pub scale: f32,
}

/// What barycentrics owe to the vertices not being at the corners, but where they were before snapping.
#[derive(Clone, Copy, Debug, Default)]
struct SnapCorrection {
    /// To be added to [`TriangleSetup::numerators`].
    numerators: [[f64; 2]; 2],
    /// The barycentrics' numerators at corner 0.
    at_origin: [f64; 2],
    /// Twice the area of the triangle of the vertices.
    area: f64,
}

impl SnapCorrection {
    /// Of vertices that are at the corners, which enclose half of `area`.
    fn nowhere(area: i64) -> Self {
        Self {
            area: area as f64,
            ..Self::default()
        }
    }

    /// `None` for needles that snapping has turned over or made much wider, whose samples may lie far outside of what
    /// they were.
    #[inline(always)]
    fn new(numerators: [[i64; 2]; 2], area: i64, offsets: [[i16; 2]; 3]) -> Option<Self> {
        let [o0, o1, o2] = three(offsets, |offset| {
            both(offset, |offset| f64::from(offset) / OFFSETS_IN_SUB_PIXEL)
        });
        let by = [
            [o2[1] - o0[1], o0[0] - o2[0]],
            [o0[1] - o1[1], o1[0] - o0[0]],
        ];
        let [[a1, b1], [a2, b2]] = both(numerators, |n| both(n, |n| n as f64));
        let [[c1, d1], [c2, d2]] = by;
        // The large part is exact.
        let larger = a1 * d2 + c1 * (b2 + d2) - b1 * c2 - d1 * (a2 + c2);
        let snapped = area as f64;
        (snapped + larger >= 0.25 * snapped).then(|| Self {
            numerators: by,
            at_origin: [
                -(a1 + c1) * o0[0] - (b1 + d1) * o0[1],
                -(a2 + c2) * o0[0] - (b2 + d2) * o0[1],
            ],
            area: snapped + larger,
        })
    }
}

/// Pixels that may have samples between two coordinates of 1/256 pixels, as `first..end`.
fn pixels(low: i32, high: i32, samples: usize) -> (i32, i32) {
    if samples == 1 {
        ((low + 127) >> 8, ((high - 128) >> 8) + 1)
    } else {
        (low >> 8, (high >> 8) + 1)
    }
}

impl TriangleSetup {
    /// Becomes that of a primitive; returns false, and is undefined, if none of its samples lies in `clip`. What lanes
    /// add is found only as far as it is needed.
    #[inline(always)]
    pub fn prepare<S: Simd>(
        &mut self,
        simd: S,
        primitive: &Primitive,
        positions: &[[i32; 2]],
        clip: Rect,
        needs: Needs,
    ) -> bool {
        let [p0, p1, p2] = primitive.corners;
        let parallelogram = primitive.kind != PrimitiveKind::Triangle;
        let mut corners = [p0, p1, p2, p2];
        let edge_count = if parallelogram { 4 } else { 3 };
        if parallelogram {
            corners[3] = both([0, 1], |axis| {
                p0[axis].saturating_add(p2[axis]).saturating_sub(p1[axis])
            });
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
        let (columns, rows) = (
            pixels(left, right, positions.len()),
            pixels(top, bottom, positions.len()),
        );
        let span = |(first, end): (i32, i32)| (end - first).max(0) as u32;
        let bounds = clip.intersect(Rect {
            x: columns.0,
            y: rows.0,
            width: span(columns),
            height: span(rows),
        });
        if bounds.is_empty() {
            return false;
        }
        let wide = |p: [i32; 2]| both(p, i64::from);
        let (w0, w1, w2) = (wide(p0), wide(p1), wide(p2));
        let area = (w1[0] - w0[0]) * (w2[1] - w0[1]) - (w1[1] - w0[1]) * (w2[0] - w0[0]);
        if area <= 0 {
            return false;
        }
        for (index, edge) in self.edges.iter_mut().enumerate().take(edge_count) {
            let next = if index + 1 == edge_count {
                0
            } else {
                index + 1
            };
            *edge = Edge::new(simd, wide(corners[index]), wide(corners[next]), positions);
        }
        let numerators = [
            [w2[1] - w0[1], w0[0] - w2[0]],
            [w0[1] - w1[1], w1[0] - w0[0]],
        ];
        let correction = SnapCorrection::new(numerators, area, primitive.offsets)
            .unwrap_or_else(|| SnapCorrection::nowhere(area));
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
        let affine = iw0 == iw1 && iw0 == iw2;
        let scale = if affine { iw0 } else { 1.0 };
        let weights = if affine { [1.0; 3] } else { [iw0, iw1, iw2] };
        let inverse_w = three(weights, f64::from);
        let (d1, d2) = (inverse_w[1] - inverse_w[0], inverse_w[2] - inverse_w[0]);
        let along = |axis: usize| (d1 * slopes[0][axis] + d2 * slopes[1][axis]) as f32;
        let w_slopes = [along(0), along(1)];
        let slopes = both(slopes, |slope| both(slope, |slope| slope as f32));
        let lanes = |[dx, dy]: [f32; 2]| lane_offsets(simd, dx, dy);
        self.edge_count = edge_count;
        self.bounds = bounds;
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

    /// Its edges.
    #[inline(always)]
    pub fn edges(&self) -> &[Edge] {
        &self.edges[..self.edge_count]
    }

    /// The barycentrics of corners 1 and 2 at the centre of pixel (x, y).
    #[inline(always)]
    pub fn barycentrics(&self, x: i32, y: i32) -> [f64; 2] {
        let dx = i64::from(x) * ONE + ONE / 2 - self.origin[0];
        let dy = i64::from(y) * ONE + ONE / 2 - self.origin[1];
        // The large part is exact.
        let numerator = |corner: usize| {
            let ([a, b], [c, d]) = (self.numerators[corner], self.correction.numerators[corner]);
            let small = c * dx as f64 + d * dy as f64 + self.correction.at_origin[corner];
            ((a * dx + b * dy) as f64 + small) * self.inverse_area
        };
        [numerator(0), numerator(1)]
    }

    /// Depth where the barycentrics are these.
    #[inline(always)]
    pub fn depth(&self, [b1, b2]: [f64; 2]) -> f32 {
        let [z0, z1, z2] = self.depth;
        (z0 + b1 * (z1 - z0) + b2 * (z2 - z0)) as f32
    }

    /// Bounds of depth at its samples within the tile at pixel (x, y), rounding included.
    #[inline(always)]
    pub fn depth_bounds(&self, x: i32, y: i32) -> [f32; 2] {
        let half = crate::raster::tile::SIDE as i32 / 2;
        let middle = self.depth(self.barycentrics(x + half, y + half));
        let [dx, dy] = both(self.depth_slopes, f32::abs);
        // From the middle of the pixel beside the tile's middle, samples are at most 8.5 pixels away.
        let reach = 8.6 * (dx + dy);
        let margin = 1e-5 * (middle.abs() + reach) + f32::MIN_POSITIVE;
        [middle - reach - margin, middle + reach + margin]
    }

    /// 1 / w in units of [`TriangleSetup::scale`] where the barycentrics are these.
    #[inline(always)]
    pub fn inverse_w(&self, [b1, b2]: [f64; 2]) -> f32 {
        let [w0, w1, w2] = self.inverse_w;
        (w0 + b1 * (w1 - w0) + b2 * (w2 - w0)) as f32
    }
}

/// The columns and rows of lanes as floats.
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

/// `dx x + dy y` of the lanes of a block.
#[inline(always)]
fn lane_offsets<S: Simd>(simd: S, dx: f32, dy: f32) -> [f32; 16] {
    let x = f32x16::simd_from(simd, FLOAT_X);
    let y = f32x16::simd_from(simd, FLOAT_Y);
    (x * dx + y * dy).into()
}

impl Edge {
    /// The edge from `p` to `q`, both in 1/256 pixels; the polygon is to the right of it (clockwise, y down).
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
        Self {
            a,
            b,
            c,
            lanes: (x + y).into(),
        }
    }
}

/// What fragments need of their primitive's planes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Needs {
    pub barycentrics: bool,
    /// After the early tests.
    pub depth: bool,
    /// 1 / w.
    pub inverse_w: bool,
}
