//! Clipping in homogeneous coordinates. Where an edge of the primitive meets a plane is always computed from the edge's
//! corners, in a form that gives the same whichever comes first, so that polygons which share the edge agree on it bit
//! for bit; and from products that are exact, so that an edge whose corners are ever so far outside stays where it is.

use super::viewport::{LEAST_W, Transform};
use crate::limits::MAX_CLIP_CULL_DISTANCES;

/// A vertex while its polygon is clipped.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ClipVertex {
    /// In clip space.
    pub position: [f64; 4],
    /// How much of each of the primitive's corners it is, in clip space; they add up to 1.
    pub weights: [f64; 3],
    /// Whether the edge from here to the next vertex belongs to the primitive's outline.
    pub edge: bool,
}

/// The most vertices of a polygon: three corners, and one more for each plane.
pub(super) const MOST_VERTICES: usize = 3 + PLANES + MAX_CLIP_CULL_DISTANCES;

/// near, far, w, and four of the guard band.
const PLANES: usize = 7;

/// A convex polygon.
#[derive(Clone, Debug, Default)]
pub(super) struct Polygon {
    vertices: [ClipVertex; MOST_VERTICES],
    len: usize,
}

/// A plane to clip by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Plane {
    Near,
    Far,
    LeastW,
    Guard(usize),
    User(usize),
}

const FRUSTUM: [Plane; PLANES] = [
    Plane::Near,
    Plane::Far,
    Plane::LeastW,
    Plane::Guard(0),
    Plane::Guard(1),
    Plane::Guard(2),
    Plane::Guard(3),
];

/// A primitive's corners in clip space, as they were given: numbers of binary32.
type Corners = [[f64; 4]; 3];

/// What a primitive is clipped by.
pub(super) struct Clipper<'a> {
    pub transform: &'a Transform,
    /// The user clip distances of each corner.
    pub distances: [[f32; MAX_CLIP_CULL_DISTANCES]; 3],
    /// How many of them there are.
    pub distance_count: usize,
}

impl Clipper<'_> {
    fn planes(&self) -> impl Iterator<Item = Plane> {
        let depth = self.transform.clip_depth;
        let user = (0..self.distance_count).map(Plane::User);
        let frustum = FRUSTUM.into_iter();
        let frustum =
            frustum.filter(move |plane| depth || !matches!(plane, Plane::Near | Plane::Far));
        frustum.chain(user)
    }

    /// The normalized device coordinate of the near plane.
    fn near(&self) -> f64 {
        self.transform.near.into()
    }

    /// How far a vertex is inside a plane; negative outside.
    fn distance(&self, plane: Plane, vertex: &ClipVertex) -> f64 {
        let [_, _, z, w] = vertex.position;
        match plane {
            Plane::Near => z - self.near() * w,
            Plane::Far => w - z,
            Plane::LeastW => w - f64::from(LEAST_W),
            Plane::Guard(side) => {
                let [across, by_w] = self.transform.guard_plane(side);
                across * vertex.position[side / 2] + by_w * w
            }
            Plane::User(index) => {
                let part = |corner: usize| {
                    vertex.weights[corner] * f64::from(self.distances[corner][index])
                };
                part(0) + part(1) + part(2)
            }
        }
    }

    /// Where the edge between two vertices of which only one is inside the plane meets it.
    fn meet(&self, plane: Plane, corners: &Corners, a: &ClipVertex, b: &ClipVertex) -> ClipVertex {
        let of_primitive = (0..3).find(|&other| a.weights[other] == 0.0 && b.weights[other] == 0.0);
        let on_edge = of_primitive
            .map(|other| self.meet_edge(plane, corners, [(other + 1) % 3, (other + 2) % 3]));
        let is_finite = |it: &ClipVertex| it.position.into_iter().all(f64::is_finite);
        let mut new = on_edge.filter(is_finite).unwrap_or_else(|| {
            let (at_a, at_b) = (self.distance(plane, a), self.distance(plane, b));
            let t = at_a / (at_a - at_b);
            let between = |a: f64, b: f64| a + t * (b - a);
            ClipVertex {
                position: std::array::from_fn(|i| between(a.position[i], b.position[i])),
                weights: std::array::from_fn(|i| between(a.weights[i], b.weights[i])),
                edge: false,
            }
        });
        // What rounding may have moved off the plane.
        let position = &mut new.position;
        match plane {
            Plane::Near => position[2] = self.near() * position[3],
            Plane::Far => position[2] = position[3],
            Plane::LeastW => position[3] = LEAST_W.into(),
            Plane::Guard(side) => {
                let axis = side / 2;
                let [across, by_w] = self.transform.guard_plane(side);
                if across != 0.0 {
                    position[axis] = -by_w * position[3] / across;
                }
            }
            Plane::User(_) => {}
        }
        new
    }

    /// Where the edge between two corners p and q meets the plane: (p_i D(q) - q_i D(p)) / (D(q) - D(p)), with the
    /// distance D written out, since it has the corners' magnitude and would round away where between them the plane is.
    /// What is left are differences of products of two binary32 numbers, which are exact here.
    fn meet_edge(&self, plane: Plane, corners: &Corners, [p, q]: [usize; 2]) -> ClipVertex {
        let [at_p, at_q] =
            [p, q].map(|corner| self.distance(plane, &ClipVertex::at(corners, corner)));
        let both = at_q - at_p;
        let (a, b) = (&corners[p], &corners[q]);
        let crossed = |i: usize, j: usize| a[i] * b[j] - b[i] * a[j];
        let position = |i: usize| match plane {
            Plane::Near => crossed(i, 2) - self.near() * crossed(i, 3),
            Plane::Far => crossed(i, 3) - crossed(i, 2),
            Plane::LeastW => crossed(i, 3) - f64::from(LEAST_W) * (a[i] - b[i]),
            Plane::Guard(side) => {
                let [across, by_w] = self.transform.guard_plane(side);
                across * crossed(i, side / 2) + by_w * crossed(i, 3)
            }
            Plane::User(_) => a[i] * at_q - b[i] * at_p,
        };
        let mut weights = [0.0; 3];
        weights[p] = at_q / both;
        weights[q] = -at_p / both;
        ClipVertex {
            position: std::array::from_fn(|i| position(i) / both),
            weights,
            edge: false,
        }
    }

    /// Clips a triangle. Less than three vertices are left of one that is invisible.
    pub(super) fn triangle(&self, corners: [[f32; 4]; 3]) -> Polygon {
        let corners = corners.map(|position| position.map(f64::from));
        let mut polygon = Polygon::default();
        for corner in 0..3 {
            polygon.push(ClipVertex::at(&corners, corner));
        }
        for plane in self.planes() {
            polygon = self.cut(&polygon, &corners, plane);
            if polygon.len < 3 {
                break;
            }
        }
        polygon
    }

    fn cut(&self, polygon: &Polygon, corners: &Corners, plane: Plane) -> Polygon {
        let vertices = polygon.vertices();
        let distance = |vertex: &ClipVertex| self.distance(plane, vertex);
        let mut out = Polygon::default();
        let Some(first) = vertices.first() else {
            return out;
        };
        let first = (first, distance(first));
        let mut here = first;
        for place in 1..=vertices.len() {
            let next = match vertices.get(place) {
                Some(next) => (next, distance(next)),
                None => first,
            };
            if here.1 >= 0.0 {
                out.push(*here.0);
                if next.1 < 0.0 {
                    let mut new = self.meet(plane, corners, here.0, next.0);
                    // The volume's own planes leave no outline, as if nothing had been clipped.
                    new.edge = matches!(plane, Plane::User(_));
                    out.push(new);
                }
            } else if next.1 >= 0.0 {
                let mut new = self.meet(plane, corners, next.0, here.0);
                new.edge = here.0.edge;
                out.push(new);
            }
            here = next;
        }
        out
    }

    /// Clips a line; `None` if nothing is left of it.
    pub(super) fn line(&self, ends: [[f32; 4]; 2]) -> Option<[ClipVertex; 2]> {
        let [a, b] = ends.map(|position| position.map(f64::from));
        let corners = [a, b, [0.0; 4]];
        let mut line = [0, 1].map(|end| ClipVertex::at(&corners, end));
        for plane in self.planes() {
            let [a, b] = line;
            let (at_a, at_b) = (self.distance(plane, &a), self.distance(plane, &b));
            match (at_a >= 0.0, at_b >= 0.0) {
                (true, true) => {}
                (true, false) => line[1] = self.meet(plane, &corners, &a, &b),
                (false, true) => line[0] = self.meet(plane, &corners, &b, &a),
                (false, false) => return None,
            }
        }
        Some(line)
    }
}

impl Polygon {
    /// Its vertices in order.
    pub(super) fn vertices(&self) -> &[ClipVertex] {
        &self.vertices[..self.len]
    }

    /// Adds a vertex. A polygon that rounding has bent so much that it has too many loses the last.
    fn push(&mut self, vertex: ClipVertex) {
        if let Some(entry) = self.vertices.get_mut(self.len) {
            *entry = vertex;
            self.len += 1;
        }
    }
}

impl ClipVertex {
    /// A corner of the primitive.
    fn at(corners: &Corners, corner: usize) -> Self {
        Self {
            position: corners[corner],
            weights: std::array::from_fn(|i| if i == corner { 1.0 } else { 0.0 }),
            edge: true,
        }
    }

    /// The corner that it is, if it isn't new.
    pub(super) fn corner(&self) -> Option<usize> {
        let ones = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        ones.iter().position(|one| self.weights == *one)
    }
}
