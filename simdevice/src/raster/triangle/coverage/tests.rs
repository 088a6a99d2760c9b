use super::*;
use crate::geometry::{Primitive, PrimitiveKind};
use crate::raster::tile::{CENTER, SAMPLES_4};
use crate::raster::triangle::setup::Needs;
use crate::token_of;
use devmem::dispatch;
use fearless_simd::Level;
use gaurast_runner::{Case, simd_levels};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The framebuffer's width and height in these tests, in pixels.
const SIZE: i32 = 64;

fn primitive(corners: [[i32; 2]; 3], kind: PrimitiveKind) -> Primitive {
    Primitive {
        corners,
        offsets: [[0; 2]; 3],
        depth: [0.0; 3],
        inverse_w: [1.0; 3],
        vertices: [0, 1, 2],
        provoking: 0,
        id: 0,
        kind,
        front: true,
        viewport: 0,
        layer: 0,
    }
}

/// Twice the signed area of a triangle.
fn area([a, b, c]: [[i32; 2]; 3]) -> i128 {
    let [a, b, c] = [a, b, c].map(|p| p.map(i128::from));
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// The corners in the order that gives a positive area; `None` if it is zero.
fn oriented([a, b, c]: [[i32; 2]; 3]) -> Option<[[i32; 2]; 3]> {
    match area([a, b, c]) {
        0 => None,
        1.. => Some([a, b, c]),
        _ => Some([a, c, b]),
    }
}

/// True if a sample (in 1/256 pixels) is covered by the specification's rule: inside, or on a left or top edge.
pub(in crate::raster) fn covers(primitive: &Primitive, sample: [i64; 2]) -> bool {
    let [p0, p1, p2] = primitive.corners.map(|p| p.map(i128::from));
    let mut corners = vec![p0, p1, p2];
    if primitive.kind != PrimitiveKind::Triangle {
        corners.push([p0[0] + p2[0] - p1[0], p0[1] + p2[1] - p1[1]]);
    }
    let [x, y] = sample.map(i128::from);
    (0..corners.len()).all(|index| {
        let (p, q) = (corners[index], corners[(index + 1) % corners.len()]);
        let side = (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
        let left = q[1] < p[1];
        let top = q[1] == p[1] && q[0] > p[0];
        side > 0 || side == 0 && (left || top)
    })
}

/// The samples of the framebuffer that [`Coverage`] finds, within `clip`.
fn fast<const N: usize>(level: Level, primitive: &Primitive, positions: &[[i32; 2]], clip: Rect) -> Vec<[bool; N]> {
    let mut out = vec![[false; N]; (SIZE * SIZE) as usize];
    let mut setup = TriangleSetup::default();
    if !dispatch!(level, simd => setup.prepare(simd, primitive, positions, clip, Needs::default())) {
        return out;
    }
    let mut coverage = Coverage::<N>::default();
    for tile in 0..(SIZE / 16) * (SIZE / 16) {
        let (x, y) = (tile % (SIZE / 16) * 16, tile / (SIZE / 16) * 16);
        if !dispatch!(level, simd => coverage.find(simd, &setup, x, y)) {
            continue;
        }
        for block in bits(coverage.blocks) {
            for lane in 0..16 {
                let px = x + BLOCK_X[block] + LANE_X[lane];
                let py = y + BLOCK_Y[block] + LANE_Y[lane];
                let samples = &mut out[(py * SIZE + px) as usize];
                for (sample, lanes) in samples.iter_mut().zip(coverage.lanes[block]) {
                    *sample = lanes >> lane & 1 == 1;
                }
            }
        }
    }
    out
}

const EVERYTHING: Rect = Rect { x: 0, y: 0, width: SIZE as u32, height: SIZE as u32 };

/// Compares both ways for all samples, and returns the number of covered samples.
fn compare<const N: usize>(level: Level, primitive: &Primitive, positions: &[[i32; 2]], clip: Rect) -> usize {
    let fast = fast::<N>(level, primitive, positions, clip);
    let mut count = 0;
    for (at, samples) in fast.iter().enumerate() {
        let (x, y) = (at as i32 % SIZE, at as i32 / SIZE);
        let inside = x >= clip.x && y >= clip.y && x < clip.x + clip.width as i32 && y < clip.y + clip.height as i32;
        for (sample, covered) in samples.iter().enumerate() {
            let [sx, sy] = positions[sample];
            let sample = [i64::from(x) * 256 + i64::from(sx), i64::from(y) * 256 + i64::from(sy)];
            let expected = inside && covers(primitive, sample);
            assert_eq!(*covered, expected, "{primitive:?} at {x}, {y}: {sample:?}");
            count += usize::from(expected);
        }
    }
    count
}

/// Random triangles: tiny, slivers, large, huge, on the grid of pixel centres, or off screen.
fn corners(rng: &mut ChaCha8Rng) -> [[i32; 2]; 3] {
    let kind = rng.random_range(0..7);
    let spread = match kind {
        0 => 600,
        1 => 3000,
        2 => 16_384,
        3 => 1 << 20,
        4 => 1 << 28,
        _ => 8192,
    };
    let middle = [rng.random_range(-2000..18_000), rng.random_range(-2000..18_000)];
    let mut corners: [[i32; 2]; 3] =
        std::array::from_fn(|_| middle.map(|middle: i32| middle + rng.random_range(-spread..=spread)));
    match kind {
        // On centres and corners of pixels, so that samples lie on edges.
        5 => {
            for corner in &mut corners {
                *corner = corner.map(|at| at.div_euclid(128) * 128);
            }
        }
        // A sliver.
        6 => {
            let step = rng.random_range(-3..=3);
            corners[2] = [corners[1][0] + step, corners[1][1] + rng.random_range(-3..=3)];
        }
        _ => {}
    }
    corners
}

#[gaurast_runner::test(each = simd_levels())]
fn coverage_is_that_of_exact_arithmetic(case: &Case) {
    let level = token_of(case);
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    let mut covered = 0;
    for round in 0..400 {
        let Some(corners) = oriented(corners(&mut rng)) else {
            continue;
        };
        let kind = [PrimitiveKind::Triangle, PrimitiveKind::Line][usize::from(round % 5 == 4)];
        let primitive = primitive(corners, kind);
        let clip = if round % 3 == 0 {
            Rect {
                x: rng.random_range(0..30),
                y: rng.random_range(0..30),
                width: rng.random_range(1..34),
                height: rng.random_range(1..34),
            }
        } else {
            EVERYTHING
        };
        covered += compare::<1>(level, &primitive, &CENTER, clip);
        covered += compare::<4>(level, &primitive, &SAMPLES_4, clip);
    }
    assert!(covered > 100_000, "{covered}");
}

#[gaurast_runner::test]
fn neighbours_share_no_sample_and_leave_none() {
    let level = Level::new();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..60 {
        // A fan around a point within a polygon that covers everything.
        let middle = [rng.random_range(0..16_384), rng.random_range(0..16_384)];
        let far = 40_000;
        let corner = |at: i32| {
            let ring = [[-far, -far], [far, -far], [far + 5, far], [-far, far + 9]];
            ring[at as usize % 4]
        };
        let mut seen = vec![[0; 4]; (SIZE * SIZE) as usize];
        for at in 0..4 {
            let Some(corners) = oriented([middle, corner(at), corner(at + 1)]) else {
                continue;
            };
            let primitive = primitive(corners, PrimitiveKind::Triangle);
            let covered = fast::<4>(level, &primitive, &SAMPLES_4, EVERYTHING);
            for (seen, covered) in seen.iter_mut().zip(covered) {
                for (seen, covered) in seen.iter_mut().zip(covered) {
                    *seen += i32::from(covered);
                }
            }
        }
        assert!(seen.iter().all(|samples| *samples == [1; 4]));
    }
}

#[gaurast_runner::test]
fn a_point_covers_a_half_open_square() {
    // From (1.5, 1.5) to (3.5, 3.5): the centres at 1.5 and 2.5 are inside, those at 3.5 are not.
    let square = primitive([[384, 384], [896, 384], [896, 896]], PrimitiveKind::Point);
    let covered = fast::<1>(Level::new(), &square, &CENTER, EVERYTHING);
    let pixels: Vec<_> =
        (0..SIZE * SIZE).filter(|at| covered[*at as usize][0]).map(|at| (at % SIZE, at / SIZE)).collect();
    assert_eq!(pixels, [(1, 1), (2, 1), (1, 2), (2, 2)]);
}
