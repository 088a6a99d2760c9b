//! Clipping in homogeneous coordinates. Where an edge meets a plane is always computed from the vertex inside to the
//! one outside, so that polygons which share the edge agree on it bit for bit.

use super::viewport::{LEAST_W, Transform};
use crate::packet::draw::MAX_CLIP_CULL_DISTANCES;

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

    /// How far a vertex is inside a plane; negative outside.
    fn distance(&self, plane: Plane, vertex: &ClipVertex) -> f64 {
        let [_, _, z, w] = vertex.position;
        match plane {
            Plane::Near => z,
            Plane::Far => w - z,
            Plane::LeastW => w - f64::from(LEAST_W),
            Plane::Guard(side) => self.transform.guard_distances(vertex.position)[side],
            Plane::User(index) => {
                let part = |corner: usize| {
                    vertex.weights[corner] * f64::from(self.distances[corner][index])
                };
                part(0) + part(1) + part(2)
            }
        }
    }

    /// Where the edge between two vertices, at these distances, meets the plane.
    fn meet(
        &self,
        plane: Plane,
        inside: (&ClipVertex, f64),
        outside: (&ClipVertex, f64),
    ) -> ClipVertex {
        let (a, b) = (inside.0, outside.0);
        let t = inside.1 / (inside.1 - outside.1);
        let between = |a: f64, b: f64| a + t * (b - a);
        let mut new = ClipVertex {
            position: std::array::from_fn(|i| between(a.position[i], b.position[i])),
            weights: std::array::from_fn(|i| between(a.weights[i], b.weights[i])),
            edge: false,
        };
        // What rounding may have moved off the plane.
        let position = &mut new.position;
        match plane {
            Plane::Near => position[2] = 0.0,
            Plane::Far => position[2] = position[3],
            Plane::LeastW => position[3] = LEAST_W.into(),
            Plane::Guard(_) | Plane::User(_) => {}
        }
        new
    }

    /// Clips a triangle. Less than three vertices are left of one that is invisible.
    pub(super) fn triangle(&self, corners: [[f32; 4]; 3]) -> Polygon {
        let mut polygon = Polygon::default();
        for (corner, position) in corners.into_iter().enumerate() {
            polygon.push(ClipVertex {
                position: position.map(f64::from),
                weights: std::array::from_fn(|i| if i == corner { 1.0 } else { 0.0 }),
                edge: true,
            });
        }
        for plane in self.planes() {
            polygon = self.cut(&polygon, plane);
            if polygon.len < 3 {
                break;
            }
        }
        polygon
    }

    fn cut(&self, polygon: &Polygon, plane: Plane) -> Polygon {
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
                    let mut new = self.meet(plane, here, next);
                    // The volume's own planes leave no outline, as if nothing had been clipped.
                    new.edge = matches!(plane, Plane::User(_));
                    out.push(new);
                }
            } else if next.1 >= 0.0 {
                let mut new = self.meet(plane, next, here);
                new.edge = here.0.edge;
                out.push(new);
            }
            here = next;
        }
        out
    }

    /// Clips a line; `None` if nothing is left of it.
    pub(super) fn line(&self, ends: [[f32; 4]; 2]) -> Option<[ClipVertex; 2]> {
        let end = |corner: usize| ClipVertex {
            position: ends[corner].map(f64::from),
            weights: std::array::from_fn(|i| if i == corner { 1.0 } else { 0.0 }),
            edge: false,
        };
        let mut line = [end(0), end(1)];
        for plane in self.planes() {
            let [a, b] = line;
            let (at_a, at_b) = (self.distance(plane, &a), self.distance(plane, &b));
            match (at_a >= 0.0, at_b >= 0.0) {
                (true, true) => {}
                (true, false) => line[1] = self.meet(plane, (&a, at_a), (&b, at_b)),
                (false, true) => line[0] = self.meet(plane, (&b, at_b), (&a, at_a)),
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
    /// The corner that it is, if it isn't new.
    pub(super) fn corner(&self) -> Option<usize> {
        let ones = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        ones.iter().position(|one| self.weights == *one)
    }
}
