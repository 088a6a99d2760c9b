//! The fixed-function tessellator: divides the domain of a patch (Vulkan 1.3, "Tessellation").
//!
//! Coordinates are multiples of 2^-24, so that 1 - x is exact: the points of an edge are symmetric about its middle,
//! the coordinates in a triangle add up to 1, and equal levels give equal points on all edges.

#[cfg(test)]
mod tests;

use devmem::host;

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
    /// True if triangles are clockwise where u points right and v down.
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

/// The subdivision of an edge.
struct Edge {
    /// The positions of its points, ascending from 0 to 1.
    positions: Vec<f64>,
}

/// A row of points and their positions along an edge.
struct Row<'a> {
    points: &'a [u32],
    positions: &'a [f64],
}

/// A level just above 1, which a level of 1 becomes where it can't be kept. It is so near that an inner triangle of odd
/// spacing has the corners of the domain.
const ABOVE_ONE: f64 = 1.0 + 1.0 / (1u64 << 30) as f64;

/// Rounds a coordinate to a multiple of 2^-24.
fn round(coordinate: f64) -> f64 {
    const UNITS: f64 = (1 << 24) as f64;
    (coordinate * UNITS).round() / UNITS
}

impl Spacing {
    /// The level, limited to the spacing's range.
    fn clamp(self, level: f32) -> f64 {
        let level = f64::from(level);
        let most = f64::from(MAX_LEVEL);
        match self {
            // NaN becomes the least level.
            Self::Equal => level.max(1.0).min(most),
            Self::FractionalEven => level.max(2.0).min(most),
            Self::FractionalOdd => level.max(1.0).min(most - 1.0),
        }
    }

    /// The number of segments that a clamped level gives.
    fn segments(self, level: f64) -> usize {
        let up = level.ceil() as usize;
        match self {
            Self::Equal => up,
            Self::FractionalEven => up + up % 2,
            Self::FractionalOdd => up + (up + 1) % 2,
        }
    }

    /// Divides an edge by a clamped level. With fractional spacing, all but two segments have the length 1 / level, and
    /// these two, at the same distance from the ends, have what is left.
    fn divide(self, level: f64) -> Edge {
        let segments = self.segments(level);
        let level = match self {
            Self::Equal => segments as f64,
            Self::FractionalEven | Self::FractionalOdd => level,
        };
        let short = (1.0 - (segments as f64 - 2.0) / level) / 2.0;
        let before_short = (segments - 1) / 4;
        let mut positions = vec![0.0; segments + 1];
        for number in 0..=segments / 2 {
            let position = if number <= before_short {
                number as f64 / level
            } else {
                (number as f64 - 1.0) / level + short
            };
            let position = round(position.min(0.5));
            positions[number] = position;
            positions[segments - number] = 1.0 - position;
        }
        if segments.is_multiple_of(2) {
            positions[segments / 2] = 0.5;
        }
        Edge { positions }
    }
}

impl Edge {
    fn segments(&self) -> usize {
        self.positions.len() - 1
    }

    /// The positions of the points between the first and last `cut`.
    fn inner(&self, cut: usize) -> &[f64] {
        &self.positions[cut..=self.segments() - cut]
    }
}

impl TessellatedPatch {
    fn push(&mut self, point: [f64; 3]) -> u32 {
        let number = self.points.len() as u32;
        host::push(&mut self.points, point.map(|coordinate| coordinate as f32));
        number
    }

    /// Adds a triangle that is clockwise where u points right and v down.
    fn triangle(&mut self, corners: [u32; 3]) {
        self.indices.extend(corners);
    }

    /// Fills the strip between an outer row and an inner one, which is to its left.
    fn stitch(&mut self, outer: &Row<'_>, inner: &Row<'_>) {
        let (mut i, mut j) = (0, 0);
        let (last, inner_last) = (outer.points.len() - 1, inner.points.len() - 1);
        while i < last || j < inner_last {
            let middle = |row: &Row<'_>, at: usize| row.positions[at] + row.positions[at + 1];
            let advances_outer =
                j == inner_last || (i < last && middle(outer, i) <= middle(inner, j));
            if advances_outer {
                self.triangle([outer.points[i], outer.points[i + 1], inner.points[j]]);
                i += 1;
            } else {
                self.triangle([outer.points[i], inner.points[j + 1], inner.points[j]]);
                j += 1;
            }
        }
    }
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

    /// Divides a patch. It has no primitives if one of its outer levels isn't positive.
    pub fn tessellate(&self, outer: [f32; 4], inner: [f32; 2], out: &mut TessellatedPatch) {
        out.points.clear();
        out.indices.clear();
        let edges = match self.domain {
            Domain::Triangles => 3,
            Domain::Quads => 4,
            Domain::Isolines => 2,
        };
        // NaN isn't positive.
        if !outer[..edges].iter().all(|level| *level > 0.0) {
            return;
        }
        match self.domain {
            Domain::Triangles => self.triangles(outer, inner, out),
            Domain::Quads => self.quads(outer, inner, out),
            Domain::Isolines => self.isolines(outer, out),
        }
        if self.point_mode {
            out.indices.clear();
            out.indices.extend(0..out.points.len() as u32);
        } else if !self.clockwise && self.corners() == 3 {
            for triangle in out.indices.as_chunks_mut::<3>().0 {
                triangle.swap(1, 2);
            }
        }
    }

    /// The levels of the inside. A level of 1 is raised if any edge or direction has more segments.
    fn inner_levels<const N: usize>(&self, outer: &[f32], inner: [f32; N]) -> [f64; N] {
        let levels = inner.map(|level| self.spacing.clamp(level));
        let is_one = |level: f64| self.spacing.segments(level) == 1;
        let outer_ones = outer.iter().all(|level| is_one(self.spacing.clamp(*level)));
        if outer_ones && levels.iter().all(|level| is_one(*level)) {
            return levels;
        }
        levels.map(|level| if is_one(level) { ABOVE_ONE } else { level })
    }

    fn edge(&self, level: f32) -> Edge {
        self.spacing.divide(self.spacing.clamp(level))
    }

    /// Concentric triangles. The corners are where u, v and w are 1; walking from one to the next keeps the inside to
    /// the left.
    fn triangles(&self, outer: [f32; 4], inner: [f32; 2], out: &mut TessellatedPatch) {
        let [level] = self.inner_levels(&outer[..3], [inner[0]]);
        let inside = self.spacing.divide(level);
        // The edge from a corner to the next is where the third coordinate is 0.
        let edges = [2, 0, 1].map(|third: usize| self.edge(outer[third]));
        let positions = edges.each_ref().map(|edge| &edge.positions[..]);
        let mut around = ring(out, positions, 0.0);
        let segments = inside.segments();
        if segments == 1 {
            out.triangle([around[0], around[1], around[2]]);
            return;
        }
        let mut positions = positions;
        for cut in 1..=segments / 2 {
            let within = inside.inner(cut);
            let next = ring(out, [within; 3], inside.positions[cut]);
            let mut first = 0;
            for (side, outer_positions) in positions.iter().enumerate() {
                let outer_row = side_of(&around, first, outer_positions.len());
                let inner_row = side_of(&next, side * (within.len() - 1), within.len());
                out.stitch(
                    &Row {
                        points: &outer_row,
                        positions: outer_positions,
                    },
                    &Row {
                        points: &inner_row,
                        positions: within,
                    },
                );
                first += outer_positions.len() - 1;
            }
            (around, positions) = (next, [within; 3]);
        }
        if around.len() == 3 {
            out.triangle([around[0], around[1], around[2]]);
        }
    }

    /// A grid inside, and a strip along each edge.
    fn quads(&self, outer: [f32; 4], inner: [f32; 2], out: &mut TessellatedPatch) {
        let levels = self.inner_levels(&outer, inner);
        let [across, up] = levels.map(|level| self.spacing.divide(level));
        // The edges v = 0, u = 1, v = 1, u = 0, each walked with the inside to the left.
        let edges = [1, 2, 3, 0].map(|number: usize| self.edge(outer[number]));
        let mut around = Vec::new();
        for (side, edge) in edges.iter().enumerate() {
            for &position in &edge.positions[..edge.segments()] {
                let [u, v] = match side {
                    0 => [position, 0.0],
                    1 => [1.0, position],
                    2 => [1.0 - position, 1.0],
                    _ => [0.0, 1.0 - position],
                };
                around.push(out.push([u, v, 0.0]));
            }
        }
        if across.segments() == 1 && up.segments() == 1 {
            out.triangle([around[0], around[1], around[2]]);
            out.triangle([around[0], around[2], around[3]]);
            return;
        }
        let (columns, rows) = (across.inner(1), up.inner(1));
        let first = out.points.len() as u32;
        for &v in rows {
            for &u in columns {
                out.push([u, v, 0.0]);
            }
        }
        let at = |column: usize, row: usize| first + (row * columns.len() + column) as u32;
        for row in 1..rows.len() {
            for column in 1..columns.len() {
                let corners = [
                    at(column - 1, row - 1),
                    at(column, row - 1),
                    at(column, row),
                    at(column - 1, row),
                ];
                // The diagonal points to the middle, so that the grid is as symmetric as rings.
                let is_left = 2 * column < columns.len();
                let is_low = 2 * row < rows.len();
                let first = usize::from(is_left != is_low);
                let corner = |number: usize| corners[(first + number) % 4];
                out.triangle([corner(0), corner(1), corner(2)]);
                out.triangle([corner(0), corner(2), corner(3)]);
            }
        }
        let (right, top) = (columns.len() - 1, rows.len() - 1);
        let inner_rows: [Vec<u32>; 4] = [
            (0..=right).map(|column| at(column, 0)).collect(),
            (0..=top).map(|row| at(right, row)).collect(),
            (0..=right).rev().map(|column| at(column, top)).collect(),
            (0..=top).rev().map(|row| at(0, row)).collect(),
        ];
        let mut before = 0;
        for ((side, edge), inner_row) in edges.iter().enumerate().zip(&inner_rows) {
            let outer_row = side_of(&around, before, edge.positions.len());
            out.stitch(
                &Row {
                    points: &outer_row,
                    positions: &edge.positions,
                },
                &Row {
                    points: inner_row,
                    // Positions are symmetric, so that the direction makes no difference.
                    positions: if side.is_multiple_of(2) {
                        columns
                    } else {
                        rows
                    },
                },
            );
            before += edge.segments();
        }
    }

    /// Lines of equal v, from u = 0 to 1. Their distances are equal, whatever the spacing is.
    fn isolines(&self, outer: [f32; 4], out: &mut TessellatedPatch) {
        let lines = Spacing::Equal.divide(Spacing::Equal.clamp(outer[0]));
        let edge = self.edge(outer[1]);
        for &v in &lines.positions[..lines.segments()] {
            let first = out.points.len() as u32;
            for &u in &edge.positions {
                out.push([u, v, 0.0]);
            }
            for number in 0..edge.segments() as u32 {
                out.indices.extend([first + number, first + number + 1]);
            }
        }
    }
}

/// Adds a triangle of points: those of its sides, given by their positions on the edges of the domain. `distance` is the
/// position of its first points on both edges at a corner. Returns the points, walking around.
fn ring(out: &mut TessellatedPatch, sides: [&[f64]; 3], distance: f64) -> Vec<u32> {
    if sides[0].len() == 1 {
        let third = round(1.0 / 3.0);
        return vec![out.push([third, third, 1.0 - 2.0 * third])];
    }
    let mut points = Vec::new();
    let height = round(2.0 * distance / 3.0);
    for (side, positions) in sides.iter().enumerate() {
        for &position in &positions[..positions.len() - 1] {
            // The lesser of both coordinates is rounded, so that the points of a side are symmetric.
            let (lesser, greater_is_first) = (position.min(1.0 - position), position <= 0.5);
            let lesser = round(lesser - distance / 3.0);
            let greater = 1.0 - height - lesser;
            let mut point = [0.0; 3];
            let (from, to) = if greater_is_first {
                (greater, lesser)
            } else {
                (lesser, greater)
            };
            point[side] = from;
            point[(side + 1) % 3] = to;
            point[(side + 2) % 3] = height;
            points.push(out.push(point));
        }
    }
    points
}

/// The points of a side of a ring: `count`, which begin at `first` and may end at the ring's first point.
fn side_of(ring: &[u32], first: usize, count: usize) -> Vec<u32> {
    (first..first + count)
        .map(|place| ring[place % ring.len()])
        .collect()
}
