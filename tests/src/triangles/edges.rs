//! The distance of a sample from a triangle's edges, in exact arithmetic.
//!
//! Positions are integer multiples of 1/64 in clip coordinates. An edge of the projected triangle is the line of the
//! points (X, Y, 1) whose product with the cross product of its ends' (x, y, w) is zero, also if an end is behind the
//! eye. The near or the far plane adds one line where it cuts the triangle.

/// Units of a clip coordinate.
pub const UNITS: i64 = 64;

/// A position in units.
pub type Position = [i64; 4];

/// The position in clip coordinates, as floats; exact.
pub fn to_clip(position: Position) -> [f32; 4] {
    position.map(|coordinate| coordinate as f32 / UNITS as f32)
}

/// A line: the points (X, Y, 1) whose product with it is zero.
type Line = [i128; 3];

fn cross(a: Line, b: Line) -> Line {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: Line, b: Line) -> i128 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The lines of the three edges and of the cuts at the near plane (z = 0) and the far plane (z = w).
pub fn lines(triangle: &[Position; 3]) -> [Line; 5] {
    let points = triangle.map(|[x, y, _, w]| [x, y, w].map(i128::from));
    let edges = [(1, 2), (2, 0), (0, 1)].map(|(i, j)| cross(points[i], points[j]));
    // z times the determinant, over w, is linear in the point of the screen.
    let mut near = [0; 3];
    for (edge, position) in edges.iter().zip(triangle) {
        for axis in 0..3 {
            near[axis] += i128::from(position[2]) * edge[axis];
        }
    }
    let determinant = dot(points[0], edges[0]);
    let far = [near[0], near[1], near[2] - determinant];
    [edges[0], edges[1], edges[2], near, far]
}

/// True if a triangle covers the sample at `x` and `y`, in sixteenths of a pixel, of a square of `size` pixels: its point there is
/// in front of the eye and within the near and the far plane, and inside, or on a left or top edge.
pub fn covers(triangle: &[Position; 3], size: u32, [x, y]: [u32; 2]) -> bool {
    let points = triangle.map(|[x, y, _, w]| [x, y, w].map(i128::from));
    let [a, b, c, near, far] = lines(triangle);
    let turn = dot(points[0], a).signum();
    let denominator = 16 * i128::from(size);
    let along = |sixteenths: u32| 2 * i128::from(sixteenths) - denominator;
    let sample = [along(x), along(y), denominator];
    // The values of the edges, over the determinant, are the weights of the corners in the sample's point, whose w is 1.
    let is_inside = |line: Line| {
        // The value grows towards the inside; y points down.
        let line = line.map(|part| turn * part);
        let inside = dot(line, sample);
        inside > 0 || inside == 0 && (line[0] > 0 || line[0] == 0 && line[1] > 0)
    };
    let depth = |plane: Line| turn * dot(plane, sample);
    turn != 0 && [a, b, c].into_iter().all(is_inside) && depth(near) >= 0 && depth(far) <= 0
}

/// True if the sample at `x` and `y`, in sixteenths of a pixel, of a square of `size` pixels is within 1/256 of a pixel
/// from a line.
pub fn is_near(line: Line, size: u32, [x, y]: [u32; 2]) -> bool {
    // The sample is at (X, Y, D) / D in normalised device coordinates.
    let denominator = 16 * i128::from(size);
    let along = |sixteenths: u32| 2 * i128::from(sixteenths) - denominator;
    let product = dot(line, [along(x), along(y), denominator]);
    // The distance is |product| / D in half sizes of the target, over the length of the normal:
    // |product| / (32 length) pixels.
    64 * product * product <= line[0] * line[0] + line[1] * line[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A right triangle with its legs at 16 and a half of 64 pixels, seen from a distance of 2.
    fn triangle() -> [Position; 3] {
        let at = |x: i64, y: i64| [2 * x, 2 * y, UNITS, 2 * UNITS];
        [at(-31, -31), at(32, -31), at(-31, 32)]
    }

    #[test]
    fn samples_at_and_off_an_edge_are_told_apart() {
        let lines = lines(&triangle());
        // x = -31/64 is 16.5 pixels of 64, which is 264 sixteenths.
        let near = |place| lines[..3].iter().any(|&line| is_near(line, 64, place));
        assert!(near([264, 400]));
        assert!(!near([265, 400]));
        assert!(!near([263, 400]));
        assert!(near([400, 264]));
    }

    #[test]
    fn shared_edges_belong_to_one_triangle() {
        // Corners at pixel centres of 64 pixels, so that edges run through samples.
        let at = |x: i64, y: i64| [2 * x - 63, 2 * y - 63, 0, UNITS];
        let [a, b, c, d] = [at(8, 8), at(24, 8), at(24, 24), at(8, 24)];
        for triangles in [[[a, b, c], [a, c, d]], [[a, c, b], [d, a, c]]] {
            let count = |x: u32, y: u32| {
                let sample = [16 * x + 8, 16 * y + 8];
                let of = |triangle: &&[Position; 3]| covers(triangle, 64, sample);
                triangles.iter().filter(of).count()
            };
            for (x, y) in (0..64).flat_map(|y| (0..64).map(move |x| (x, y))) {
                // Left and top edges are inside, right and bottom ones are not.
                let inside = (8..24).contains(&x) && (8..24).contains(&y);
                assert_eq!(count(x, y), usize::from(inside), "{x} {y}");
            }
        }
    }

    #[test]
    fn what_is_behind_the_eye_or_a_plane_is_not_covered() {
        // A floor: y = w / 2 at w = 2, and its third corner behind the eye. The near plane is at w = 1.
        let at = |x: i64, w: i64| [x, UNITS, w - UNITS, w];
        let floor = [at(-100, 2 * UNITS), at(100, 2 * UNITS), at(0, -UNITS)];
        let at_row = |row: u32| covers(&floor, 64, [512, 16 * row + 8]);
        // y / w is 1/2 at the far edge, which is row 48, and 1 at the near plane, where the picture ends; above the far edge is
        // the mirror image of what is behind the eye.
        let covered: Vec<u32> = (0..64).filter(|&row| at_row(row)).collect();
        assert_eq!(covered, (48..64).collect::<Vec<_>>());
        // Depth goes from -1/2 at the left to 3/2 at the right.
        let at = |x: i64, y: i64, z: i64| [x, y, z, UNITS];
        let cut = [at(-64, -64, -32), at(64, -64, 96), at(-64, 64, -32)];
        let row: Vec<u32> = (0..64).filter(|&x| covers(&cut, 64, [16 * x + 8, 8])).collect();
        assert_eq!(row, (16..48).collect::<Vec<_>>());
    }

    #[test]
    fn a_256th_of_a_pixel_is_the_limit() {
        // The line X = a / b in units, a little off the middle of 64 pixels, at x = 512 sixteenths.
        let off = |numerator: i128, denominator: i128| [denominator, 0, -numerator];
        // 1/256 pixel is 1/8192 of half the target's size.
        assert!(is_near(off(1, 8192), 64, [512, 3]));
        assert!(!is_near(off(1001, 8_192_000), 64, [512, 3]));
        assert!(is_near(off(-999, 8_192_000), 64, [512, 3]));
    }

    #[test]
    fn cuts_are_where_depth_meets_the_planes() {
        // Depth goes from -1/2 at the left to 3/2 at the right.
        let at = |x: i64, y: i64, z: i64| [x, y, z, UNITS];
        let triangle = [at(-64, -64, -32), at(64, -64, 96), at(-64, 64, -32)];
        let [.., near, far] = lines(&triangle);
        let column = |x: u32| [16 * x, 300];
        assert!(is_near(near, 64, column(16)) && !is_near(near, 64, column(17)));
        assert!(is_near(far, 64, column(48)) && !is_near(far, 64, column(47)));
    }
}
