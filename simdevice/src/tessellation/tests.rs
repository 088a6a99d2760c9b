//! Tests of the tessellator against what the specification says of points and triangles, computed naively.

use super::{ABOVE_ONE, Domain, Spacing, TessellatedPatch, Tessellation};
use std::collections::{HashMap, HashSet};

const SPACINGS: [Spacing; 3] = [
    Spacing::Equal,
    Spacing::FractionalEven,
    Spacing::FractionalOdd,
];

/// Numbers from a linear congruential generator.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    /// A level: small ones are more frequent, and some are whole.
    fn level(&mut self) -> f32 {
        let level = 0.5 + 70.0 * self.next().powi(3);
        if self.next() < 0.4 {
            level.ceil()
        } else {
            level
        }
    }
}

fn tessellation(domain: Domain, spacing: Spacing) -> Tessellation {
    Tessellation {
        domain,
        spacing,
        clockwise: true,
        point_mode: false,
    }
}

fn divide(tessellation: &Tessellation, outer: [f32; 4], inner: [f32; 2]) -> TessellatedPatch {
    let mut patch = TessellatedPatch::default();
    tessellation.tessellate(outer, inner, &mut patch);
    patch
}

/// Twice the signed area of a triangle in u and v.
fn area(patch: &TessellatedPatch, corners: [u32; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| patch.points[corner as usize].map(f64::from));
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

fn triangles(patch: &TessellatedPatch) -> Vec<[u32; 3]> {
    patch.indices.as_chunks().0.to_vec()
}

#[gaurast_runner::test]
fn triangles_cover_the_domain_once() {
    let mut random = Random(1);
    for round in 0..400 {
        for (domain, whole) in [(Domain::Triangles, 1.0), (Domain::Quads, 2.0)] {
            let spacing = SPACINGS[round % 3];
            let outer = [0; 4].map(|_| random.level());
            // An inside of level 1 has points on the border.
            let inner = [0; 2].map(|_| random.level() + 1.0);
            let patch = divide(&tessellation(domain, spacing), outer, inner);
            let context = format!("{domain:?} {spacing:?} {outer:?} {inner:?}");
            let mut sum = 0.0;
            let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
            for corners in triangles(&patch) {
                let area = area(&patch, corners);
                assert!(area >= 0.0, "{context}: {corners:?} is turned over");
                sum += area;
                for (from, to) in [(0, 1), (1, 2), (2, 0)] {
                    *edges.entry((corners[from], corners[to])).or_default() += 1;
                }
            }
            assert!((sum - whole).abs() < 1e-9, "{context}: {sum}");
            // An edge is walked once each way, unless it is on the border.
            let is_on_border = |(from, to): (u32, u32)| {
                let [a, b] = [from, to].map(|point| patch.points[point as usize]);
                let coordinates = if domain == Domain::Triangles { 3 } else { 2 };
                (0..coordinates).any(|axis| {
                    a[axis] == b[axis]
                        && (a[axis] == 0.0 || (domain == Domain::Quads && a[axis] == 1.0))
                })
            };
            for (&(from, to), &count) in &edges {
                assert_eq!(count, 1, "{context}");
                let is_inner = edges.contains_key(&(to, from));
                assert!(
                    is_inner != is_on_border((from, to)),
                    "{context}: {from} {to}"
                );
            }
            let distinct: HashSet<_> = patch.points.iter().map(|it| it.map(f32::to_bits)).collect();
            assert_eq!(distinct.len(), patch.points.len(), "{context}");
        }
    }
}

#[gaurast_runner::test]
fn coordinates_are_exact() {
    let mut random = Random(2);
    for round in 0..300 {
        let spacing = SPACINGS[round % 3];
        let outer = [0; 4].map(|_| random.level());
        let inner = [0; 2].map(|_| random.level());
        for domain in [Domain::Triangles, Domain::Quads, Domain::Isolines] {
            for point in divide(&tessellation(domain, spacing), outer, inner).points {
                for coordinate in point {
                    assert!((0.0..=1.0).contains(&coordinate));
                    assert_eq!(coordinate + (1.0 - coordinate), 1.0);
                    assert_eq!(1.0 - (1.0 - coordinate), coordinate);
                }
                if domain == Domain::Triangles {
                    assert_eq!(point[0] + point[1] + point[2], 1.0);
                }
            }
        }
    }
}

/// The positions of an edge's points, written from the specification.
fn edge(spacing: Spacing, level: f32) -> Vec<f64> {
    let level = f64::from(level);
    let (level, segments) = match spacing {
        Spacing::Equal => {
            let segments = level.clamp(1.0, 64.0).ceil();
            (segments, segments)
        }
        Spacing::FractionalEven => {
            let level = level.clamp(2.0, 64.0);
            (level, 2.0 * (level / 2.0).ceil())
        }
        Spacing::FractionalOdd => {
            let level = level.clamp(1.0, 63.0);
            (level, 2.0 * ((level - 1.0) / 2.0).ceil() + 1.0)
        }
    };
    let mut lengths = vec![1.0 / level; segments as usize];
    if segments > 1.0 {
        let short = (1.0 - (segments - 2.0) / level) / 2.0;
        let place = (segments as usize - 1) / 4;
        lengths[place] = short;
        let mirrored = segments as usize - 1 - place;
        lengths[mirrored] = short;
    }
    let mut positions = vec![0.0];
    positions.extend(lengths.iter().scan(0.0, |sum, length| {
        *sum += length;
        Some(*sum)
    }));
    positions
}

fn assert_close(found: &[f64], expected: &[f64], context: &str) {
    assert_eq!(found.len(), expected.len(), "{context}");
    for (found, expected) in found.iter().zip(expected) {
        assert!(
            (found - expected).abs() < 1e-6,
            "{context}: {found} {expected}"
        );
    }
}

#[gaurast_runner::test]
fn edges_depend_on_their_level_alone() {
    let mut random = Random(3);
    for round in 0..300 {
        let spacing = SPACINGS[round % 3];
        let outer = [0; 4].map(|_| random.level());
        // An inside of level 1 would have points on the edges.
        let inner = [0; 2].map(|_| random.level() + 1.0);
        for domain in [Domain::Triangles, Domain::Quads] {
            let patch = divide(&tessellation(domain, spacing), outer, inner);
            // The edges, as the coordinate that is constant, its value, and the one along the edge.
            let edges: &[(usize, f32, usize)] = match domain {
                Domain::Triangles => &[(0, 0.0, 1), (1, 0.0, 2), (2, 0.0, 0)],
                _ => &[(0, 0.0, 1), (1, 0.0, 0), (0, 1.0, 1), (1, 1.0, 0)],
            };
            for (&(fixed, value, along), level) in edges.iter().zip(outer) {
                let on_edge = patch.points.iter().filter(|point| point[fixed] == value);
                let mut found: Vec<f64> = on_edge.map(|point| point[along].into()).collect();
                found.sort_by(f64::total_cmp);
                let context = format!("{domain:?} {spacing:?} {level}");
                assert_close(&found, &edge(spacing, level), &context);
                for (least, most) in found.iter().zip(found.iter().rev()) {
                    assert_eq!(least + most, 1.0, "{context}");
                }
            }
        }
    }
}

#[gaurast_runner::test]
fn points_inside_lie_where_lines_cross() {
    let mut random = Random(4);
    for round in 0..200 {
        let spacing = SPACINGS[round % 3];
        let (outer, inner) = ([7.0; 4], [0; 2].map(|_| 1.5 + random.level().min(60.0)));
        let [across, up] = inner.map(|level| edge(spacing, level));
        let quads = divide(&tessellation(Domain::Quads, spacing), outer, inner);
        let is_inside = |point: &&[f32; 3]| point[..2].iter().all(|it| *it > 0.0 && *it < 1.0);
        let mut expected = Vec::new();
        for v in &up[1..up.len() - 1] {
            expected.extend(across[1..across.len() - 1].iter().map(|u| [*u, *v]));
        }
        let found: Vec<_> = quads.points.iter().filter(is_inside).collect();
        assert_eq!(found.len(), expected.len());
        for expected in &expected {
            let is_near = |found: &&&[f32; 3]| {
                (0..2).all(|axis| (f64::from(found[axis]) - expected[axis]).abs() < 1e-6)
            };
            assert_eq!(found.iter().filter(is_near).count(), 1);
        }
        // In a triangle, perpendicular lines through the edges' points: each ring has a constant least coordinate.
        let triangle = divide(&tessellation(Domain::Triangles, spacing), outer, inner);
        let segments = across.len() - 1;
        let inside = triangle
            .points
            .iter()
            .filter(|point| point.iter().all(|it| *it > 0.0));
        let mut rings: HashMap<u32, usize> = HashMap::new();
        for point in inside {
            let least = f64::from(point[0].min(point[1]).min(point[2]));
            let ring = (1..=segments / 2)
                .find(|ring| (least - across[*ring] * 2.0 / 3.0).abs() < 1e-6)
                .expect("a ring");
            *rings.entry(ring as u32).or_default() += 1;
        }
        for ring in 1..=segments / 2 {
            let sides = segments - 2 * ring;
            assert_eq!(rings[&(ring as u32)], (3 * sides).max(1));
        }
    }
}

#[gaurast_runner::test]
fn levels_of_one_and_below_are_special() {
    for spacing in [Spacing::Equal, Spacing::FractionalOdd] {
        let triangle = divide(
            &tessellation(Domain::Triangles, spacing),
            [1.0; 4],
            [0.3; 2],
        );
        assert_eq!((triangle.points.len(), triangle.indices.len()), (3, 3));
        let quad = divide(&tessellation(Domain::Quads, spacing), [1.0; 4], [1.0; 2]);
        assert_eq!((quad.points.len(), quad.indices.len()), (4, 6));
        // An inside that isn't divided is, if an edge is.
        let raised = divide(
            &tessellation(Domain::Triangles, spacing),
            [2.0; 4],
            [1.0; 2],
        );
        let segments = spacing.segments(ABOVE_ONE);
        let rings = if segments == 2 { 1 } else { 3 };
        assert_eq!(
            raised.points.len(),
            3 * edge(spacing, 2.0).len() - 3 + rings
        );
    }
    for discarded in [0.0, -1.0, f32::NAN, f32::NEG_INFINITY] {
        for (domain, edges) in [
            (Domain::Triangles, 3),
            (Domain::Quads, 4),
            (Domain::Isolines, 2),
        ] {
            for number in 0..4 {
                let mut outer = [3.0; 4];
                outer[number] = discarded;
                let patch = divide(&tessellation(domain, Spacing::Equal), outer, [3.0; 2]);
                assert_eq!(
                    patch.indices.is_empty(),
                    number < edges,
                    "{domain:?} {number}"
                );
            }
        }
    }
    let inner = divide(
        &tessellation(Domain::Quads, Spacing::Equal),
        [1.0; 4],
        [f32::NAN, f32::INFINITY],
    );
    // One column becomes two.
    assert_eq!(inner.points.len(), 4 + 63);
}

#[gaurast_runner::test]
fn other_modes_have_the_same_points() {
    let (outer, inner) = ([3.0, 4.5, 6.0, 2.0], [5.0, 3.3]);
    for domain in [Domain::Triangles, Domain::Quads, Domain::Isolines] {
        let plain = divide(&tessellation(domain, Spacing::FractionalEven), outer, inner);
        let mut other = tessellation(domain, Spacing::FractionalEven);
        other.point_mode = true;
        let points = divide(&other, outer, inner);
        assert_eq!(points.points, plain.points);
        assert!(
            points
                .indices
                .iter()
                .copied()
                .eq(0..plain.points.len() as u32)
        );
        let used: HashSet<u32> = plain.indices.iter().copied().collect();
        assert_eq!(used.len(), plain.points.len());
        other = tessellation(domain, Spacing::FractionalEven);
        other.clockwise = false;
        let turned = divide(&other, outer, inner);
        if domain == Domain::Isolines {
            assert_eq!(turned.indices, plain.indices);
        } else {
            for (one, other) in triangles(&plain).into_iter().zip(triangles(&turned)) {
                assert_eq!(area(&plain, one), -area(&turned, other));
            }
        }
    }
}

#[gaurast_runner::test]
fn isolines_have_equal_distances() {
    let patch = divide(
        &tessellation(Domain::Isolines, Spacing::FractionalOdd),
        [3.2, 2.5, 0.0, 0.0],
        [0.0; 2],
    );
    assert_eq!(patch.points.len(), 4 * 4);
    for (line, points) in patch.points.chunks(4).enumerate() {
        assert!(points.iter().all(|point| point[1] == line as f32 / 4.0));
        let positions: Vec<f64> = points.iter().map(|point| point[0].into()).collect();
        assert_close(&positions, &edge(Spacing::FractionalOdd, 2.5), "isoline");
    }
    assert_eq!(patch.indices.len(), 4 * 3 * 2);
}
