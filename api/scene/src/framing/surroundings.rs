//! The test whether a scene is an object or surrounds its middle.

use glam::DVec3;

use super::coverage::{Coverage, Selection, rough_step};
use super::extent::{Extent, median_distance};
use crate::camera::Camera;
use crate::scene::Scene;

/// The least distance of surroundings from the middle, relative to the distance within which half of the opacity lies.
const FAR: f64 = 2.0;

/// The part of each half of the sphere of directions that surroundings cover at least.
const COVERED: f64 = 0.15;

/// The pixels of a side of each of the sphere's six pictures.
const SIDE: u32 = 32;

/// Returns true if `scene` surrounds the middle of `extent`: seen from there, what is opaque and farther away than
/// [`FAR`] times the median distance covers at least [`COVERED`] of each half of the sphere, that is to the left, to the
/// right, above, below, ahead and behind.
pub(super) fn surrounds(scene: &Scene, extent: &Extent) -> bool {
    let beyond = FAR * median_distance(scene, extent.centre);
    if beyond <= 0.0 {
        return false;
    }
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    // The solid angles in which something is, and all of them, of the halves towards each axis and away from it.
    let mut covered = [[0.0; 2]; 3];
    let mut whole = [[0.0; 2]; 3];
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let (forward, right) = (sign * axes[axis], axes[(axis + 1) % 3]);
            let rotation = [right, forward.cross(right), forward];
            let half = f64::from(SIDE) / 2.0;
            let camera = Camera {
                focal: [half; 2],
                principal: [half; 2],
                near: 1e-3 * beyond,
                ..Camera::new(rotation.map(<[f64; 3]>::from), extent.centre, 90.0, [SIDE; 2])
            };
            let coverage =
                Coverage::of(scene, &camera, Selection { beyond, is_compensated: true, step: rough_step(scene) });
            for (index, pixel) in coverage.pixels.iter().enumerate() {
                let [column, row] = [index % coverage.width, index / coverage.width].map(|place| place as f64);
                let (x, y) = ((column + 0.5 - half) / half, (row + 0.5 - half) / half);
                let direction = x * rotation[0] + y * rotation[1] + rotation[2];
                let angle = 1.0 / (direction.length() * direction.length_squared());
                for axis in 0..3 {
                    let side = usize::from(direction[axis] < 0.0);
                    whole[axis][side] += angle;
                    covered[axis][side] += if pixel.is_covered() { angle } else { 0.0 };
                }
            }
        }
    }
    let mut halves = covered.as_flattened().iter().zip(whole.as_flattened());
    halves.all(|(covered, whole): (&f64, &f64)| *covered >= COVERED * whole)
}
