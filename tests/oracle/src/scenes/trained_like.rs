//! Scenes with the statistics of captured ones: an object in the middle, ground around it, and a far background.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use gaurast_scene::random::normal;
use gaurast_scene::{Camera, GaussianShape, SH_C0, Scene, sigmoid};

/// The percentage of Gaussians that belong to the object, and to the ground. The others are background.
const OBJECT: u32 = 30;
const GROUND: u32 = 40;
const DENSE: u32 = OBJECT + GROUND;

/// The blobs that the object is made of.
const BLOBS: usize = 12;

/// `count` Gaussians of degree 3 around what `cameras` look at, as a scene of Mip-NeRF 360's
/// kind has them after training: surfaces that are just covered, whatever the count; most
/// Gaussians flat and small, a third of them far behind, large and faint.
///
/// # Panics
/// If there is no camera.
pub fn trained_like(seed: u64, count: usize, cameras: &[Camera]) -> Scene {
    let place = Surroundings::of(cameras);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let blobs: [(DVec3, f64); BLOBS] = std::array::from_fn(|_| {
        let middle = 0.2 * place.radius * direction(&mut rng);
        (middle, place.radius * rng.random_range(0.05..0.2))
    });
    let mut scene = Scene::with_capacity(3, count);
    let mut sh = [[0.0; 3]; 16];
    for _ in 0..count {
        let (offset, spacing) = match rng.random_range(0..100) {
            ..OBJECT => object(&mut rng, &blobs, count),
            OBJECT..DENSE => ground(&mut rng, place.radius, count),
            _ => background(&mut rng, place.radius, count),
        };
        let size = 0.8 * spacing * libm::exp(0.7 * normal(&mut rng));
        let shape = GaussianShape {
            scale: [1.0, libm::exp(-0.5 * normal(&mut rng).abs()), libm::exp(-2.0 + 0.5 * normal(&mut rng))]
                .map(|s| (size * s) as f32),
            rotation: std::array::from_fn(|_| normal(&mut rng) as f32),
            opacity: sigmoid(2.0 * normal(&mut rng)),
        };
        let grey = rng.random_range(0.1..0.9);
        sh[0] = std::array::from_fn(|_| ((grey + 0.1 * normal(&mut rng) - 0.5) / SH_C0) as f32);
        for rgb in &mut sh[1..] {
            *rgb = std::array::from_fn(|_| (0.06 * normal(&mut rng)) as f32);
        }
        let position = place.middle + place.axes * offset;
        scene.push(position.as_vec3().to_array(), shape, &sh);
    }
    scene
}

/// The positions and viewing directions of the cameras.
struct Surroundings {
    middle: DVec3,
    /// The cameras' usual distance from the middle.
    radius: f64,
    /// Columns: two along the ground, and up.
    axes: DMat3,
}

impl Surroundings {
    fn of(cameras: &[Camera]) -> Self {
        assert!(!cameras.is_empty(), "a captured scene has cameras");
        let eyes = || cameras.iter().map(|camera| DVec3::from_array(camera.eye));
        // The point nearest to all lines of sight, by least squares.
        let (mut matrix, mut sum) = (DMat3::ZERO, DVec3::ZERO);
        for (camera, eye) in cameras.iter().zip(eyes()) {
            let forward = DVec3::from_array(camera.rotation[2]);
            let across =
                DMat3::IDENTITY - DMat3::from_cols(forward * forward.x, forward * forward.y, forward * forward.z);
            matrix += across;
            sum += across * eye;
        }
        let middle = if matrix.determinant().abs() > 1e-9 {
            matrix.inverse() * sum
        } else {
            // All lines of sight are parallel, as with one camera: the point 4 units in front of the first is taken.
            DVec3::from_array(cameras[0].eye) + 4.0 * DVec3::from_array(cameras[0].rotation[2])
        };
        let mut distances: Vec<f64> = eyes().map(|eye| eye.distance(middle)).collect();
        distances.sort_by(f64::total_cmp);
        let down: DVec3 = cameras.iter().map(|camera| DVec3::from_array(camera.rotation[1])).sum();
        let up = (-down).try_normalize().unwrap_or(DVec3::NEG_Y);
        let (x, y) = up.any_orthonormal_pair();
        Self { middle, radius: distances[distances.len() / 2].max(1e-3), axes: DMat3::from_cols(x, y, up) }
    }
}

fn direction(rng: &mut ChaCha8Rng) -> DVec3 {
    let up: f64 = rng.random_range(-1.0..1.0);
    let (sin, cos) = libm::sincos(rng.random_range(0.0..TAU));
    let ring = (1.0 - up * up).sqrt();
    DVec3::new(ring * cos, ring * sin, up)
}

/// The distance between neighbouring points if `share` percent of `count` points lie on `area`.
fn spacing(area: f64, share: u32, count: usize) -> f64 {
    (area * 100.0 / (f64::from(share) * count as f64)).sqrt()
}

/// A point of the blobs' surfaces, and the points' spacing there.
fn object(rng: &mut ChaCha8Rng, blobs: &[(DVec3, f64); BLOBS], count: usize) -> (DVec3, f64) {
    let (middle, radius) = blobs[rng.random_range(0..BLOBS)];
    let area = 2.0 * TAU * radius * radius * BLOBS as f64;
    (middle + radius * direction(rng), spacing(area, OBJECT, count))
}

/// A point of the ground, which is denser where the cameras are.
fn ground(rng: &mut ChaCha8Rng, radius: f64, count: usize) -> (DVec3, f64) {
    let distance = 3.0 * radius * rng.random::<f64>();
    let (sin, cos) = libm::sincos(rng.random_range(0.0..TAU));
    let area = TAU * distance.max(0.1 * radius) * 3.0 * radius;
    let height = -0.35 * radius + 0.02 * radius * normal(rng);
    (DVec3::new(distance * cos, distance * sin, height), spacing(area, GROUND, count))
}

/// A point far behind.
fn background(rng: &mut ChaCha8Rng, radius: f64, count: usize) -> (DVec3, f64) {
    let distance = 3.0 * radius * libm::pow(5.0, rng.random());
    let mut towards = direction(rng);
    towards.z = 0.7 * towards.z.abs() - 0.1;
    let area = TAU * distance * distance;
    (distance * towards, spacing(area, 100 - DENSE, count))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_captured_scene_is_before_its_cameras() {
        let cameras = Camera::orbit(16, [640, 360]);
        let scene = trained_like(1, 10_000, &cameras);
        assert_eq!((scene.len(), scene.sh_degree()), (10_000, 3));
        assert_eq!(scene, trained_like(1, 10_000, &cameras));
        for camera in &cameras {
            let seen = scene.positions().iter().filter(|position| {
                camera
                    .project(position.map(f64::from))
                    .is_some_and(|[x, y]| (0.0..640.0).contains(&x) && (0.0..360.0).contains(&y))
            });
            let seen = seen.count();
            assert!((2000..9000).contains(&seen), "{seen}");
        }
    }
}
