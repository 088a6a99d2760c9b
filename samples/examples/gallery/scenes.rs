//! The scenes of the pictures.

use crate::gpu::{Instance, Splat};
use std::f32::consts::{PI, TAU};

/// The depth of the middle of [`still_life`].
pub const MIDDLE: f32 = 4.0;

const STRAIGHT: [f32; 4] = [1.0, 0.0, 0.0, 0.0];

fn splat(
    [x, y, z]: [f32; 3],
    [sx, sy, sz]: [f32; 3],
    [qw, qx, qy, qz]: [f32; 4],
    opacity: f32,
    color: [f32; 3],
) -> Splat {
    // The constant harmonic is 1 / (2 sqrt(pi)).
    let [r, g, b] = color.map(|c| (c - 0.5) * 2.0 * PI.sqrt());
    [x, y, z, sx, sy, sz, qw, qx, qy, qz, opacity, r, g, b]
}

/// A colour of the hue circle; `at` is from 0 to 1.
fn hue(at: f32) -> [f32; 3] {
    [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|shift| 0.5 + 0.45 * (TAU * (at - shift)).cos())
}

/// The rotation by `angle` about z.
fn turned(angle: f32) -> [f32; 4] {
    [(angle / 2.0).cos(), 0.0, 0.0, (angle / 2.0).sin()]
}

/// All scenes.
pub struct Scenes {
    pub around: Vec<Splat>,
    pub wide: Vec<Splat>,
    pub crossing: Vec<Splat>,
    pub links: Vec<Splat>,
    pub floor: Vec<Splat>,
    pub veils: Vec<Splat>,
    pub needles: Vec<Splat>,
    pub still: Vec<Splat>,
    pub flower: Vec<Splat>,
    pub meadow: Vec<Instance>,
}

impl Scenes {
    pub fn new() -> Self {
        Self {
            around: around(),
            wide: wide(),
            crossing: crossing(),
            links: links(),
            floor: floor(),
            veils: veils(),
            needles: needles(),
            still: still_life(),
            flower: flower(),
            meadow: meadow(),
        }
    }
}

/// The rotation by `angle` about an axis.
fn turned_about(axis: usize, angle: f32) -> [f32; 4] {
    let mut quaternion = [(angle / 2.0).cos(), 0.0, 0.0, 0.0];
    quaternion[1 + axis] = (angle / 2.0).sin();
    quaternion
}

/// Two crossing sheets, and pairs of Gaussians at their sides in which the one with the greater depth has the smaller
/// distance. Gaussians with smaller depths come last.
fn crossing() -> Vec<Splat> {
    let sheet = [0.75, 0.55, 0.01];
    let mut splats = vec![
        splat([0.0, 0.0, 2.65], sheet, turned_about(1, -1.0), 0.99, hue(0.05)),
        splat([0.0, 0.0, 2.6], sheet, turned_about(1, 1.0), 0.99, hue(0.55)),
    ];
    for side in [-1.0, 1.0] {
        let size = [0.35, 0.8, 0.1];
        splats.push(splat([2.75 * side, 0.25, 2.5], size, STRAIGHT, 0.98, hue(0.3)));
        splats.push(splat([3.15 * side, -0.25, 2.4], size, STRAIGHT, 0.98, hue(0.8)));
    }
    splats
}

/// The number of Gaussians of each ring of [`links`].
pub const RINGS: [u32; 2] = [40, 40];

/// Two linked rings.
fn links() -> Vec<Splat> {
    let mut splats = Vec::new();
    for (ring, count) in RINGS.into_iter().enumerate() {
        for i in 0..count {
            let (sin, cos) = (TAU * i as f32 / count as f32).sin_cos();
            // One ring is vertical, the other is horizontal and tilted.
            let position = match ring {
                0 => [0.75 * cos - 0.4, 0.75 * sin, MIDDLE + 0.2 * cos],
                _ => [0.75 * cos + 0.4, 0.25 * sin, MIDDLE + 0.7 * sin],
            };
            let color = hue(0.1 + 0.45 * ring as f32);
            splats.push(splat(position, [0.085; 3], STRAIGHT, 0.97, color));
        }
    }
    splats
}

/// Discs on a floor and on two walls.
fn floor() -> Vec<Splat> {
    let mut splats = Vec::new();
    for row in (0..6).rev() {
        let z = 0.75 + 0.75 * row as f32;
        let lies = turned_about(0, PI / 2.0);
        let stands = turned_about(1, PI / 2.0);
        let size = [0.26, 0.26, 0.0];
        for column in -1..=1 {
            let at = [0.75 * column as f32, 0.55, z];
            splats.push(splat(at, size, lies, 0.95, hue(0.13 * (row + column) as f32)));
        }
        for side in [-1.0, 1.0] {
            let color = hue(0.5 + 0.13 * row as f32);
            splats.push(splat([1.1 * side, -0.2, z], size, stands, 0.95, color));
        }
    }
    splats
}

/// Tilted needles behind nearly transparent layers.
fn veils() -> Vec<Splat> {
    let mut splats = Vec::new();
    for i in 0..60 {
        let color = hue(i as f32 / 15.0);
        let place = [0.5 * (i as f32).sin(), 0.3 * (1.7 * i as f32).cos(), 3.0 + 0.01 * i as f32];
        splats.push(splat(place, [0.5, 0.5, 0.01], STRAIGHT, 0.03, color));
    }
    for i in 0..9 {
        let x = 0.5 * (i as f32 - 4.0);
        let turn = turned(0.35 + 0.1 * i as f32);
        splats.push(splat([x, 0.0, 5.0], [0.006, 1.3, 0.006], turn, 0.95, hue(i as f32 / 9.0)));
    }
    splats
}

/// Needles that become thinner to the right.
fn needles() -> Vec<Splat> {
    (0..24)
        .map(|i| {
            let x = 0.23 * (i as f32 - 11.5);
            let width = 0.03 * 0.82f32.powi(i);
            let size = [width, 0.9, width];
            splat([x, 0.0, 4.5], size, turned(0.12), 0.9, hue(i as f32 / 24.0))
        })
        .collect()
}

/// Gaussians on a sphere around the eye.
fn around() -> Vec<Splat> {
    let mut splats = Vec::new();
    for ring in -4..=4i32 {
        let latitude = PI * ring as f32 / 8.0;
        let count = (24.0 * latitude.cos()).round().max(1.0) as usize;
        for i in 0..count {
            let longitude = TAU * i as f32 / count as f32;
            let (sin, cos) = longitude.sin_cos();
            let out = 3.0 * latitude.cos();
            let position = [out * sin, 3.0 * latitude.sin(), out * cos];
            let color = if ring == 0 { [0.95; 3] } else { hue(longitude / TAU) };
            let size = if ring == 0 { 0.1 } else { 0.19 };
            splats.push(splat(position, [size; 3], STRAIGHT, 0.95, color));
        }
    }
    splats
}

/// Gaussians on a plane across the view, each elongated away from it.
fn wide() -> Vec<Splat> {
    let mut splats = Vec::new();
    for row in -2..=2i32 {
        for column in -3..=3i32 {
            let position = [0.8 * column as f32, 0.62 * row as f32, 1.0];
            let color = hue(0.13 * (row + column) as f32);
            let size = [0.07, 0.07, 0.36];
            splats.push(splat(position, size, STRAIGHT, 0.95, color));
        }
    }
    splats
}

/// Rings of Gaussians, one in front of another.
fn still_life() -> Vec<Splat> {
    let mut splats = Vec::new();
    for ring in 0..3 {
        let z = MIDDLE + 0.8 * (ring as f32 - 1.0) + 0.2;
        for i in 0..10 {
            let angle = TAU * (i as f32 / 10.0 + 0.07 * ring as f32);
            let (sin, cos) = angle.sin_cos();
            let radius = 0.55 + 0.35 * ring as f32;
            let position = [radius * cos * 1.3, radius * sin, z];
            let size = [0.3, 0.12, 0.08];
            let color = hue(0.33 * ring as f32 + 0.02 * i as f32);
            splats.push(splat(position, size, turned(angle), 0.95, color));
        }
    }
    splats
}

/// Petals around a centre, on a stem.
fn flower() -> Vec<Splat> {
    let z = 4.0;
    let mut splats = vec![
        splat([0.0, 0.45, z], [0.03, 0.3, 0.03], STRAIGHT, 0.95, [0.15, 0.5, 0.15]),
        splat([0.0, 0.0, z - 0.06], [0.09; 3], STRAIGHT, 0.98, [0.95, 0.8, 0.2]),
    ];
    for i in 0..7 {
        let angle = TAU * i as f32 / 7.0;
        let (sin, cos) = angle.sin_cos();
        let position = [0.22 * cos, 0.22 * sin, z];
        let color = [0.9, 0.35 + 0.03 * i as f32, 0.6];
        splats.push(splat(position, [0.12, 0.07, 0.02], turned(angle), 0.95, color));
    }
    splats
}

/// The placements of the flowers of a meadow: rotated, sheared and of many sizes.
fn meadow() -> Vec<Instance> {
    let mut instances = Vec::new();
    for row in 0..6 {
        for column in 0..10 {
            let number = (row * 10 + column) as f32;
            let random = |seed: f32| (number * seed).sin();
            let size = 0.42 + 0.1 * random(12.9);
            let lean = 0.5 * random(78.2);
            let (sin, cos) = (1.2 * random(37.7)).sin_cos();
            let depth = 2.2 + 1.1 * row as f32;
            let x = 0.36 * depth * (column as f32 - 4.5 + 0.4 * random(93.9)) / 2.2;
            // Rotated about y, then sheared. The model is around (0, 0, 4).
            let rows = [[size * cos, size * lean, size * sin], [0.0, size, 0.0], [-size * sin, 0.0, size * cos]];
            let to = [x, 0.62, depth];
            let mut instance = [1.0; 13];
            for (axis, row) in rows.iter().enumerate() {
                instance[4 * axis..][..3].copy_from_slice(row);
                instance[4 * axis + 3] = to[axis] - 4.0 * row[2];
            }
            instance[12] = if row < 4 { 1.0 } else { 0.75 - 0.3 * (row - 4) as f32 };
            instances.push(instance);
        }
    }
    instances
}
