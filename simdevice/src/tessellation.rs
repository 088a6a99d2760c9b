//! The fixed-function tessellator: divides the domain of a patch into points, lines or triangles (Vulkan 1.3,
//! "Tessellation").
//!
//! Coordinates are multiples of 2^-24. Hence 1 - x and u + v + w = 1 are exact, and the points of an edge are symmetric
//! about its middle. The points of an edge depend on its level and the spacing alone, the primitives of the inside on
//! the inner levels alone, and those between an outer edge and the inside on the levels of both alone. This is the
//! invariance that Vulkan asks for.

#[cfg(test)]
mod tests;

use devmem::host;

/// The greatest level to which an edge is divided.
pub const MAX_LEVEL: u32 = 64;

/// The domain of a tessellated patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {
    /// A triangle with barycentric coordinates u, v and w. The outer levels are those of the edges where u, v and w are
    /// 0. The first inner level is that of the inside.
    Triangles,
    /// A square with coordinates u and v; w is 0. The outer levels are those of the edges where u is 0, v is 0, u is 1
    /// and v is 1. The inner levels are those of the inside along u and v.
    Quads,
    /// Lines along u, at different v; w is 0. The outer levels are the number of lines and that of their segments.
    Isolines,
}

/// The spacing of the points of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spacing {
    /// Equal segments, of which there are as many as the level, rounded up.
    Equal,
    /// An even number of segments. Two of them grow with the level.
    FractionalEven,
    /// An odd number of segments. Two of them grow with the level.
    FractionalOdd,
}

/// The way in which patches are divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tessellation {
    /// The domain.
    pub domain: Domain,
    /// The spacing. The distances of isolines are equal with any spacing.
    pub spacing: Spacing,
    /// True if triangles are clockwise, with u to the right and v down: Vulkan's `VertexOrderCw` in a domain whose
    /// origin is its upper left corner. They are clockwise if (b - a) × (c - a) is positive in (u, v). An origin in the
    /// lower left corner inverts this.
    pub clockwise: bool,
    /// True if the points become primitives, each once.
    pub point_mode: bool,
}

/// A divided patch.
#[derive(Debug, Default)]
pub struct TessellatedPatch {
    /// The coordinates u, v and w of the points.
    pub points: Vec<[f32; 3]>,
    /// The points of the primitives, [`corners`](Tessellation::corners) each.
    pub indices: Vec<u32>,
}

/// The coordinate 1. Coordinates are integers, in units of 2^-24.
const ONE: u32 = 1 << 24;

/// The coordinate 1/2.
const HALF: u32 = ONE / 2;

/// The least difference of a fractional level from the next lower one with fewer segments. It keeps segments longer
/// than 2^-15, so that rounding makes no points equal.
const LEAST_FRACTION: f64 = 1.0 / 256.0;

impl Tessellation {
    /// The number of points of a primitive.
    pub fn corners(&self) -> usize {
        match self.domain {
            _ if self.point_mode => 1,
            Domain::Isolines => 2,
            Domain::Triangles | Domain::Quads => 3,
        }
    }

    /// Divides a patch with outer and inner levels, of which it uses those of its domain. `patch` becomes empty if one of
    /// the outer levels is not positive.
    pub fn tessellate(&self, outer: [f32; 4], inner: [f32; 2], patch: &mut TessellatedPatch) {
        patch.points.clear();
        patch.indices.clear();
        let levels = match self.domain {
            Domain::Triangles => &outer[..3],
            Domain::Quads => &outer[..],
            Domain::Isolines => &outer[..2],
        };
        // NaN is not positive.
        if !levels.iter().all(|&level| level > 0.0) {
            return;
        }
        match self.domain {
            // Edges are walked clockwise with v down: from (1, 0) to (0, 1) in a triangle, from (0, 0) to (1, 0) in a
            // square.
            Domain::Triangles => self.triangles([outer[2], outer[0], outer[1]], inner[0], patch),
            Domain::Quads => self.quads([outer[1], outer[2], outer[3], outer[0]], inner, patch),
            Domain::Isolines => self.isolines(outer[0], outer[1], patch),
        }
        if self.point_mode {
            patch.indices.clear();
            host::reserve(&mut patch.indices, patch.points.len());
            patch.indices.extend(0..patch.points.len() as u32);
        } else if self.corners() == 3 && !self.clockwise {
            for triangle in patch.indices.chunks_exact_mut(3) {
                triangle.swap(1, 2);
            }
        }
    }

    /// Divides a triangle into concentric ones, of which each has two segments per edge less than the one around it.
    fn triangles(&self, outer: [f32; 3], inner: f32, patch: &mut TessellatedPatch) {
        let (edges, [inside]) = self.edges(outer, [inner]);
        let mut around = triangle_ring(patch, edges.each_ref().map(Edge::positions), 0);
        for ring in 1..=inside.segments / 2 {
            let within = triangle_ring(patch, [inside.ring(ring); 3], inside.at[ring]);
            for (outer, inner) in around.iter().zip(&within) {
                patch.stitch(outer, inner);
            }
            around = within;
        }
        if !inside.segments.is_multiple_of(2) {
            patch.triangle(around.map(|side| side.first));
        }
    }

    /// Divides a square into a grid and a strip along each edge.
    fn quads(&self, outer: [f32; 4], inner: [f32; 2], patch: &mut TessellatedPatch) {
        let (edges, [along_u, along_v]) = self.edges(outer, inner);
        let around = square_ring(patch, edges.each_ref().map(Edge::positions));
        if along_u.segments == 1 {
            let [a, b, c, d] = around.map(|side| side.first);
            patch.triangle([a, b, c]);
            patch.triangle([a, c, d]);
            return;
        }
        let (columns, rows) = (along_u.ring(1), along_v.ring(1));
        let first = patch.points.len() as u32;
        for &v in rows {
            patch.points(columns.iter().map(|&u| [u, v, 0]));
        }
        let width = columns.len() as u32;
        let (right, top) = (width - 1, (rows.len() as u32 - 1) * width);
        for (row, start) in (first..first + top).step_by(columns.len()).enumerate() {
            let is_low = 2 * row + 2 < rows.len();
            patch.primitives((start..start + right).map(|a| {
                let [b, c, d] = [a + 1, a + 1 + width, a + width];
                // Diagonals point to the middle, so that the grid looks like rings.
                let is_left = 2 * (a - start) + 2 < width;
                if is_left == is_low { [a, b, c, a, c, d] } else { [b, c, d, b, d, a] }
            }));
        }
        let step = width as i32;
        let within = [
            Row::of_grid(columns, first, 1),
            Row::of_grid(rows, first + right, step),
            Row::of_grid(columns, first + top + right, -1),
            Row::of_grid(rows, first + top, -step),
        ];
        for (outer, inner) in around.iter().zip(&within) {
            patch.stitch(outer, inner);
        }
    }

    /// Makes lines. None is at v = 1.
    fn isolines(&self, lines: f32, segments: f32, patch: &mut TessellatedPatch) {
        let (lines, line) = (Spacing::Equal.divide(lines), self.spacing.divide(segments));
        for &v in &lines.positions()[..lines.segments] {
            let first = patch.points.len() as u32;
            patch.points(line.positions().iter().map(|&u| [u, v, 0]));
            patch.primitives((first..first + line.segments as u32).map(|point| [point, point + 1]));
        }
    }

    /// Divides outer edges, and those of the inside. An inner edge remains undivided only if all others are, too.
    fn edges<const OUTER: usize, const INNER: usize>(
        &self,
        outer: [f32; OUTER],
        inner: [f32; INNER],
    ) -> ([Edge; OUTER], [Edge; INNER]) {
        let outer = outer.map(|level| self.spacing.divide(level));
        let mut inner = inner.map(|level| self.spacing.divide(level));
        if outer.iter().chain(&inner).any(|edge| edge.segments > 1) {
            for edge in inner.iter_mut().filter(|edge| edge.segments == 1) {
                *edge = self.spacing.divide_just_above_one();
            }
        }
        (outer, inner)
    }
}

impl Spacing {
    /// Divides an edge. NaN is the least level.
    fn divide(self, level: f32) -> Edge {
        let most = MAX_LEVEL as f32;
        let (least, most) = match self {
            Self::Equal => (1.0, most),
            Self::FractionalEven => (2.0, most),
            Self::FractionalOdd => (1.0, most - 1.0),
        };
        let level = f64::from(level.max(least).min(most));
        let segments = match self {
            Self::Equal => level.ceil(),
            Self::FractionalEven => 2.0 * (level / 2.0).ceil(),
            Self::FractionalOdd => 2.0 * ((level - 1.0) / 2.0).ceil() + 1.0,
        };
        let level = match self {
            Self::Equal => segments,
            Self::FractionalEven | Self::FractionalOdd => level.max(segments - 2.0 + LEAST_FRACTION),
        };
        let length = 1.0 / level;
        let short = (level + 2.0 - segments) / 2.0 * length;
        let segments = segments as usize;
        let short_at = short_segment(segments);
        let mut edge = Edge { at: [0; MAX_LEVEL as usize + 1], segments };
        for number in 0..segments.div_ceil(2) {
            let position =
                if number <= short_at { number as f64 * length } else { (number - 1) as f64 * length + short };
            edge.at[number] = (position * f64::from(ONE)).round() as u32;
            edge.at[segments - number] = ONE - edge.at[number];
        }
        if segments.is_multiple_of(2) {
            edge.at[segments / 2] = HALF;
        }
        edge
    }

    /// Divides an inner edge of level 1 beside other edges that are divided. Its level is the limit of those above 1:
    /// the short segments of odd spacing have the length 0, so that the inside fills the domain, whatever the outer
    /// levels are.
    fn divide_just_above_one(self) -> Edge {
        match self {
            Self::FractionalOdd => {
                let mut edge = self.divide(3.0);
                (edge.at[1], edge.at[2]) = (0, ONE);
                edge
            }
            Self::Equal | Self::FractionalEven => self.divide(2.0),
        }
    }
}

/// The place of the first of the two short segments, which is Direct3D 11's: new segments appear at every second place,
/// from the ends to the middle, and begin again at the ends when their number has doubled. The other short segment is as
/// far from the other end.
fn short_segment(segments: usize) -> usize {
    let pairs = segments.saturating_sub(2) / 2;
    match pairs.checked_ilog2() {
        None => 0,
        Some(round) => 2 * (pairs - (1 << round)) + 1,
    }
}

/// A divided edge.
struct Edge {
    /// The positions of the points, ascending from 0 to [`ONE`]; further items are unused.
    at: [u32; MAX_LEVEL as usize + 1],
    segments: usize,
}

impl Edge {
    /// The positions of all points.
    fn positions(&self) -> &[u32] {
        self.ring(0)
    }

    /// The positions of the points without those that are nearer to the ends than number `ring`.
    fn ring(&self, ring: usize) -> &[u32] {
        &self.at[ring..=self.segments - ring]
    }
}

/// A row of points along an edge.
struct Row<'a> {
    /// The positions of the points.
    positions: &'a [u32],
    /// The first point.
    first: u32,
    /// The difference of consecutive points, apart from the last one.
    step: i32,
    /// The last point.
    last: u32,
}

impl<'a> Row<'a> {
    /// The row of a grid's points that begins at `first`.
    fn of_grid(positions: &'a [u32], first: u32, step: i32) -> Self {
        Self { positions, first, step, last: first.wrapping_add_signed(step * (positions.len() as i32 - 1)) }
    }

    fn segments(&self) -> usize {
        self.positions.len() - 1
    }

    fn point(&self, number: usize) -> u32 {
        if number == self.segments() { self.last } else { self.first.wrapping_add_signed(self.step * number as i32) }
    }

    /// Twice the position of the middle of a segment.
    fn middle(&self, segment: usize) -> u32 {
        self.positions[segment] + self.positions[segment + 1]
    }
}

/// Adds the points of a closed ring, of which `point` gives the one at a position of a side. A side ends where the next
/// one begins.
fn ring<'a, const SIDES: usize>(
    patch: &mut TessellatedPatch,
    sides: [&'a [u32]; SIDES],
    point: impl Fn(usize, u32) -> [u32; 3],
) -> [Row<'a>; SIDES] {
    let ring = patch.points.len() as u32;
    let mut side = 0;
    sides.map(|positions| {
        let first = patch.points.len() as u32;
        let before_last = &positions[..positions.len() - 1];
        patch.points(before_last.iter().map(|&it| point(side, it)));
        side += 1;
        let last = if side == SIDES { ring } else { patch.points.len() as u32 };
        Row { positions, first, step: 1, last }
    })
}

/// Adds the points of a square: the whole domain's edges.
fn square_ring<'a>(patch: &mut TessellatedPatch, sides: [&'a [u32]; 4]) -> [Row<'a>; 4] {
    ring(patch, sides, |side, position| match side {
        0 => [position, 0, 0],
        1 => [ONE, position, 0],
        2 => [ONE - position, ONE, 0],
        _ => [0, ONE - position, 0],
    })
}

/// Adds the points of one of the concentric triangles. They are where perpendiculars to the domain's edges, at given
/// positions, meet the triangle. `corner` is the position on both edges at a corner whose perpendiculars meet in the
/// triangle's corner.
fn triangle_ring<'a>(patch: &mut TessellatedPatch, sides: [&'a [u32]; 3], corner: u32) -> [Row<'a>; 3] {
    if corner == HALF {
        let third = ONE / 3;
        patch.points([[third, third, ONE - 2 * third]].into_iter());
        return sides.map(|positions| Row::of_grid(positions, patch.points.len() as u32 - 1, 1));
    }
    // The distance from the edge of a side is two thirds of the position. It is even, so that the middle of a side is
    // exact.
    let distance = 2 * ((corner + 1) / 3);
    // The lesser of the other two coordinates is rounded, so that sides are symmetric.
    let lesser = |position: u32| position + distance - corner;
    ring(patch, sides, |side, position| {
        let (to, from) = if position < HALF {
            let to = lesser(position);
            (to, ONE - distance - to)
        } else if position == HALF {
            ((ONE - distance) / 2, (ONE - distance) / 2)
        } else {
            let from = lesser(ONE - position);
            (ONE - distance - from, from)
        };
        match side {
            0 => [from, to, distance],
            1 => [distance, from, to],
            _ => [to, distance, from],
        }
    })
}

impl TessellatedPatch {
    fn points(&mut self, coordinates: impl ExactSizeIterator<Item = [u32; 3]>) {
        host::reserve(&mut self.points, coordinates.len());
        let points = coordinates.map(|point| point.map(|it| it as f32 / ONE as f32));
        self.points.extend(points);
    }

    /// Adds primitives of `N` points, or pairs of them.
    fn primitives<const N: usize>(&mut self, all: impl ExactSizeIterator<Item = [u32; N]>) {
        let before = self.indices.len();
        host::resize(&mut self.indices, before + N * all.len(), 0);
        for (place, indices) in self.indices[before..].chunks_exact_mut(N).zip(all) {
            place.copy_from_slice(&indices);
        }
    }

    fn triangle(&mut self, corners: [u32; 3]) {
        host::extend(&mut self.indices, &corners);
    }

    /// Fills the strip between an outer row and the inner one beside it. Triangles alternate by the positions of their
    /// sides.
    fn stitch(&mut self, outer: &Row<'_>, inner: &Row<'_>) {
        let (mut i, mut j) = (0, 0);
        let (mut a, mut b) = (outer.first, inner.first);
        self.primitives((0..outer.segments() + inner.segments()).map(|_| {
            let advances_outer = if i < outer.segments() && j < inner.segments() {
                outer.middle(i) <= inner.middle(j)
            } else {
                i < outer.segments()
            };
            if advances_outer {
                i += 1;
                let before = std::mem::replace(&mut a, outer.point(i));
                [before, a, b]
            } else {
                j += 1;
                let before = std::mem::replace(&mut b, inner.point(j));
                [a, b, before]
            }
        }));
    }
}
