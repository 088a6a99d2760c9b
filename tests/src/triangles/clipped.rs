//! Triangles that the planes of the view volume cut, with exact coverage by [`edges`](super::edges).

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::edges::Position;

/// The side of the square target in pixels, for clipped triangles.
pub const SIZE: u32 = 256;

/// A generator of a corner of a triangle that some planes cut.
pub type Plane = fn(&mut ChaCha8Rng) -> Position;

/// Triangles that some planes cut, in units of 1/64.
pub fn clipped(seed: u64, count: usize, plane: Plane) -> Vec<[Position; 3]> {
    let mut rng = gaurast_testkit::shapes::rng(seed);
    (0..count).map(|_| [0; 3].map(|_| plane(&mut rng))).collect()
}

/// A random position with `w` between 1/16 and 4, and with `x` and `y` inside the side planes, unless `wide` is set.
fn position(rng: &mut ChaCha8Rng, wide: [bool; 2]) -> Position {
    let w = rng.random_range(32..256);
    let [x, y] = wide.map(|wide| {
        let reach = if wide { 3 * w } else { w };
        rng.random_range(-reach..=reach)
    });
    [x, y, rng.random_range(0..=w), w]
}

fn left_and_right(rng: &mut ChaCha8Rng) -> Position {
    position(rng, [true, false])
}

fn top_and_bottom(rng: &mut ChaCha8Rng) -> Position {
    position(rng, [false, true])
}

fn far_plane(rng: &mut ChaCha8Rng) -> Position {
    let [x, y, _, w] = position(rng, [false, false]);
    [x, y, rng.random_range(0..2 * w), w]
}

fn near_plane(rng: &mut ChaCha8Rng) -> Position {
    let [x, y, _, w] = position(rng, [false, false]);
    [x, y, rng.random_range(-w..w), w]
}

/// A random position, for some corners behind the eye, as a perspective projection gives it.
fn behind_the_eye(rng: &mut ChaCha8Rng) -> Position {
    let w = rng.random_range(-128..256);
    let [x, y] = [0; 2].map(|_| rng.random_range(-256..=256));
    // The near plane is at w = 1/2.
    [x, y, w - 32, w]
}

fn all_planes(rng: &mut ChaCha8Rng) -> Position {
    let w = rng.random_range(-64..256i64);
    let [x, y] = [0; 2].map(|_| rng.random_range(-512..=512));
    [x, y, w - 32 + rng.random_range(-8..=8), w]
}

/// The clip planes of the view volume, each with a name, a seed, and a generator of corners.
pub const KINDS: [(&str, u64, Plane); 6] = [
    ("left and right", 210, left_and_right),
    ("top and bottom", 211, top_and_bottom),
    ("near", 212, near_plane),
    ("far", 213, far_plane),
    ("behind the eye", 214, behind_the_eye),
    ("all", 215, all_planes),
];

/// The sample positions in a pixel, in sixteenths, for one sample or four.
pub fn places(samples: u32) -> &'static [[u32; 2]] {
    match samples {
        1 => &[[8, 8]],
        _ => &[[6, 2], [14, 6], [2, 10], [10, 14]],
    }
}

/// The size of a frame of [`floor`] in pixels.
pub const FRAME: u32 = 693;

/// The number of frames of [`floor`].
pub const FRAMES: u32 = 3;

/// The two triangles of a large floor under the eye, some of whose corners are behind the eye, as a perspective projection gives
/// them. The camera turns from frame to frame.
pub fn floor(frame: u32) -> [[Position; 3]; 2] {
    let (sin, cos) = (0.2 + 0.37 * f64::from(frame)).sin_cos();
    let corner = |x: f64, z: f64| {
        let (x, z) = (cos * x - sin * z, sin * x + cos * z);
        // The floor is 1.25 below the eye, the near plane at 1/2.
        [1.5 * x, 1.5 * 1.25, z - 0.5, z].map(|coordinate| (64.0 * coordinate).round() as i64)
    };
    let corners = [(-9.0, -3.0), (9.0, -3.0), (9.0, 17.0), (-9.0, 17.0)];
    let [a, b, c, d] = corners.map(|(x, z)| corner(x, z));
    [[a, b, c], [a, c, d]]
}
