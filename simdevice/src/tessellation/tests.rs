//! Tests of the tessellator against a naive one, which follows the text of Vulkan 1.3 in geometry, and against the rules
//! of tessellation invariance.

use super::Domain::{Isolines, Quads, Triangles};
use super::Spacing::{Equal, FractionalEven, FractionalOdd};
use super::{Domain, Spacing, TessellatedPatch, Tessellation};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::{BTreeMap, BTreeSet};

const SPACINGS: [Spacing; 3] = [Equal, FractionalEven, FractionalOdd];

/// A patch: its levels and how it is divided.
#[derive(Clone, Copy, Debug)]
struct Patch {
    how: Tessellation,
    outer: [f32; 4],
    inner: [f32; 2],
}

/// A point whose coordinates compare as bits. They aren't negative, so that the order is that of the coordinates.
type Point = [u32; 3];

fn bits(point: [f32; 3]) -> Point {
    point.map(f32::to_bits)
}

fn coordinates(point: Point) -> [f64; 3] {
    point.map(|it| f64::from(f32::from_bits(it)))
}

fn how(domain: Domain, spacing: Spacing) -> Tessellation {
    Tessellation { domain, spacing, clockwise: true, point_mode: false }
}

impl Patch {
    fn divide(&self) -> TessellatedPatch {
        let mut out = TessellatedPatch { points: vec![[7.0; 3]; 3], indices: vec![9; 5] };
        self.how.tessellate(self.outer, self.inner, &mut out);
        out
    }

    /// The triangles, in order.
    fn triangles(&self) -> Vec<[Point; 3]> {
        let out = self.divide();
        let corners = out.indices.chunks_exact(3);
        let triangle = |it: &[u32]| [it[0], it[1], it[2]].map(|point| bits(out.points[point as usize]));
        corners.map(triangle).collect()
    }

    /// The triangles, each with its corners sorted.
    fn triangle_set(&self) -> BTreeSet<[Point; 3]> {
        let mut triangles = self.triangles();
        for triangle in &mut triangles {
            triangle.sort_unstable();
        }
        triangles.into_iter().collect()
    }

    /// The triangles no corner of which is on the boundary.
    fn inside(&self) -> BTreeSet<[Point; 3]> {
        let mut triangles = self.triangle_set();
        triangles.retain(|it| !it.iter().any(|&point| self.is_on_boundary(point)));
        triangles
    }

    fn is_on_boundary(&self, point: Point) -> bool {
        (0..self.edges()).any(|edge| self.is_on(edge, point))
    }

    fn edges(&self) -> usize {
        if self.how.domain == Triangles { 3 } else { 4 }
    }

    /// True if a point is on the edge of an outer level.
    fn is_on(&self, edge: usize, point: Point) -> bool {
        match self.how.domain {
            Triangles => point[edge] == 0,
            _ => point[edge % 2] == if edge < 2 { 0 } else { 1.0f32.to_bits() },
        }
    }

    /// The positions of an outer edge's points along it.
    fn edge_positions(&self, edge: usize) -> BTreeSet<u32> {
        let along = match self.how.domain {
            Triangles => (edge + 1) % 3,
            _ => 1 - edge % 2,
        };
        let points = self.divide().points.into_iter().map(bits);
        let on_edge = points.filter(|&point| self.is_on(edge, point));
        on_edge.map(|point| point[along]).collect()
    }

    /// The numbers of segments, the outer edges' first. Inner ones are raised from 1 beside others.
    fn segments(&self) -> Vec<usize> {
        let inner = if self.how.domain == Triangles { 1 } else { 2 };
        let levels = self.outer[..self.edges()].iter();
        let levels = levels.chain(&self.inner[..inner]);
        let mut segments: Vec<usize> = levels.map(|&level| naive_segments(self.how.spacing, level)).collect();
        if segments.iter().any(|&it| it > 1) {
            for it in &mut segments[self.edges()..] {
                if *it == 1 {
                    *it = if self.how.spacing == Equal { 2 } else { 3 };
                }
            }
        }
        segments
    }
}

/// Patches with random levels, of which many are integers or small.
fn random_patches(seed: u64, count: usize) -> impl Iterator<Item = Patch> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(move |_| {
        let most = [3.0, 9.0, 64.0][random.random_range(0..3)];
        let mut level = || {
            let level = random.random_range(1.0..most);
            match random.random_range(0..4) {
                0 => f32::floor(level),
                // The least level with more segments, where a segment could vanish.
                1 => f32::floor(level).next_up(),
                _ => level,
            }
        };
        let (outer, inner) = ([0; 4].map(|_| level()), [0; 2].map(|_| level()));
        Patch {
            how: how([Triangles, Quads][random.random_range(0..2)], SPACINGS[random.random_range(0..3)]),
            outer,
            inner,
        }
    })
}

/// The number of segments of an edge: the least one that the spacing has and that isn't less than the level.
fn naive_segments(spacing: Spacing, level: f32) -> usize {
    let all = (1..=64).filter(|it| match spacing {
        Equal => true,
        FractionalEven => it % 2 == 0,
        FractionalOdd => it % 2 == 1,
    });
    let (mut last, mut found) = (1, None);
    for segments in all {
        last = segments;
        if found.is_none() && segments as f32 >= level {
            found = Some(segments);
        }
    }
    found.unwrap_or(last)
}

/// The positions of an edge's points, from the lengths of its segments: all but two have the length 1 / level. A level is
/// at least 1/256 above the next lower one with fewer segments.
fn naive_positions(spacing: Spacing, level: f32) -> Vec<f64> {
    let segments = naive_segments(spacing, level);
    let level = match spacing {
        Equal => segments as f64,
        FractionalEven => f64::from(level).clamp(2.0, 64.0),
        FractionalOdd => f64::from(level).clamp(1.0, 63.0),
    };
    let level = level.max(segments as f64 - 2.0 + 1.0 / 256.0);
    let mut lengths = vec![1.0 / level; segments];
    if segments > 2 {
        let short = (1.0 - (segments - 2) as f64 / level) / 2.0;
        let at = naive_short_segment(segments);
        lengths[at] = short;
        lengths[segments - 1 - at] = short;
    }
    let mut position = 0.0;
    let mut positions = vec![0.0];
    for length in lengths {
        position += length;
        positions.push(position);
    }
    positions
}

/// The place of the first short segment: the odd places of a half, from the least, then again for each power of two of
/// segments.
fn naive_short_segment(segments: usize) -> usize {
    const PLACES: [usize; 16] = [0, 1, 1, 3, 1, 3, 5, 7, 1, 3, 5, 7, 9, 11, 13, 15];
    let pairs = (segments - 2) / 2;
    match pairs {
        0..16 => PLACES[pairs],
        _ => 2 * (pairs - 16) + 1,
    }
}

/// The points of a patch, by drawing perpendiculars in an equilateral triangle or a grid in a square.
fn naive_points(patch: &Patch) -> Vec<[f64; 3]> {
    let spacing = patch.how.spacing;
    let segments = patch.segments();
    let inner = patch.inner.map(|level| {
        let undivided = segments.iter().all(|&it| it == 1);
        match (naive_segments(spacing, level), spacing) {
            (1, Equal) if !undivided => vec![0.0, 0.5, 1.0],
            (1, _) if !undivided => vec![0.0, 0.0, 1.0, 1.0],
            _ => naive_positions(spacing, level),
        }
    });
    let mut points = Vec::new();
    for edge in 0..patch.edges() {
        let positions = naive_positions(spacing, patch.outer[edge]);
        for &t in &positions[..positions.len() - 1] {
            points.push(match (patch.how.domain, edge) {
                (Triangles, _) => {
                    let mut point = [0.0; 3];
                    point[(edge + 1) % 3] = 1.0 - t;
                    point[(edge + 2) % 3] = t;
                    point
                }
                (_, 0) => [0.0, 1.0 - t, 0.0],
                (_, 1) => [t, 0.0, 0.0],
                (_, 2) => [1.0, t, 0.0],
                _ => [1.0 - t, 1.0, 0.0],
            });
        }
    }
    if patch.how.domain == Quads {
        for &u in &inner[0][1..inner[0].len() - 1] {
            for &v in &inner[1][1..inner[1].len() - 1] {
                points.push([u, v, 0.0]);
            }
        }
        return points;
    }
    // The corners of an equilateral triangle whose edges have the length 1, and its altitude.
    let altitude = 0.75f64.sqrt();
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.5, altitude]];
    let along =
        |from: [f64; 2], to: [f64; 2], t: f64| [from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])];
    let barycentric = |[x, y]: [f64; 2]| {
        let w = y / altitude;
        let v = x - w / 2.0;
        [1.0 - v - w, v, w]
    };
    let inner = &inner[0];
    let last = inner.len() - 1;
    for ring in 1..=last / 2 {
        // Both perpendiculars of a corner meet on its bisector, at this distance from the edges.
        let distance = inner[ring] / 3.0f64.sqrt();
        if 2 * ring == last {
            points.push([1.0 / 3.0; 3]);
            continue;
        }
        for side in 0..3 {
            let (from, to) = (corners[side], corners[(side + 1) % 3]);
            let normal = [from[1] - to[1], to[0] - from[0]];
            for &t in &inner[ring..last - ring] {
                let [x, y] = along(from, to, t);
                points.push(barycentric([x + distance * normal[0], y + distance * normal[1]]));
            }
        }
    }
    points
}

/// Twice the area of a triangle, with u to the right and v up.
fn doubled_area(triangle: [Point; 3]) -> f64 {
    let [a, b, c] = triangle.map(coordinates);
    (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
}

/// True if an inner edge has the limit of the levels above 1, which makes triangles without area.
fn has_flat_triangles(patch: &Patch) -> bool {
    let inner = if patch.how.domain == Triangles { 1 } else { 2 };
    let segments = patch.segments();
    patch.how.spacing == FractionalOdd
        && segments.iter().any(|&it| it > 1)
        && patch.inner[..inner].iter().any(|&level| level <= 1.0)
}

#[gaurast_runner::test]
fn edges_are_divided_as_their_spacing_says() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let integers = (1..=70).map(|it| it as f32);
    let fractions = (0..2000).map(|_| random.random_range(0.01..70.0));
    for level in integers.chain(fractions) {
        for spacing in SPACINGS {
            let edge = spacing.divide(level);
            let positions = edge.positions().to_vec();
            let expected = naive_positions(spacing, level);
            assert_eq!(positions.len(), expected.len(), "{spacing:?} {level}");
            for (place, (&is, should)) in positions.iter().zip(expected).enumerate() {
                let is = is as f32 / super::ONE as f32;
                assert!((f64::from(is) - should).abs() < 1e-7, "{spacing:?} {level}: {is} {should}");
                assert_eq!(1.0 - (1.0 - is), is);
                assert_eq!(is + (1.0 - is), 1.0);
                let mirrored = positions[edge.segments - place];
                assert_eq!(mirrored as f32 / super::ONE as f32, 1.0 - is);
            }
            assert!(positions.windows(2).all(|it| it[1] >= it[0] + 512));
        }
    }
}

#[gaurast_runner::test]
fn short_segments_grow_with_the_level() {
    for spacing in [FractionalEven, FractionalOdd] {
        let mut before = (0, 0);
        for step in 0..61 * 64 {
            let edge = spacing.divide(2.0 + step as f32 / 64.0);
            let at = naive_short_segment(edge.segments);
            let length = edge.at[at + 1] - edge.at[at];
            if edge.segments == before.0 {
                assert!(length > before.1, "{spacing:?} {step}");
            }
            before = (edge.segments, length);
        }
    }
}

#[gaurast_runner::test]
fn points_are_those_of_the_naive_tessellator() {
    for patch in random_patches(2, 400) {
        let points = patch.divide().points;
        let mut expected = naive_points(&patch);
        assert_eq!(points.len(), expected.len(), "{patch:?}");
        for point in points {
            let point = point.map(f64::from);
            let distance = |other: &[f64; 3]| {
                let differences = point.iter().zip(other).map(|(a, b)| (a - b).abs());
                differences.fold(0.0, f64::max)
            };
            let nearest = (0..expected.len())
                .min_by(|&a, &b| distance(&expected[a]).total_cmp(&distance(&expected[b])))
                .expect("a point is left");
            assert!(distance(&expected[nearest]) < 2e-7, "{patch:?} {point:?}");
            expected.swap_remove(nearest);
        }
    }
}

#[gaurast_runner::test]
fn coordinates_are_exact() {
    for patch in random_patches(3, 500) {
        for point in patch.divide().points {
            for coordinate in point {
                assert!((0.0..=1.0).contains(&coordinate));
                assert_eq!(coordinate + (1.0 - coordinate), 1.0);
            }
            let [u, v, w] = point;
            match patch.how.domain {
                Triangles => {
                    assert_eq!(u + v + w, 1.0);
                    assert_eq!(1.0 - u - v, w);
                }
                _ => assert_eq!(w, 0.0),
            }
        }
    }
}

#[gaurast_runner::test]
fn triangles_cover_the_domain_once() {
    let patches = random_patches(4, 1000).filter(|it| !has_flat_triangles(it));
    for mut patch in patches {
        for clockwise in [true, false] {
            patch.how.clockwise = clockwise;
            // Triangles are clockwise with v down if they are counter-clockwise with v up.
            let sign = if clockwise { 1.0 } else { -1.0 };
            let triangles = patch.triangles();
            let mut sum = 0.0;
            let mut directed = BTreeMap::new();
            for &triangle in &triangles {
                let area = sign * doubled_area(triangle);
                assert!(area > 0.0, "{patch:?}");
                sum += area;
                for corner in 0..3 {
                    let edge = (triangle[corner], triangle[(corner + 1) % 3]);
                    *directed.entry(edge).or_insert(0) += 1;
                }
            }
            let whole = if patch.how.domain == Triangles { 1.0 } else { 2.0 };
            assert!((sum - whole).abs() < 1e-9, "{patch:?} {sum}");
            let mut boundary = 0;
            for (&(from, to), &count) in &directed {
                assert_eq!(count, 1, "{patch:?}");
                if !directed.contains_key(&(to, from)) {
                    let on_edge = |edge: &usize| patch.is_on(*edge, from) && patch.is_on(*edge, to);
                    assert!((0..patch.edges()).any(|edge| on_edge(&edge)));
                    boundary += 1;
                }
            }
            let outer: usize = patch.segments()[..patch.edges()].iter().sum();
            assert_eq!(boundary, outer, "{patch:?}");
        }
    }
}

#[gaurast_runner::test]
fn points_and_triangles_have_their_number() {
    for patch in random_patches(5, 1000) {
        let segments = patch.segments();
        let outer: usize = segments[..patch.edges()].iter().sum();
        let inner = &segments[patch.edges()..];
        let (points, triangles) = match (patch.how.domain, inner) {
            (Triangles, &[1]) => (3, 1),
            (Triangles, &[n]) => {
                // A ring of n - 2k segments per edge has that many points per edge. A strip has a triangle for each
                // segment on both of its sides.
                let rings = (1..=n / 2).map(|ring| n - 2 * ring);
                let sides: usize = rings.sum::<usize>() * 3;
                let centre = usize::from(n % 2 == 0);
                let innermost = if n % 2 == 1 { 3 } else { 0 };
                (outer + sides + centre, outer + 2 * sides - innermost + innermost / 3)
            }
            (_, &[1, 1]) => (4, 2),
            (_, &[n, m]) => {
                let around = 2 * (n - 2) + 2 * (m - 2);
                (outer + (n - 1) * (m - 1), outer + around + 2 * (n - 2) * (m - 2))
            }
            _ => unreachable!(),
        };
        let out = patch.divide();
        assert_eq!(out.points.len(), points, "{patch:?}");
        assert_eq!(out.indices.len(), 3 * triangles, "{patch:?}");
        let used: BTreeSet<_> = out.indices.iter().copied().collect();
        assert!(used.into_iter().eq(0..points as u32));
        if !has_flat_triangles(&patch) {
            let distinct: BTreeSet<_> = out.points.iter().copied().map(bits).collect();
            assert_eq!(distinct.len(), points, "{patch:?}");
        }
    }
}

#[gaurast_runner::test]
fn outer_edges_depend_on_their_level_alone() {
    let patches = random_patches(6, 500).filter(|it| !has_flat_triangles(it));
    for patch in patches {
        for edge in 0..patch.edges() {
            let spacing = patch.how.spacing;
            let expected = spacing.divide(patch.outer[edge]);
            let expected = expected.positions().iter();
            let expected = expected.map(|&it| (it as f32 / super::ONE as f32).to_bits());
            assert!(patch.edge_positions(edge).into_iter().eq(expected));
        }
    }
}

#[gaurast_runner::test]
fn the_inside_depends_on_inner_levels_alone() {
    let undivided = [1.0; 4];
    let mut random = ChaCha8Rng::seed_from_u64(7);
    for mut patch in random_patches(7, 1000) {
        if random.random_range(0..4) == 0 {
            patch.inner = [1.0; 2];
        }
        let inside = patch.inside();
        let others = [undivided, [0; 4].map(|_| random.random_range(1.0..64.0))];
        for outer in others {
            assert_eq!(inside, Patch { outer, ..patch }.inside(), "{patch:?}");
        }
        if patch.how.domain == Triangles {
            // Only the first inner level counts, and only three outer ones.
            let mut other = patch;
            (other.inner[1], other.outer[3]) = (random.random_range(-1.0..64.0), -1.0);
            assert_eq!(patch.triangles(), other.triangles());
        }
    }
}

#[gaurast_runner::test]
fn a_strip_depends_on_the_levels_of_its_sides_alone() {
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let patches = random_patches(8, 500).filter(|it| {
        // The triangles of a strip are told by the points on its edge alone.
        it.inner.iter().all(|&level| level > 1.0)
    });
    for patch in patches {
        for edge in 0..patch.edges() {
            let strip = |patch: &Patch| {
                let mut triangles = patch.triangle_set();
                triangles.retain(|it| it.iter().filter(|&&point| patch.is_on(edge, point)).count() == 2);
                triangles
            };
            let mut other = patch;
            for (number, level) in other.outer.iter_mut().enumerate() {
                if number != edge {
                    *level = random.random_range(1.0..64.0);
                }
            }
            let (one, two) = (strip(&patch), strip(&other));
            assert_eq!(one.len(), patch.segments()[edge]);
            assert_eq!(one, two, "{patch:?} {other:?}");
        }
    }
}

#[gaurast_runner::test]
fn winding_and_repetition_change_no_triangle() {
    for patch in random_patches(9, 1000) {
        let mut other = patch;
        other.how.clockwise = false;
        assert_eq!(patch.triangle_set(), other.triangle_set());
        assert_eq!(patch.triangles(), patch.triangles());
    }
}

#[gaurast_runner::test]
fn point_mode_gives_each_point_once() {
    for patch in random_patches(10, 500) {
        for domain in [Triangles, Quads, Isolines] {
            let mut patch = patch;
            patch.how.domain = domain;
            let primitives = patch.divide();
            patch.how.point_mode = true;
            let points = patch.divide();
            assert_eq!(patch.how.corners(), 1);
            assert_eq!(points.points, primitives.points);
            assert!(points.indices.into_iter().eq(0..points.points.len() as u32));
        }
    }
}

#[gaurast_runner::test]
fn undivided_patches_have_the_corners_of_the_domain() {
    for spacing in [Equal, FractionalOdd] {
        let mut patch = Patch { how: how(Triangles, spacing), outer: [1.0, 0.5, 1.0, 1.0], inner: [0.0, -3.0] };
        let out = patch.divide();
        assert_eq!(out.points, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        assert_eq!(out.indices, [0, 1, 2]);
        patch.how.domain = Quads;
        let out = patch.divide();
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert_eq!(out.points, corners.map(|[u, v]| [u, v, 0.0]));
        assert_eq!(out.indices, [0, 1, 2, 0, 2, 3]);
    }
}

#[gaurast_runner::test]
fn an_inner_level_of_one_is_the_limit_of_those_above() {
    for domain in [Triangles, Quads] {
        let patch = Patch { how: how(domain, FractionalOdd), outer: [2.5, 1.0, 1.0, 3.0], inner: [1.0, 1.0] };
        let edges = patch.edges();
        let out = patch.divide();
        let count = out.points.len();
        // The ring inside is the domain's boundary.
        let corners: BTreeSet<_> = out.points[count - edges..].iter().copied().map(bits).collect();
        assert_eq!(corners.len(), edges);
        assert!(corners.iter().all(|&point| patch.is_on_boundary(point)));
        let areas = patch.triangles().into_iter().map(doubled_area);
        assert!(areas.clone().all(|area| area >= 0.0));
        assert_eq!(areas.sum::<f64>(), if edges == 3 { 1.0 } else { 2.0 });
    }
}

#[gaurast_runner::test]
fn patches_are_discarded_if_an_outer_level_is_not_positive() {
    let bad = [0.0, -0.0, -1.0, f32::NAN, f32::NEG_INFINITY];
    for spacing in SPACINGS {
        for (domain, used) in [(Triangles, 3), (Quads, 4), (Isolines, 2)] {
            for level in bad {
                for edge in 0..4 {
                    let mut patch = Patch { how: how(domain, spacing), outer: [4.0; 4], inner: [level; 2] };
                    patch.outer[edge] = level;
                    let out = patch.divide();
                    assert_eq!(out.points.is_empty(), edge < used);
                    assert_eq!(out.indices.is_empty(), edge < used);
                }
            }
        }
    }
}

#[gaurast_runner::test]
fn levels_are_limited_to_those_of_the_spacing() {
    let same = [
        (Equal, f32::INFINITY, 64.0),
        (Equal, 65.0, 64.0),
        (Equal, 63.1, 64.0),
        (Equal, f32::MIN_POSITIVE, 1.0),
        (FractionalEven, f32::INFINITY, 64.0),
        (FractionalEven, 0.5, 2.0),
        (FractionalOdd, f32::INFINITY, 63.0),
        (FractionalOdd, 63.5, 63.0),
        (FractionalOdd, 0.5, 1.0),
    ];
    for (spacing, one, other) in same {
        for domain in [Triangles, Quads, Isolines] {
            let points = |level: f32| {
                // The number of isolines has a spacing of its own.
                let first = if domain == Isolines { 3.0 } else { level };
                let (outer, inner) = ([first, level, level, level], [level; 2]);
                let how = how(domain, spacing);
                Patch { how, outer, inner }.divide().points
            };
            assert_eq!(points(one), points(other));
        }
        assert_eq!(spacing.divide(f32::NAN).positions(), spacing.divide(-1.0).positions());
    }
}

#[gaurast_runner::test]
fn isolines_have_equal_distances() {
    for mut patch in random_patches(11, 500) {
        patch.how.domain = Isolines;
        let [lines, segments, ..] = patch.outer;
        let spacing = patch.how.spacing;
        let (across, along) = (naive_segments(Equal, lines), spacing.divide(segments));
        let out = patch.divide();
        assert_eq!(patch.how.corners(), 2);
        assert_eq!(out.points.len(), across * (along.segments + 1));
        assert_eq!(out.indices.len(), 2 * across * along.segments);
        for (number, point) in out.points.iter().enumerate() {
            let (line, place) = (number / (along.segments + 1), number % (along.segments + 1));
            let v = line as f64 / across as f64;
            assert!((f64::from(point[1]) - v).abs() < 1e-7);
            assert_eq!(point[0], along.at[place] as f32 / super::ONE as f32);
            assert_eq!(point[2], 0.0);
        }
        for line in out.indices.chunks_exact(2) {
            let [from, to] = [line[0], line[1]].map(|it| out.points[it as usize]);
            assert_eq!(line[1], line[0] + 1);
            assert_eq!(from[1], to[1]);
            assert!(from[0] < to[0]);
        }
    }
}
