//! The coverage of samples by triangles: a million triangles of all kinds, clipped triangles, and meshes.

use gaurast_runner::{Case, Need, Variant, shards};
use gaurast_testkit::Gpu;
use gaurast_testkit::devices::{lavapipe, own};
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::shapes;
use gaurast_tests::triangles::checksum::{Checksums, first_difference, numbers};
use gaurast_tests::triangles::clipped::{KINDS, SIZE as SMALL, clipped, places};
use gaurast_tests::triangles::edges::{Position, is_near, lines, to_clip};
use rand::Rng;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

type Triangle = [[f32; 4]; 3];

/// The side of the square target in pixels.
const SIZE: u32 = 512;

/// A generator of triangles of one kind: three points in pixels.
type Kind = fn(&mut ChaCha8Rng) -> [[f32; 2]; 3];

fn around(rng: &mut ChaCha8Rng, radius: f32) -> [[f32; 2]; 3] {
    let margin = radius..SIZE as f32 - radius;
    let center = [0; 2].map(|_| rng.random_range(margin.clone()));
    [0; 3].map(|_| center.map(|c| c + rng.random_range(-radius..radius)))
}

fn sub_pixel(rng: &mut ChaCha8Rng) -> [[f32; 2]; 3] {
    around(rng, 0.5)
}

fn small(rng: &mut ChaCha8Rng) -> [[f32; 2]; 3] {
    around(rng, 4.0)
}

fn sliver(rng: &mut ChaCha8Rng) -> [[f32; 2]; 3] {
    let [a, b, _] = around(rng, 40.0);
    let share: f32 = rng.random();
    let between = [0, 1].map(|axis| {
        let width = rng.random_range(-0.2..0.2f32);
        (a[axis] + share * (b[axis] - a[axis]) + width).clamp(0.0, SIZE as f32)
    });
    [a, b, between]
}

fn huge(rng: &mut ChaCha8Rng) -> [[f32; 2]; 3] {
    [0; 3].map(|_| [0; 2].map(|_| rng.random_range(0.0..SIZE as f32)))
}

/// Triangles with vertices and edges on samples, between pixels, and on the borders.
fn aligned(rng: &mut ChaCha8Rng) -> [[f32; 2]; 3] {
    around(rng, 12.0).map(|point| point.map(|c| (8.0 * c).round() / 8.0))
}

/// Triangles without area: two corners are equal, or all are on a line.
fn degenerate(rng: &mut ChaCha8Rng) -> [[f32; 2]; 3] {
    let [a, b, _] = aligned(rng);
    if rng.random() { [a, b, b] } else { [a, b, [0, 1].map(|axis| 0.5 * (a[axis] + b[axis]))] }
}

/// Converts pixels to clip coordinates, with or without perspective.
fn to_triangle(rng: &mut ChaCha8Rng, points: [[f32; 2]; 3]) -> Triangle {
    let perspective: bool = rng.random();
    points.map(|[x, y]| {
        let half = SIZE as f32 / 2.0;
        let z = rng.random_range(0.01..0.99f32);
        let w = if perspective { rng.random_range(0.5..4.0f32) } else { 1.0 };
        // A coordinate that rounding would put outside is clamped.
        let clip = |pixel: f32| ((pixel - half) / half * w).clamp(-w, w);
        [clip(x), clip(y), z * w, w]
    })
}

/// Triangles within the view volume, of all kinds in fixed proportions.
fn unclipped(seed: u64, count: usize) -> Vec<Triangle> {
    const KINDS: [(Kind, u32); 6] =
        [(sub_pixel, 4000), (small, 3500), (sliver, 1200), (aligned, 1000), (degenerate, 297), (huge, 3)];
    let mut rng = shapes::rng(seed);
    (0..count)
        .map(|_| {
            let kinds = KINDS.choose_weighted(&mut rng, |(_, weight)| *weight);
            let (kind, _) = kinds.expect("weights are positive");
            let points = kind(&mut rng);
            to_triangle(&mut rng, points)
        })
        .collect()
}

fn assert_equal(ours: &Gpu, theirs: &Gpu, triangles: &[Triangle], samples: u32) {
    let [ours, theirs] = [ours, theirs].map(|gpu| Checksums::new(gpu, triangles, [SIZE; 2], samples));
    let count = triangles.len() as u32;
    let (our_sums, their_sums) = (ours.draw(0..count), theirs.draw(0..count));
    let covered = their_sums[0].iter().filter(|sums| sums[0] > 0.0).count();
    assert!(covered > (SIZE * SIZE / 4) as usize, "only {covered} pixels are covered");
    if our_sums == their_sums {
        return;
    }
    let pairs = our_sums.iter().flatten().zip(their_sums.iter().flatten());
    let different = pairs.filter(|(ours, theirs)| ours != theirs).count();
    let first = first_difference(&ours, &theirs, count);
    let first = first.map(|(triangle, sample, pixel)| {
        let (x, y) = (pixel as u32 % SIZE, pixel as u32 / SIZE);
        let corners = triangles[triangle as usize];
        let half = SIZE as f32 / 2.0;
        let pixels = corners.map(|[x, y, _, w]| [half * (x / w) + half, half * (y / w) + half]);
        format!(
            "first triangle {triangle}: {corners:?}, in pixels {pixels:?}, \
             at sample {sample} of pixel ({x}, {y})"
        )
    });
    panic!("{different} samples differ; {}", first.unwrap_or_default());
}

/// Tests a quarter of a million triangles. The million is divided, so that memory and the search for a wrong triangle
/// are small.
fn quarter_of_a_million(case: &Case, samples: u32) {
    let triangles = unclipped(200 + case.shard().index as u64, 250_000);
    assert_equal(own(), lavapipe(), &triangles, samples);
}

#[gaurast_runner::test(needs = [GLSLANG, Need::Lavapipe], each = shards(4))]
fn a_million_triangles_cover_the_same_pixels(case: &Case) {
    quarter_of_a_million(case, 1);
}

#[gaurast_runner::test(needs = [GLSLANG, Need::Lavapipe], each = shards(4))]
fn a_million_triangles_cover_the_same_samples(case: &Case) {
    quarter_of_a_million(case, 4);
}

/// True if triangles with an edge near the sample explain the difference of the sums: some of them cover the sample on
/// one device only.
fn is_explained(triangles: &[[Position; 3]], place: [u32; 2], ours: [f32; 4], theirs: [f32; 4]) -> bool {
    let near: Vec<_> = (0..)
        .zip(triangles)
        .filter(|(_, triangle)| lines(triangle).iter().any(|&line| is_near(line, SMALL, place)))
        .map(|(index, _)| numbers(index))
        .collect();
    let difference = [0, 1, 2, 3].map(|channel| ours[channel] - theirs[channel]);
    is_sum(&near, difference)
}

/// True if some of `numbers`, each added or subtracted, give `sum`.
fn is_sum(numbers: &[[f32; 4]], sum: [f32; 4]) -> bool {
    let Some((first, rest)) = numbers.split_first() else {
        return sum == [0.0; 4];
    };
    [0.0, 1.0, -1.0].into_iter().any(|sign| {
        let left = [0, 1, 2, 3].map(|channel| sum[channel] - sign * first[channel]);
        is_sum(rest, left)
    })
}

fn planes() -> Vec<Variant> {
    KINDS.map(|(name, ..)| Variant::new(name)).into()
}

#[gaurast_runner::test(needs = [GLSLANG, Need::Lavapipe], each = planes())]
fn clipped_triangles_cover_the_same_samples_but_at_edges(case: &Case) {
    let planes = KINDS.into_iter().find(|(name, ..)| *name == case.variant());
    let (_, seed, plane) = planes.expect("planes");
    for samples in [1, 4] {
        let positions = clipped(seed, 1000, plane);
        let triangles: Vec<_> = positions.iter().map(|corners| corners.map(to_clip)).collect();
        let draw = |gpu| Checksums::new(gpu, &triangles, [SMALL; 2], samples).draw(0..1000);
        let (ours, theirs) = (draw(own()), draw(lavapipe()));
        assert!(theirs[0].iter().any(|sums| sums[0] > 0.0), "nothing is drawn");
        let (mut different, mut unexplained) = (0, Vec::new());
        for (sample, (ours, theirs)) in ours.iter().zip(&theirs).enumerate() {
            let offset = places(samples)[sample];
            for (pixel, (ours, theirs)) in (0..).zip(ours.iter().zip(theirs)) {
                if ours == theirs {
                    continue;
                }
                different += 1;
                let place = [16 * (pixel % SMALL) + offset[0], 16 * (pixel / SMALL) + offset[1]];
                if !is_explained(&positions, place, *ours, *theirs) {
                    unexplained.push((sample, pixel % SMALL, pixel / SMALL));
                }
            }
        }
        assert!(
            unexplained.is_empty(),
            "{samples} samples: {} of {different} differing samples are not within 1/256 of a pixel \
             from an edge, such as sample, x and y {:?}",
            unexplained.len(),
            unexplained[0]
        );
    }
}

/// A grid over the whole target. Its inner corners are moved by so little that no cell becomes concave, and its cells
/// are cut along random diagonals.
fn moved_grid(seed: u64, cells: usize) -> Vec<Triangle> {
    let mut rng = shapes::rng(seed);
    let step = 2.0 / cells as f32;
    let corners: Vec<[f32; 4]> = (0..=cells)
        .flat_map(|row| (0..=cells).map(move |column| (row, column)))
        .map(|(row, column)| {
            let inner = |index: usize| index > 0 && index < cells;
            let w = if inner(row) && inner(column) { rng.random_range(0.5..3.0f32) } else { 1.0 };
            let mut along = |index: usize| match index {
                0 => -1.0,
                _ if index == cells => 1.0,
                _ => index as f32 * step - 1.0 + rng.random_range(-0.2..0.2f32) * step,
            };
            [along(column) * w, along(row) * w, 0.5 * w, w]
        })
        .collect();
    let mut triangles = Vec::new();
    for row in 0..cells {
        for column in 0..cells {
            let at = |dx: usize, dy: usize| corners[(row + dy) * (cells + 1) + column + dx];
            if rng.random() {
                triangles.push([at(0, 0), at(1, 0), at(0, 1)]);
                triangles.push([at(0, 1), at(1, 0), at(1, 1)]);
            } else {
                triangles.push([at(0, 0), at(1, 0), at(1, 1)]);
                triangles.push([at(0, 0), at(1, 1), at(0, 1)]);
            }
        }
    }
    triangles
}

/// Slivers from one point to the whole border.
fn star(seed: u64, per_side: usize) -> Vec<Triangle> {
    let mut rng = shapes::rng(seed);
    let center = [rng.random_range(-0.3..0.3), rng.random_range(-0.3..0.3), 0.5, 1.0];
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let mut border = Vec::new();
    for side in 0..4 {
        let (from, to): ([f32; 2], [f32; 2]) = (corners[side], corners[(side + 1) % 4]);
        for step in 0..per_side {
            let t = step as f32 / per_side as f32;
            let [x, y] = [0, 1].map(|axis| from[axis] + t * (to[axis] - from[axis]));
            border.push([x, y, 0.5, 1.0]);
        }
    }
    (0..border.len()).map(|index| [center, border[index], border[(index + 1) % border.len()]]).collect()
}

/// Checks that every sample is covered by exactly one triangle of the mesh.
fn assert_watertight(gpu: &Gpu, name: &str, triangles: &[Triangle]) {
    for samples in [1, 4] {
        let count = triangles.len() as u32;
        // If one triangle covers the sample, the sums are its numbers.
        let known: std::collections::HashSet<_> = (0..count).map(|index| numbers(index).map(f32::to_bits)).collect();
        assert_eq!(known.len(), triangles.len(), "the numbers clash");
        let sums = Checksums::new(gpu, triangles, [SMALL; 2], samples).draw(0..count);
        for (sample, sums) in sums.iter().enumerate() {
            let wrong = |sums: &[f32; 4]| !known.contains(&sums.map(f32::to_bits));
            let count = sums.iter().filter(|sums| wrong(sums)).count();
            let first = sums.iter().position(wrong).map(|pixel| {
                let pixel = pixel as u32;
                (pixel % SMALL, pixel / SMALL)
            });
            assert_eq!(
                count,
                0,
                "{name} on {}: sample {sample} of {samples} is not covered once, first at {first:?}",
                gpu.name()
            );
        }
    }
}

fn drivers() -> Vec<Variant> {
    vec![Variant::new("this driver"), Variant { needs: vec![Need::Lavapipe], ..Variant::new("lavapipe") }]
}

#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn meshes_are_watertight(case: &Case) {
    let gpu = match case.variant() {
        "lavapipe" => lavapipe(),
        _ => own(),
    };
    let meshes = [
        ("coarse grid", moved_grid(220, 7)),
        ("fine grid", moved_grid(221, 100)),
        ("finer than pixels", moved_grid(222, 400)),
        ("star", star(223, 300)),
    ];
    for (name, triangles) in &meshes {
        assert_watertight(gpu, name, triangles);
    }
}
