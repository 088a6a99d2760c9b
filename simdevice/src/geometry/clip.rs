//! Clipping in homogeneous coordinates. The intersection of a primitive's edge with a plane is always computed from the
//! edge's original corners, in a form that does not depend on their order, so that polygons that share the edge get the
//! same bits. The products in it are exact, so that an edge stays in place however far outside its corners are.

use super::viewport::{LEAST_W, Transform};
use crate::limits::MAX_CLIP_CULL_DISTANCES;

/// A vertex of a polygon during clipping.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ClipVertex {
    /// The position in clip space.
    pub position: [f64; 4],
    /// The barycentric weights of the primitive's corners, in clip space. Their sum is 1.
    pub weights: [f64; 3],
    /// True if the edge from this vertex to the next belongs to the primitive's outline.
    pub edge: bool,
}

/// The most vertices of a polygon: three corners, and one more for each plane.
pub(super) const MOST_VERTICES: usize = 3 + PLANES + MAX_CLIP_CULL_DISTANCES;

/// The view volume's planes: near, far, least w, and the four of the guard band.
const PLANES: usize = 7;

/// A convex polygon during clipping.
#[derive(Clone, Debug, Default)]
pub(super) struct Polygon {
    vertices: [ClipVertex; MOST_VERTICES],
    len: usize,
}

/// A plane to clip against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Plane {
    Near,
    Far,
    LeastW,
    Guard(usize),
    User(usize),
}

const FRUSTUM: [Plane; PLANES] =
    [Plane::Near, Plane::Far, Plane::LeastW, Plane::Guard(0), Plane::Guard(1), Plane::Guard(2), Plane::Guard(3)];

/// The positions of a primitive's corners in clip space. All are binary32 numbers.
type Corners = [[f64; 4]; 3];

/// The planes against which a primitive is clipped.
pub(super) struct Clipper<'a> {
    pub transform: &'a Transform,
    /// The user clip distances of each corner.
    pub distances: [[f32; MAX_CLIP_CULL_DISTANCES]; 3],
    /// The number of user clip distances.
    pub distance_count: usize,
}

impl Clipper<'_> {
    fn planes(&self) -> impl Iterator<Item = Plane> {
        let depth = self.transform.clip_depth;
        let user = (0..self.distance_count).map(Plane::User);
        let frustum = FRUSTUM.into_iter();
        let frustum = frustum.filter(move |plane| depth || !matches!(plane, Plane::Near | Plane::Far));
        frustum.chain(user)
    }

    /// The normalized device coordinate of the near plane.
    fn near(&self) -> f64 {
        self.transform.near.into()
    }

    /// The distance of a vertex from a plane: positive inside, negative outside.
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
                let part = |corner: usize| vertex.weights[corner] * f64::from(self.distances[corner][index]);
                part(0) + part(1) + part(2)
            }
        }
    }

    /// The intersection of a plane with the edge between two vertices, of which `a` is inside and `b` outside.
    fn meet(&self, plane: Plane, corners: &Corners, a: &ClipVertex, b: &ClipVertex) -> ClipVertex {
        let of_primitive = (0..3).find(|&other| a.weights[other] == 0.0 && b.weights[other] == 0.0);
        let on_edge = of_primitive.map(|other| self.meet_edge(plane, corners, [(other + 1) % 3, (other + 2) % 3]));
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
        // Rounding may have moved the vertex off the plane.
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

    /// The intersection of a plane with the edge between two corners p and q: (p_i D(q) - q_i D(p)) / (D(q) - D(p)).
    /// The distance D is written out, because if it is large compared to the edge, rounding it would lose the position
    /// of the intersection. The remaining terms are differences of products of two binary32 numbers, and the products
    /// are exact here.
    fn meet_edge(&self, plane: Plane, corners: &Corners, [p, q]: [usize; 2]) -> ClipVertex {
        let [at_p, at_q] = [p, q].map(|corner| self.distance(plane, &ClipVertex::at(corners, corner)));
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
        ClipVertex { position: std::array::from_fn(|i| position(i) / both), weights, edge: false }
    }

    /// Clips a triangle. Fewer than three vertices remain of an invisible one.
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
                    // Edges along the view volume's own planes are not part of the outline, as if nothing had been
                    // clipped.
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

    /// Clips a line; `None` if nothing remains of it.
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
    /// The vertices in order.
    pub(super) fn vertices(&self) -> &[ClipVertex] {
        &self.vertices[..self.len]
    }

    /// Adds a vertex. If rounding has made a polygon so irregular that it has too many vertices, the last are dropped.
    fn push(&mut self, vertex: ClipVertex) {
        if let Some(entry) = self.vertices.get_mut(self.len) {
            *entry = vertex;
            self.len += 1;
        }
    }
}

impl ClipVertex {
    /// A corner of the primitive as a vertex.
    fn at(corners: &Corners, corner: usize) -> Self {
        Self {
            position: corners[corner],
            weights: std::array::from_fn(|i| if i == corner { 1.0 } else { 0.0 }),
            edge: true,
        }
    }

    /// The corner that this vertex is, if clipping did not make it.
    pub(super) fn corner(&self) -> Option<usize> {
        let ones = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        ones.iter().position(|one| self.weights == *one)
    }
}
